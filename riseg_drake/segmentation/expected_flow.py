"""Alg. 2, line 1: the flow that the camera's own motion causes in a world that stands still."""

import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.camera import WHOLE, Intrinsics, Region, pixel_grid, rays


def where_to(
    ray: NDArray[np.float32],
    depth: NDArray[np.float32],
    X_C1C0: NDArray[np.float64],
    intrinsics: Intrinsics,
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Where points of C0 appear in C1, and how far away they are there.

    Args:
        ray: [..., 3], the points at unit depth behind their pixels in C0.
        depth: [...], m, in C0; 0 = invalid.
        X_C1C0: [4, 4], takes points of C0 to C1. For E_t this is the paper's camT_{t-1,t}; for a body
            that moves it is camT times the body's motion.
        intrinsics: of C1.

    Returns:
        Pixels (u, v) [..., 2], NaN where depth is invalid or the point is not ahead of C1; depth in C1
        [...], m, meaningless there.
    """
    # Eq. 4 and 5 in inverse depth: camT [z r; 1] projects like R r + p / z, which needs no dMap.
    R, p = X_C1C0[:3, :3].astype(np.float32), X_C1C0[:3, 3].astype(np.float32)
    with np.errstate(divide="ignore", invalid="ignore"):
        inverse_depth = np.where(depth > 0, np.float32(1) / depth, np.float32(np.nan))
        r_x, r_y = ray[..., 0], ray[..., 1]
        x = R[0, 0] * r_x + R[0, 1] * r_y + (R[0, 2] + p[0] * inverse_depth)
        y = R[1, 0] * r_x + R[1, 1] * r_y + (R[1, 2] + p[1] * inverse_depth)
        z = R[2, 0] * r_x + R[2, 1] * r_y + (R[2, 2] + p[2] * inverse_depth)
        per_z = np.where(z > 0, np.float32(1) / z, np.float32(np.nan))
    uv = np.empty((*depth.shape, 2), np.float32)
    uv[..., 0] = x * per_z * np.float32(intrinsics.fx) + np.float32(intrinsics.cx)
    uv[..., 1] = y * per_z * np.float32(intrinsics.fy) + np.float32(intrinsics.cy)
    return uv, z * depth


def flow_of_motion(
    depth: NDArray[np.float32],
    X_C1C0: NDArray[np.float64],
    intrinsics: Intrinsics,
    region: Region = WHOLE,
) -> NDArray[np.float32]:
    """Where the points behind the pixels of C0 appear in C1, less where they were.

    Args:
        depth: [h, w], metres, of the region of the view C0; 0 = invalid.
        X_C1C0: [4, 4], see `where_to`.
        intrinsics: of both views.
        region: the part of C0 that `depth` is of; all of it by default.

    Returns:
        [h, w, 2], pixels; NaN where depth is invalid or the point is not ahead of C1.
    """
    uv, _ = where_to(rays(intrinsics)[region], depth, X_C1C0, intrinsics)
    uv -= pixel_grid(*intrinsics.shape)[region]
    return uv


def expected_flow(
    depth_0: NDArray[np.float32], X_C1C0: NDArray[np.float64], intrinsics: Intrinsics
) -> NDArray[np.float32]:
    """E_t [H, W, 2] in pixels: the flow due to the camera's motion alone (eq. 4 and 5)."""
    return flow_of_motion(depth_0, X_C1C0, intrinsics)
