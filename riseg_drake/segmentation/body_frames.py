"""Alg. 2, line 4: body frames on what moves.

A body frame here is a handful of points, given at t-1 and at t, both measured in the camera frame C0
of t-1 (the motion of the camera taken out): `triplets` of the paper, or `patches` of a few dozen.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.camera import rays, rays_at
from riseg_drake.geometry.rgbd import FramePair
from riseg_drake.geometry.se3 import inverse, move_points


@dataclass
class BodyFrameParameters:
    """How body frames are sampled."""

    kind: str = field(default="patches", metadata={"choices": ("patches", "triplets")})
    """"patches" (least squares over many points) or "triplets" (three points, as in the paper)."""
    count: int = 80
    """How many body frames; the paper's n counts sampled pixels and is not given."""
    diameter: float = 0.024
    """d_a, m: no two points of one frame are further apart; not given in the paper."""
    points: int = 24
    """Points tried for each patch."""
    points_min: int = 8
    """A patch with fewer good points is dropped."""
    width_min: float = 0.1
    """Smallest ratio of a frame's two extents: below it, the points are as good as collinear."""


@dataclass(frozen=True)
class BodyFrames:
    """K body frames of up to M points each."""

    pixel: NDArray[np.intp]
    """[K, 2], the seed's (v, u) at t-1."""
    p_C0Q0: NDArray[np.float64]
    """[K, M, 3], the points at t-1, m."""
    p_C0Q1: NDArray[np.float64]
    """[K, M, 3], the same points at t, seen from the unmoved camera C0, m."""
    depth_1: NDArray[np.float64]
    """[K, M], depth at t, m (its noise is not that of t-1)."""
    flow_sigma: NDArray[np.float64]
    """[K, M], standard deviation of the flow by which each point was tracked, pixels."""
    used: NDArray[np.bool_]
    """[K, M], points that belong to the frame."""

    def __len__(self) -> int:
        """The number of frames K."""
        return len(self.pixel)

    def subset(self, which: NDArray[np.bool_]) -> "BodyFrames":
        """Some of the body frames, by a mask [K]."""
        return BodyFrames(
            self.pixel[which],
            self.p_C0Q0[which],
            self.p_C0Q1[which],
            self.depth_1[which],
            self.flow_sigma[which],
            self.used[which],
        )


