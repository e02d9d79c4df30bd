"""Depth of one camera as another one beside it would have measured it."""

import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.camera import Intrinsics, project
from riseg_drake.geometry.lens import Lens, grid_rays
from riseg_drake.geometry.se3 import move_points

SEAM = 0.25
"""Pixels by which what a pixel of depth covers is widened on each side where nothing else lies, so that
surfaces at a slant get no holes."""
WIDEST = 16
"""Pixels a side that one pixel of depth covers at most; more would be a point at the lens."""


def align_depth(
    depth: NDArray[np.float32], lens_D: Lens, X_CD: NDArray[np.float64], intrinsics: Intrinsics
) -> NDArray[np.float32]:
    """The depth image [h, w], m, 0 = invalid, of a pinhole C from the one [H, W] of a depth camera D.

    Each pixel of D is a small square at its depth; it covers the pixels of C whose centres lie in its
    projection, and the nearest surface wins. `X_CD` [4, 4] is the pose of D in C.
    """
    v, u = np.nonzero(depth > 0)
    z = depth[v, u].astype(np.float64)[:, None]
    corners = [
        project(move_points(X_CD, grid_rays(lens_D, du, dv)[v, u] * z), intrinsics)
        for du, dv in ((-0.5, -0.5), (0.5, -0.5), (-0.5, 0.5), (0.5, 0.5))
    ]
    z_C = move_points(X_CD, grid_rays(lens_D, 0.0, 0.0)[v, u] * z)[:, 2].astype(np.float32)
    least, most = np.minimum.reduce(corners), np.maximum.reduce(corners)
    ahead = (z_C > 0) & np.isfinite(least).all(1) & np.isfinite(most).all(1)
    least, most, z_C = least[ahead], most[ahead], z_C[ahead]
    exact = _nearest(least, most, z_C, intrinsics)
    return np.where(exact > 0, exact, _nearest(least - SEAM, most + SEAM, z_C, intrinsics))


def _nearest(least: NDArray, most: NDArray, z: NDArray, intrinsics: Intrinsics) -> NDArray[np.float32]:
    """The least z [N] of the rectangles, from one corner (u, v) to the other, [N, 2], that hold the centre of
    each pixel, [h, w]; 0 where there is none."""
    size = np.array([intrinsics.width, intrinsics.height])
    first, end = np.ceil(least), np.ceil(most)
    seen = ((first < size) & (end > 0)).all(1)
    first, end, z = first[seen], np.minimum(end[seen], first[seen] + WIDEST), z[seen]
    first, end = np.maximum(first, 0).astype(np.int64), np.minimum(end, size).astype(np.int64)
    aligned = np.full(intrinsics.width * intrinsics.height, np.inf, np.float32)
    extent = end - first
    for dv in range(int(extent[:, 1].max(initial=0))):
        for du in range(int(extent[:, 0].max(initial=0))):
            covers = (extent > (du, dv)).all(1)
            pixels = (first[covers, 1] + dv) * intrinsics.width + first[covers, 0] + du
            np.minimum.at(aligned, pixels, z[covers])
    return np.where(aligned < np.inf, aligned, 0).astype(np.float32).reshape(intrinsics.shape)
