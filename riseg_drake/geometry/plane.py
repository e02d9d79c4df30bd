"""Planes: the table top under everything, fitted to a depth image, and heights above it.

A plane in frame F is `plane_F = [n_x, n_y, n_z, d]` with a unit normal n: a point Q has the height
`n . p_FQ + d` above it, in metres. Planes fitted here have the camera on their upper side.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.camera import Intrinsics


class NoPlaneError(ValueError):
    """Why an image shows no table top, in one line."""


@dataclass
class PlaneFitParameters:
    """How to look for the table top. The paper says only that it is found by RANSAC (Alg. 3, line 1)."""

    hypotheses: int = 256
    """Planes through three random points that are tried. With a third of the points on the table, one
    in 27 is right, so the chance that none is lies below 1e-4."""
    points: int = 2048
    """Random pixels that take part; the first quarter of them score the hypotheses."""
    tolerance: float = 0.003
    """Distance, m, within which a point without depth noise would count as lying on the plane."""
    depth_noise: float = 0.0023
    """Standard deviation of depth at 1 m, m; it grows with the square of depth (D415: 0.08 px of
    disparity, 55 mm baseline)."""
    below_penalty: float = 0.5
    """What a point below the plane costs, in points on it. Things stand on a table and nothing is under
    it, so the top of a big box loses against the table that shows beside it."""
    near: float = 1.5
    """What is farther away than so many times the nearest fifth counts less, by the square of depth."""
    minimum_share: float = 0.15
    """Share of the valid points that a plane must hold to be believed."""
    prior_angle: float = 0.35
    """Largest angle, rad, between the plane's normal and a prior normal, where one is given."""


def fit_plane(
    depth: NDArray,
    intrinsics: Intrinsics,
    rng: np.random.Generator,
    parameters: PlaneFitParameters | None = None,
    *,
    valid: NDArray[np.bool_] | None = None,
    prior_normal_C: NDArray | None = None,
) -> NDArray[np.float64]:
    """The dominant plane with next to nothing below it, by RANSAC and two least squares refits.

    Args:
        depth: [H, W], metres, 0 = invalid.
        intrinsics: of the camera that took it.
        rng: draws the points and the hypotheses.
        parameters: the defaults if None.
        valid: [H, W], pixels that may take part (leave out the robot's own), all if None.
        prior_normal_C: [3], roughly the normal to expect, in C; any if None.

    Returns:
        plane_C [4]; the camera's centre has a positive height.

    Raises:
        NoPlaneError: where the image shows no such plane.
    """
    parameters = parameters or PlaneFitParameters()
    p_CQ, tolerance = _sample(depth, intrinsics, rng, parameters, valid)
    scoring = max(3, len(p_CQ) // 4)
    planes = _planes_through_triplets(p_CQ, rng, parameters.hypotheses)
    if prior_normal_C is not None and len(planes):
        prior = np.asarray(prior_normal_C, float) / np.linalg.norm(prior_normal_C)
        planes = planes[planes[:, :3] @ prior >= np.cos(parameters.prior_angle)]
    if not len(planes):
        raise NoPlaneError("no plane: all triplets drawn lie on a line or face away from the prior")

    # What is near counts more: a table seen from beside may show less of itself than of floor and wall.
    z = p_CQ[:scoring, 2]
    nearness = np.minimum(1.0, np.square(parameters.near * np.quantile(z, 0.2) / z)).astype(np.float32)
    heights = planes[:, :3].astype(np.float32) @ p_CQ[:scoring].T.astype(np.float32)
    heights += planes[:, 3:].astype(np.float32)
    heights /= tolerance[:scoring].astype(np.float32)
    on = (np.abs(heights) <= 1).astype(np.float32)
    below = (heights < -1).astype(np.float32)
    plane_C = planes[np.argmax(on @ nearness - parameters.below_penalty * (below @ nearness))]

    for _ in range(2):
        inlier = np.abs(p_CQ @ plane_C[:3] + plane_C[3]) <= tolerance
        if np.count_nonzero(inlier) < 3:
            break
        plane_C = _least_squares_plane(p_CQ[inlier], 1.0 / tolerance[inlier] ** 2)

    share = np.mean(np.abs(p_CQ @ plane_C[:3] + plane_C[3]) <= tolerance)
    if share < parameters.minimum_share:
        raise NoPlaneError(
            f"no plane: the best one holds {share:.0%} of the points with depth, "
            f"a table top should hold at least {parameters.minimum_share:.0%}"
        )
    return plane_C


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
    height[~(depth > 0)] = np.nan
    return height


def transform_plane(X_AB: NDArray, plane_B: NDArray) -> NDArray[np.float64]:
    """The plane [4] measured in A instead of B: plane_W = transform_plane(X_WC, plane_C)."""
    normal_A = X_AB[:3, :3] @ plane_B[:3]
    return np.append(normal_A, plane_B[3] - normal_A @ X_AB[:3, 3])


def _sample(
    depth: NDArray,
    intrinsics: Intrinsics,
    rng: np.random.Generator,
    parameters: PlaneFitParameters,
    valid: NDArray[np.bool_] | None,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Random points p_CQ [N, 3] of the image, and each one's tolerance [N] in metres."""
    # Of a large image every second row and column has points enough.
    step = 2 if depth.size > 40 * parameters.points else 1
    coarse = (slice(None, None, step), slice(None, None, step))
    few = depth[coarse]
    index = np.flatnonzero(few > 0 if valid is None else (few > 0) & valid[coarse])
    if len(index) < 3:
        raise NoPlaneError(f"no plane: {len(index)} pixels with depth, at least 3 are needed")
    # With replacement: a hundred times faster than without, and a rare twin does no harm.
    index = rng.choice(index, parameters.points)
    v, u = step * np.stack(np.divmod(index, few.shape[1]))
    z = depth[v, u].astype(float)
    p_CQ = np.column_stack(
        [(u - intrinsics.cx) / intrinsics.fx * z, (v - intrinsics.cy) / intrinsics.fy * z, z]
    )
    return p_CQ, np.hypot(parameters.tolerance, 3.0 * parameters.depth_noise * z**2)


def _planes_through_triplets(p_CQ: NDArray, rng: np.random.Generator, count: int) -> NDArray[np.float64]:
    """Up to `count` planes [M, 4] through three random points each; triplets on one line are dropped."""
    a, b, c = p_CQ[rng.integers(len(p_CQ), size=(3, count))]
    normal = np.cross(b - a, c - a)
    length = np.linalg.norm(normal, axis=1)
    # Twice the triangle's area against its longest side: its height must not vanish.
    longest = np.maximum(np.linalg.norm(b - a, axis=1), np.linalg.norm(c - a, axis=1))
    proper = length > 1e-2 * longest**2 + 1e-12
    normal, a = normal[proper] / length[proper, None], a[proper]
    return _camera_above(np.column_stack([normal, -np.einsum("ij,ij->i", normal, a)]))


def _least_squares_plane(p_CQ: NDArray, weight: NDArray) -> NDArray[np.float64]:
    """The plane [4] with the smallest weighted sum of squared distances to points [N, 3]."""
    centre = weight @ p_CQ / weight.sum()
    offset = p_CQ - centre
    _, vectors = np.linalg.eigh((offset * weight[:, None]).T @ offset)
    normal = vectors[:, 0]
    return _camera_above(np.append(normal, -normal @ centre))


def _camera_above(plane_C: NDArray) -> NDArray[np.float64]:
    """The same planes [..., 4] with normals such that the camera's centre is above them."""
    return plane_C * np.where(plane_C[..., 3:] < 0, -1.0, 1.0)
