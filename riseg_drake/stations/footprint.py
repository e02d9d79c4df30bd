"""What a model covers of the table, as convex polygons; how far two such shapes stand apart."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import GeometryId, SceneGraphInspector
from pydrake.math import RigidTransform
from scipy.spatial import ConvexHull, QhullError

from riseg_drake.robot.shape_corners import shape_corners


@dataclass(frozen=True)
class Footprint:
    """The collision geometry of one body seen from above, and where its lowest point is."""

    pieces: tuple[NDArray, ...]
    """Convex polygons [n, 2], counterclockwise, metres; the body's shape is their union."""
    bottom: float
    """Height of the lowest point above the body's origin, m (mostly <= 0)."""

    def moved(self, yaw: float, p_xy: NDArray) -> "Footprint":
        """The same shape turned about its origin by `yaw` (rad), then moved by `p_xy` [2] (m)."""
        c, s = np.cos(yaw), np.sin(yaw)
        R = np.array([[c, -s], [s, c]])
        return Footprint(tuple(piece @ R.T + p_xy for piece in self.pieces), self.bottom)

    def corners(self) -> NDArray:
        """All corners [n, 2] of all pieces."""
        return np.vstack(self.pieces)


def footprint(
    inspector: SceneGraphInspector, geometries: Sequence[GeometryId], X_WB: RigidTransform
) -> Footprint:
    """The footprint of a body with pose X_WB; the geometries' poses are taken as measured in the body.

    Raises ValueError for a shape without extent of its own, such as a half space, or without area from above.
    """
    clouds = [
        X_WB.multiply(inspector.GetPoseInFrame(g).multiply(shape_corners(inspector.GetShape(g)).T)).T
        for g in geometries
    ]
    pieces = []
    for cloud in clouds:
        flat = cloud[:, :2]
        try:
            pieces.append(flat[ConvexHull(flat).vertices])
        except QhullError:
            raise ValueError("a collision shape has no area, seen from above") from None
    return Footprint(tuple(_without_hidden(pieces)), float(min(cloud[:, 2].min() for cloud in clouds)))


def _without_hidden(pieces: Sequence[NDArray]) -> list[NDArray]:
    """The pieces without those whose corners all lie in others: small feet below a large body."""
    kept = list(pieces)
    for piece in sorted(pieces, key=lambda p: float(np.ptp(p, axis=0).prod())):
        others = [p for p in kept if p is not piece]
        if others and np.all(np.any([inside(piece, other) for other in others], axis=0)):
            kept = others
    return kept


def inside(points: NDArray, convex: NDArray) -> NDArray:
    """Which points [n] lie in a convex polygon."""
    edge = np.roll(convex, -1, axis=0) - convex
    outward = np.column_stack([edge[:, 1], -edge[:, 0]])
    return np.all(np.einsum("nmk,mk->nm", points[:, None] - convex, outward) <= 1e-9, axis=1)


def travel(moving: Footprint, fixed: Footprint, direction: NDArray) -> float:
    """How far `moving` can go along the unit vector `direction` [2] until it touches `fixed`; m, or inf.

    The first contact of two polygons is a corner of one on an edge of the other.
    """
    forth = _first_hit(moving.corners(), fixed.pieces, direction)
    back = _first_hit(fixed.corners(), moving.pieces, -direction)
    return min(forth, back)


def separation(a: Footprint, b: Footprint) -> float:
    """Distance between two footprints in metres; 0 where they overlap."""
    if any(_overlap(p, q) for p in a.pieces for q in b.pieces):
        return 0.0
    return min(_nearest(a.corners(), b.pieces), _nearest(b.corners(), a.pieces))


def _edges(pieces: Sequence[NDArray]) -> tuple[NDArray, NDArray]:
    return np.vstack(pieces), np.vstack([np.roll(piece, -1, axis=0) for piece in pieces])


def _first_hit(points: NDArray, pieces: Sequence[NDArray], direction: NDArray) -> float:
    """Shortest ray from any point along `direction` to any edge."""
    a, b = _edges(pieces)
    across = np.array([-direction[1], direction[0]])
    a_side, b_side = a @ across, b @ across  # [m]
    side = (points @ across)[:, None]  # [n, 1]
    crosses = (np.minimum(a_side, b_side) <= side) & (side <= np.maximum(a_side, b_side))
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(b_side == a_side, 0.0, (side - a_side) / (b_side - a_side))
    reach = a @ direction + share * ((b - a) @ direction) - (points @ direction)[:, None]
    reach = reach[crosses & (reach >= 0)]
    return float(reach.min()) if reach.size else np.inf


def _nearest(points: NDArray, pieces: Sequence[NDArray]) -> float:
    """Shortest distance from any point to any edge."""
    a, b = _edges(pieces)
    edge = b - a
    share = np.einsum("nmk,mk->nm", points[:, None] - a, edge) / np.sum(edge**2, axis=1)
    foot = a + np.clip(share, 0.0, 1.0)[..., None] * edge
    return float(np.linalg.norm(points[:, None] - foot, axis=-1).min())


def _overlap(p: NDArray, q: NDArray) -> bool:
    """Whether two convex polygons overlap: no edge of either separates them."""
    for one, other in ((p, q), (q, p)):
        edge = np.roll(one, -1, axis=0) - one
        outward = np.column_stack([edge[:, 1], -edge[:, 0]])
        beyond = (other[None] - one[:, None]) @ outward[:, :, None]
        if np.any(beyond.min(axis=1) >= 0):
            return False
    return True