def track_points(
    pair: FramePair,
    optical_flow: NDArray[np.float32],
    pixel: tuple[NDArray[np.intp], NDArray[np.intp]],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """The points behind some pixels (v, u) of t-1, where they are at t, and how far away they are then.

    Depth at t is looked up where O_t (not X_t) leads, at the nearest pixel so that no depth is mixed
    across an edge, and carried back by the inverse camera motion.

    Returns:
        p_C0Q0 and p_C0Q1 [..., 3], m, both in C0, and the depth at t [...], 0 where there is none.
    """
    intrinsics = pair.current.intrinsics
    v, u = pixel
    p_C0Q0 = rays(intrinsics)[v, u] * pair.reference.depth[v, u][..., None].astype(float)
    target = np.stack([u, v], axis=-1) + optical_flow[v, u].astype(float)
    nearest = np.nan_to_num(np.rint(target), nan=-1)  # no flow leads out of the image
    u_1, v_1 = np.moveaxis(nearest.astype(np.intp), -1, 0)
    inside = (u_1 >= 0) & (v_1 >= 0) & (u_1 < intrinsics.width) & (v_1 < intrinsics.height)
    u_1, v_1 = np.where(inside, u_1, 0), np.where(inside, v_1, 0)
    seen = inside & ~pair.current.robot[v_1, u_1] & (p_C0Q0[..., 2] > 0)
    depth_1 = np.where(seen, pair.current.depth[v_1, u_1], 0.0)
    p_C1Q1 = rays_at(target, intrinsics) * depth_1[..., None]
    return p_C0Q0, move_points(inverse(pair.X_C1C0), p_C1Q1), depth_1


def sample_body_frames(
    pair: FramePair,
    optical_flow: NDArray[np.float32],
    moving: NDArray[np.bool_],
    sigma: NDArray[np.float32],
    parameters: BodyFrameParameters,
    rng: np.random.Generator,
) -> BodyFrames:
    """Random body frames on moving pixels: not collinear, no wider than d_a (Alg. 2, line 4).

    Args:
        pair: the frames of t-1 and t.
        optical_flow: O_t [H, W, 2], pixels.
        moving: [H, W], ||X_t|| >> 0.
        sigma: [H, W], standard deviation of O_t, pixels.
        parameters: see there; ValueError for an unknown kind.
        rng: draws seeds and neighbours.
    """
    if parameters.kind not in ("patches", "triplets"):
        raise ValueError(f"no body frames {parameters.kind!r}: choose patches or triplets")
    good = moving & (pair.reference.depth > 0)
    seeds = _spread_seeds(good, parameters.count, rng)
    is_triplet = parameters.kind == "triplets"
    neighbours = 2 if is_triplet else parameters.points - 1
    height, width = good.shape

    # Neighbours lie uniformly in a disk of radius d_a / 2 about the seed, so all are within d_a.
    z = pair.reference.depth[seeds[:, 0], seeds[:, 1]]
    radius = 0.5 * parameters.diameter * pair.current.intrinsics.fx / z
    r = radius[:, None] * np.sqrt(rng.uniform(0.01, 1, (len(seeds), neighbours)))
    phi = rng.uniform(0, 2 * np.pi, (len(seeds), neighbours))
    offset = np.rint(np.stack([r * np.sin(phi), r * np.cos(phi)], axis=-1)).astype(np.intp)
    vu = seeds[:, None] + np.concatenate([np.zeros((len(seeds), 1, 2), np.intp), offset], axis=1)
    inside = (vu >= 0).all(-1) & (vu[..., 0] < height) & (vu[..., 1] < width)
    v, u = np.clip(vu[..., 0], 0, height - 1), np.clip(vu[..., 1], 0, width - 1)

    p_0, p_1, depth_1 = track_points(pair, optical_flow, (v, u))
    # A little more than the radius in the image: points may differ in depth, too.
    near = np.linalg.norm(p_0 - p_0[:, :1], axis=-1) <= 0.6 * parameters.diameter
    used = inside & good[v, u] & (depth_1 > 0) & near
    enough = used.sum(1) >= (3 if is_triplet else parameters.points_min)
    keep = enough & used[:, 0] & (_extent_ratio(p_0, used) >= parameters.width_min)
    return BodyFrames(
        seeds[keep], p_0[keep], p_1[keep], depth_1[keep], sigma[v, u][keep].astype(float), used[keep]
    )


def _spread_seeds(good: NDArray[np.bool_], count: int, rng: np.random.Generator) -> NDArray[np.intp]:
    """Up to `count` pixels (v, u), one to a cell of a grid fine enough to have that many cells.

    Even spreading gives a small moving object its frames beside a large one.
    """
    if not good.any():
        return np.empty((0, 2), np.intp)
    pixel = rng.permutation(np.flatnonzero(good))
    v, u = np.divmod(pixel, good.shape[1])
    if len(pixel) > count:
        cell = max(1, int(np.sqrt(len(pixel) / count)))
        columns = good.shape[1] // cell + 1
        # Of the pixels of one cell, in random order, the last stays.
        chosen = np.full(columns * (good.shape[0] // cell + 1), -1)
        chosen[v // cell * columns + u // cell] = np.arange(len(pixel))
        which = rng.permutation(chosen[chosen >= 0])[:count]
        v, u = v[which], u[which]
    return np.stack([v, u], axis=1)


def _extent_ratio(p: NDArray, used: NDArray[np.bool_]) -> NDArray:
    """Ratio of the second to the first extent of each frame's points: 0 where they are collinear."""
    weight = used / np.maximum(used.sum(1, keepdims=True), 1)
    offset = p - np.einsum("km,kmi->ki", weight, p)[:, None]
    covariance = np.einsum("km,kmi,kmj->kij", weight, offset, offset)
    extents = np.sqrt(np.maximum(np.linalg.eigvalsh(covariance), 0))
    return extents[:, 1] / np.maximum(extents[:, 2], 1e-12)
