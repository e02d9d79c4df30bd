"""How kernels are compiled: by numba, once for each machine and version, kept for the next start.

Kept beside the code, or in the platform's cache folder where that is read-only; nowhere where neither can be
written, and then every start compiles anew. NUMBA_CACHE_DIR names another place.
"""

from collections.abc import Callable
from typing import TypeVar

from numba import njit

Kernel = TypeVar("Kernel", bound=Callable)


def compiled(function: Kernel) -> Kernel:
    """A function on numbers and arrays, compiled at its first call; other threads run beside it."""
    try:
        return njit(function, cache=True, nogil=True)
    except RuntimeError:  # numba: "no locator available"
        return njit(function, nogil=True)
