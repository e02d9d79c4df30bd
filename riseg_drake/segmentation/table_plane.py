"""The table top under everything, fitted to a depth image by RANSAC (Alg. 3, line 1).

Planes fitted here have the camera on their upper side.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.segmentation.scales import DEPTH_NOISE

_DOWNWARDS, _SIDEWAYS = 0.26, 0.7
"""Parts of a table's unit normal downwards and sideways in an upright picture: no more than those. A camera
that looks straight down may be tilted by 15 degrees either way; one that looks ahead may be rolled by 45."""


class NoPlaneError(ValueError):
    """Why an image shows no table top, in one line."""


@dataclass
class PlaneFitParameters:
    """How to look for the table top. The paper says only that it is found by RANSAC (Alg. 3, line 1)."""

    hypotheses: int = 384
    """Planes through three random points that are tried, half of them through points near each other, which
    lie more often on one surface. With a sixth of the points on the table and half of their neighbours, too,
    eight are right."""
    near_share: float = 0.15
    """Points are near each other within that share of the image's width."""
    points: int = 2048
    """Random pixels that take part; the first sixteenth of them score the hypotheses, the first quarter the
    best eighth of these."""
    tolerance: float = 0.003
    """Distance, m, within which a point without depth noise would count as lying on the plane."""
    depth_noise: float = DEPTH_NOISE
    """Standard deviation of depth at 1 m, m."""
    object_height: float = 0.4
    """m; things on a table are lower, and a table stands higher over its floor."""
    below_penalty: float = 0.5
    """What a point below the plane, by no more than that height, costs, in points on it. Things stand on a
    table and nothing is under it, so the top of a big box loses against the table that shows beside it."""
    above_penalty: float = 1.0
    """What a point above the plane by more than that height costs: a floor has a table above it, and a wall
    all of the room in front of it."""
    upright_share: float = 0.3
    """What a plane is worth that would be a wall if the picture is upright, as a share: one of which the
    upper side faces downwards in the image, or to a side."""
    near: float = 1.5
    """What is farther away than so many times the nearest fifth counts less, by the square of depth."""
    minimum_share: float = 0.15
    """Share of the valid points, each as far as nearness lets it count, that a plane must hold to be
    believed."""


