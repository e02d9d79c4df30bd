"""Alg. 2, line 1: the flow that the camera's own motion causes in a world that stands still."""

import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.camera import Intrinsics

_ROWS = 64
"""Rows of an image that are worked on at once: what is made of them stays in the processor's cache."""


def pixel_projection(X_C1C0: NDArray[np.float64], intrinsics: Intrinsics) -> NDArray[np.float32]:
    """Eq. 4 and 5 as one projective map of pixels and their inverse depth.

    What appears in C0 at pixel (u, v) and depth z appears in C1 at (a / c, b / c) and depth c z, with
    [a, b, c] = M [u, v, 1, 1 / z]: camT [K^-1 z [u, v, 1]; 1] projected by K, divided by z.

    Args:
        X_C1C0: [4, 4], takes points of C0 to C1. For E_t this is the paper's camT_{t-1,t}; for a body
            that moves it is camT times the body's motion.
        intrinsics: of both views.

    Returns:
        M [3, 4].
    """
    k = intrinsics
    K = np.array([[k.fx, 0.0, k.cx], [0.0, k.fy, k.cy], [0.0, 0.0, 1.0]])
    return of_pixels(K @ X_C1C0[:3], k).astype(np.float32)


def of_pixels(rows: NDArray[np.float64], intrinsics: Intrinsics) -> NDArray[np.float64]:
    """A linear map [k, 4] of points (x, y, z, 1) as one of their pixels (u, v, 1, 1 / z), whose values are
    divided by z."""
    k, M = intrinsics, rows.copy()
    # Its first three columns times K^-1, written out: this is asked for with every motion.
    M[:, 0] /= k.fx
    M[:, 1] /= k.fy
    M[:, 2] -= k.cx * M[:, 0] + k.cy * M[:, 1]
    return M


def expected_flow(
    depth_0: NDArray[np.float32], X_C1C0: NDArray[np.float64], intrinsics: Intrinsics
) -> NDArray[np.float32]:
    """E_t [H, W, 2] in pixels: the flow due to the camera's motion alone (eq. 4 and 5).

    Args:
        depth_0: [H, W], m, at t-1; 0 = invalid.
        X_C1C0: [4, 4], see `pixel_projection`.
        intrinsics: of both views.

    Returns:
        [H, W, 2], pixels; NaN where depth is invalid or the point is not ahead of C1.
    """
    M = pixel_projection(X_C1C0, intrinsics)
    u = np.arange(intrinsics.width, dtype=np.float32)[None, :]
    v = np.arange(intrinsics.height, dtype=np.float32)[:, None]
    flow = np.empty((*depth_0.shape, 2), np.float32)
    for start in range(0, intrinsics.height, _ROWS):
        rows = slice(start, start + _ROWS)
        with np.errstate(divide="ignore", invalid="ignore"):
            # Where there is no depth this is infinite, and the flow, infinite by infinite, not a number.
            inverse_depth = np.float32(1) / depth_0[rows]
            a, b, c = (
                (M[k, 3] * inverse_depth + M[k, 0] * u) + (M[k, 1] * v[rows] + M[k, 2]) for k in range(3)
            )
            np.copyto(c, np.nan, where=c <= 0)
            np.subtract(a / c, u, out=flow[rows, :, 0])
            np.subtract(b / c, v[rows], out=flow[rows, :, 1])
    return flow
