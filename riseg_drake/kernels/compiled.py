"""How kernels are compiled: by numba, once for each machine and version, kept for the next start.

Kept beside the code, or in the platform's cache folder where that is read-only; nowhere where neither can be
written, and then every start compiles anew. NUMBA_CACHE_DIR names another place.
"""

from collections.abc import Callable
from typing import TypeVar

from numba import njit

Kernel = TypeVar("Kernel", bound=Callable)


def compiled(signature: str = "") -> Callable[[Kernel], Kernel]:
    """A function on numbers and arrays, beside which other threads run.

    Compiled for its `signature`, in numba's notation, when it is imported, so that no frame and no robot waits
    for it; for other types, or without one, when it is first called.
    """

    def compile_it(function: Kernel) -> Kernel:
        try:
            kernel = njit(function, cache=True, nogil=True)
        except RuntimeError:  # numba: "no locator available"
            kernel = njit(function, nogil=True)
        if signature:
            kernel.compile(signature)
        return kernel

    return compile_it
