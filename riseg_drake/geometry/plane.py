"""Planes, and heights above them.

A plane in frame F is `plane_F = [n_x, n_y, n_z, d]` with a unit normal n: a point Q has the height
`n . p_FQ + d` above it, in metres.
"""

import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.camera import Intrinsics


def heights_above_plane(depth: NDArray, intrinsics: Intrinsics, plane_C: NDArray) -> NDArray[np.float32]:
    """Height [H, W] of what each pixel sees above the plane, m; NaN where depth is invalid (0).

    n . p + d with p = depth * ray, and n . ray is linear in u and in v: no point is ever built.
    """
    n_x, n_y, n_z, d = (float(value) for value in plane_C)
    along_u = (n_x * (np.arange(intrinsics.width) - intrinsics.cx) / intrinsics.fx + n_z).astype(np.float32)
    along_v = (n_y * (np.arange(intrinsics.height) - intrinsics.cy) / intrinsics.fy).astype(np.float32)
    height = along_u[None, :] + along_v[:, None]
    height *= depth
    height += np.float32(d)
    np.copyto(height, np.nan, where=~(depth > 0))
    return height


def transform_plane(X_AB: NDArray, plane_B: NDArray) -> NDArray[np.float64]:
    """The plane [4] measured in A instead of B: plane_W = transform_plane(X_WC, plane_C)."""
    normal_A = X_AB[:3, :3] @ plane_B[:3]
    return np.append(normal_A, plane_B[3] - normal_A @ X_AB[:3, 3])