def fit_plane(
    depth: NDArray,
    intrinsics: Intrinsics,
    rng: np.random.Generator,
    parameters: PlaneFitParameters | None = None,
    *,
    valid: NDArray[np.bool_] | None = None,
) -> NDArray[np.float64]:
    """The plane that most of the image stands on, by RANSAC and three least squares refits.

    Args:
        depth: [H, W], metres, 0 = invalid.
        intrinsics: of the camera that took it.
        rng: draws the points and the hypotheses.
        parameters: the defaults if None.
        valid: [H, W], pixels that may take part (leave out the robot's own), all if None.

    Returns:
        plane_C [4]; the camera's centre has a positive height.

    Raises:
        NoPlaneError: where the image shows no such plane.
    """
    parameters = parameters or PlaneFitParameters()
    p_CQ, tolerance, near = _sample(depth, intrinsics, rng, parameters, valid)
    planes = _planes_through_triplets(p_CQ, near, rng, parameters.hypotheses)
    if not len(planes):
        raise NoPlaneError("no plane: all triplets drawn lie on a line")
    # What is near counts more: a table seen from beside may show less of itself than of floor and wall.
    z, scoring = p_CQ[:, 2], slice(max(3, len(p_CQ) // 4))
    nearness = np.minimum(1.0, np.square(parameters.near * np.quantile(z[scoring], 0.2) / z))
    # A few points tell which planes are worth being asked about more.
    for asked, kept in ((slice(len(p_CQ) // 16 + 3), len(planes) // 8 + 1), (scoring, 1)):
        worth = _worth(planes, p_CQ[asked], tolerance[asked], nearness[asked], parameters)
        planes = planes[np.argpartition(-worth, kept - 1)[:kept]]
    plane_C = planes[0]
    for _ in range(3):
        inlier = np.abs(p_CQ @ plane_C[:3] + plane_C[3]) <= tolerance
        if np.count_nonzero(inlier) < 3:
            break
        plane_C = _least_squares_plane(p_CQ[inlier], 1.0 / tolerance[inlier] ** 2)

    on = np.abs(p_CQ @ plane_C[:3] + plane_C[3]) <= tolerance
    share = nearness[on].sum() / nearness.sum()
    if share < parameters.minimum_share:
        raise NoPlaneError(
            f"no plane: the best one holds {share:.0%} of the points with depth, "
            f"a table top should hold at least {parameters.minimum_share:.0%}"
        )
    return plane_C


def _sample(
    depth: NDArray,
    intrinsics: Intrinsics,
    rng: np.random.Generator,
    parameters: PlaneFitParameters,
    valid: NDArray[np.bool_] | None,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.intp]]:
    """Random points p_CQ [N, 3] of the image, each one's tolerance [N] in metres, and their order by place:
    neighbours in it are near each other in the image."""
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
    cell = max(1, int(parameters.near_share * intrinsics.width))
    near = np.argsort((u // cell * 64 + v // cell).astype(np.int16), kind="stable")
    z = depth[v, u].astype(float)
    p_CQ = np.column_stack(
        [(u - intrinsics.cx) / intrinsics.fx * z, (v - intrinsics.cy) / intrinsics.fy * z, z]
    )
    return p_CQ, np.hypot(parameters.tolerance, 3.0 * parameters.depth_noise * z**2), near


def _planes_through_triplets(
    p_CQ: NDArray, near: NDArray[np.intp], rng: np.random.Generator, count: int
) -> NDArray[np.float64]:
    """Up to `count` planes [M, 4] through three random points each; triplets on one line are dropped."""
    triplets = rng.integers(len(p_CQ), size=(3, count))
    # Half of them among neighbours, which lie more often on the same surface.
    half = count // 2
    first = triplets[0, :half]
    for other in (1, 2):
        triplets[other, :half] = near[(first + triplets[other, :half] % 32) % len(near)]
    triplets[0, :half] = near[first]
    a, b, c = p_CQ[triplets]
    normal = np.cross(b - a, c - a)
    length = np.linalg.norm(normal, axis=1)
    # Twice the triangle's area against its longest side: its height must not vanish.
    longest = np.maximum(np.linalg.norm(b - a, axis=1), np.linalg.norm(c - a, axis=1))
    proper = length > 1e-2 * longest**2 + 1e-12
    normal, a = normal[proper] / length[proper, None], a[proper]
    return _camera_above(np.column_stack([normal, -np.einsum("ij,ij->i", normal, a)]))


def _worth(
    planes: NDArray, p_CQ: NDArray, tolerance: NDArray, nearness: NDArray, parameters: PlaneFitParameters
) -> NDArray[np.float32]:
    """How much speaks for each of M planes being the table top, [M], given N points."""
    height = planes[:, :3].astype(np.float32) @ p_CQ.T.astype(np.float32)
    height += planes[:, 3:].astype(np.float32)
    within = tolerance.astype(np.float32)
    weight = nearness.astype(np.float32)
    # Nearer counts more (MSAC): a plane between a table and a low tile holds both, and neither well.
    on = np.maximum(1 - np.square(height / within), 0) @ weight
    below = ((height < -within) & (height > -parameters.object_height)) @ weight
    above = (height > parameters.object_height) @ weight
    normal = planes[:, :3]
    upright = (normal[:, 1] < _DOWNWARDS) & (np.abs(normal[:, 0]) < _SIDEWAYS)
    worth = on - parameters.below_penalty * below - parameters.above_penalty * above
    return np.where(upright | (worth < 0), worth, parameters.upright_share * worth)


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
