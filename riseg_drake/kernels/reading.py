"""Reading an image between and at its pixels, as OpenCV's remap does."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from riseg_drake.kernels.compiled import compiled

Real = float | np.floating[Any]


@compiled()
def between(image: NDArray[np.float32], u: Real, v: Real) -> Real:
    """The value of an image [H, W] at a place, bilinear; NaN beyond its edges and beside any NaN."""
    if not (u >= 0 and v >= 0 and u < image.shape[1] - 1 and v < image.shape[0] - 1):
        return np.float32(np.nan)
    j, i = int(u), int(v)
    s, t = np.float32(u - j), np.float32(v - i)
    above = image[i, j] + s * (image[i, j + 1] - image[i, j])
    below = image[i + 1, j] + s * (image[i + 1, j + 1] - image[i + 1, j])
    return above + t * (below - above)


@compiled()
def nearest(image: NDArray[np.float32] | NDArray[np.int32], u: Real, v: Real) -> Real:
    """The value of the pixel of an image [H, W] that is nearest to a place; 0 beyond its edges."""
    if not (u >= -0.5 and v >= -0.5 and u < image.shape[1] - 0.5 and v < image.shape[0] - 0.5):
        return np.float32(0)
    return image[int(v + 0.5), int(u + 0.5)]


@compiled()
def placed(M: NDArray[np.float32], u: Real, v: Real, per_z: Real) -> tuple[Real, Real, Real]:
    """Where what is seen at (u, v) and depth 1 / per_z is in another view by M [3, 4], `pixel_projection`:
    u, v, and by what factor its depth has grown; NaN for a point that is not ahead."""
    c = M[2, 0] * u + M[2, 1] * v + M[2, 2] + M[2, 3] * per_z
    if not c > 0:
        nan = np.float32(np.nan)
        return nan, nan, nan
    a = M[0, 0] * u + M[0, 1] * v + M[0, 2] + M[0, 3] * per_z
    b = M[1, 0] * u + M[1, 1] * v + M[1, 2] + M[1, 3] * per_z
    return a / c, b / c, c


@compiled()
def projected(M: NDArray[np.float32], pixel: NDArray[np.float32], n: int) -> tuple[Real, Real, Real]:
    """Where pixel n of `pixel` [4, N], (u, v, 1, 1 / z), is in another view, as `placed`."""
    return placed(M, pixel[0, n], pixel[1, n], pixel[3, n])
