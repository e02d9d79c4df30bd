"""Alg. 3, line 6: objsToSegment divided into what is likely one object each.

K-Means on everything at once, as in the paper, likes to join two small objects across a gap or to cut
a big one: the scene is first taken apart where one can see through between things, and only a piece that
could be several objects is clustered.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import count

import cv2
import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.camera import bounding_region
from riseg_drake.geometry.nearest import nearest_values
from riseg_drake.pushing.clustering import Clustering, ClusteringParameters, clusterings
from riseg_drake.pushing.table_map import TableMap

HALVES = 2
"""A piece with a nook that no neck divides is at least this many clusters: half an object moves as well
as a whole one, but two objects pushed together look like one."""
_FREE = 2
"""Cells around what is looked at, so that its outline has an outside."""


@dataclass
class ClustersParameters:
    """How objsToSegment is divided."""

    by_piece: bool = True
    """Cluster each piece alone; False clusters all of objsToSegment at once, as the paper does."""
    neck: float = 0.006
    """Where a connection is narrower than this, m, it is cut."""
    widest_neck: float = 0.030
    """A piece with a nook is cut even where it is up to this wide, m ..."""
    smallest_part: float = 4e-4
    """... but not into parts smaller than this, m^2: legs, tails and fins belong to something."""
    concavity: float = 0.008
    """A piece whose outline nowhere recedes more than this from its convex hull, m, is one cluster:
    where things touch, there mostly is a nook."""
    clustering: ClusteringParameters = field(default_factory=ClusteringParameters)


@dataclass(frozen=True)
class Cluster:
    """A center c and its points P."""

    center_W: NDArray[np.float64]
    """[2], m."""
    cells: NDArray[np.bool_]
    """P, as cells of the map [rows, columns]."""


def find_clusters(
    to_segment: NDArray[np.bool_],
    table: TableMap,
    parameters: ClustersParameters,
    rng: np.random.Generator,
    doubtful: NDArray[np.int_] | None = None,
) -> Iterator[list[Cluster]]:
    """centers and clusterPoints of objsToSegment [rows, columns]; then, if asked again, ever finer ones.

    Where everything has moved, as ids in doubt [rows, columns], no cluster holds two ids, and none all of one:
    what is pushed through its middle once more moves as it did before.
    """
    pieces = take_apart(to_segment, table, parameters) if parameters.by_piece else [to_segment]
    if doubtful is not None:
        pieces = [to_segment & (doubtful == a) for a in np.unique(doubtful[to_segment])]
    divisions = []
    for piece in pieces:
        halved = doubtful is not None
        whole = not halved and parameters.by_piece and concavity(piece, table.cell) <= parameters.concavity
        least = HALVES if halved or parameters.by_piece else 1
        p_WQ = table.points(piece)
        divisions.append(clusterings(p_WQ, parameters.clustering, rng, one_first=whole, least=least))
    current: list[Clustering | None] = [None] * len(pieces)
    for _ in count():
        finer = [next(division, None) for division in divisions]
        if all(clustering is None for clustering in finer):
            return
        current = [new or old for new, old in zip(finer, current, strict=True)]
        yield [
            Cluster(center, _cells(piece, clustering.labels == k))
            for piece, clustering in zip(pieces, current, strict=True)
            if clustering is not None
            for k, center in enumerate(clustering.centers)
        ]


def take_apart(
    mask: NDArray[np.bool_], table: TableMap, parameters: ClustersParameters
) -> list[NDArray[np.bool_]]:
    """The connected pieces of a mask [rows, columns]; those with a nook cut at their necks, narrow first."""
    pieces = split_at_necks(mask, table, parameters.neck, 0.0)
    for neck in np.arange(parameters.neck, parameters.widest_neck, 2 * table.cell)[1:]:
        pieces = [
            part
            for piece in pieces
            for part in (
                [piece]
                if concavity(piece, table.cell) <= parameters.concavity
                else split_at_necks(piece, table, float(neck), parameters.smallest_part)
            )
        ]
    return pieces


def split_at_necks(
    mask: NDArray[np.bool_], table: TableMap, neck: float, smallest: float
) -> list[NDArray[np.bool_]]:
    """The connected pieces of a mask [rows, columns], also cut where they hang together by less than `neck`, m.

    What would be smaller than `smallest`, m^2, is a limb rather than a piece and stays where it is.
    """
    region = bounding_region(mask, _FREE)
    whole, mask = mask, mask[region]
    closed = cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
    depth_inside = cv2.distanceTransform(closed, cv2.DIST_L2, 5) * table.cell
    amount, core_of = cv2.connectedComponents((depth_inside > neck / 2).astype(np.uint8), connectivity=4)
    piece = _by_nearest_core(mask, core_of)
    area = np.bincount(piece[mask], minlength=amount) * table.cell_area
    limb = area < smallest
    if limb[1:].any() and not limb[1:].all():
        core_of[limb[core_of]] = 0
        piece = _by_nearest_core(mask, core_of)
    numbers = np.unique(piece[mask])
    if len(numbers) == 1:
        return [whole]
    parts = np.zeros((len(numbers), *whole.shape), bool)
    parts[:, *region] = mask & (piece == numbers[:, None, None])
    return list(parts)


def _by_nearest_core(mask: NDArray[np.bool_], core_of: NDArray) -> NDArray[np.int_]:
    """For each cell of a mask the number (from 1) of the core [rows, columns] nearest to it."""
    if not core_of.any():
        return mask.astype(int)
    nearest, _ = nearest_values(core_of.astype(int), core_of > 0, cv2.DIST_MASK_5)
    return np.where(mask, nearest, 0)


def concavity(piece: NDArray[np.bool_], cell: float) -> float:
    """How far the outline of a piece [rows, columns] recedes from its convex hull, m. Holes do not count."""
    piece = piece[bounding_region(piece, _FREE)]
    outlines, _ = cv2.findContours(piece.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
    filled, hull = np.zeros((2, *piece.shape), np.uint8)
    cv2.drawContours(filled, outlines, -1, 1, cv2.FILLED)
    cv2.fillConvexPoly(hull, cv2.convexHull(np.concatenate(outlines)), 1)
    missing = (hull > 0) & (filled == 0)
    return cell * float(cv2.distanceTransform(hull, cv2.DIST_L2, 5)[missing].max(initial=0.0))


def _cells(mask: NDArray[np.bool_], chosen: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The part of a mask whose cells, in row order, are chosen."""
    part = np.zeros_like(mask)
    part[mask] = chosen
    return part
