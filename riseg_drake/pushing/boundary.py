"""Alg. 3, line 7: the points at which a cluster could be pushed."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from riseg_drake.pushing.table_map import TableMap


@dataclass
class BoundaryParameters:
    """How many boundary points a cluster gets."""

    directions: int = 48
    """The outline is cut into this many equal angles around the center; each gives one point."""
    room_behind: float = 0.06
    """How far from the outline, m, free table still makes a point better."""


def boundary(
    cluster: NDArray[np.bool_],
    center_W: NDArray,
    table: TableMap,
    parameters: BoundaryParameters | None = None,
) -> NDArray[np.float64]:
    """Boundary points p_WB [N, 2] of a cluster of cells, the most accessible first.

    A boundary point borders a cell that holds no object: where two clusters meet, no pusher fits
    between them. Of each angle around the center the outermost such point is taken. They are ordered by
    how far the nearest object is from the spots behind them, where the pusher would have to stand.
    """
    parameters = parameters or BoundaryParameters()
    p_WB = table.points(cluster & table.beside_free)
    offset = p_WB - center_W
    radius = np.linalg.norm(offset, axis=1)
    p_WB, offset, radius = p_WB[radius > 0], offset[radius > 0], radius[radius > 0]
    if not len(p_WB):
        return p_WB
    angle = np.arctan2(offset[:, 1], offset[:, 0])
    sector = np.floor((angle / (2 * np.pi) + 0.5) * parameters.directions).astype(int)
    sector %= parameters.directions  # pi and -pi are one direction
    order = np.lexsort((-radius, sector))
    outermost = order[np.unique(sector[order], return_index=True)[1]]
    p_WB, outward = p_WB[outermost], offset[outermost] / radius[outermost, None]

    behind = np.linspace(0.0, parameters.room_behind, 5)[1:]
    spots = p_WB[:, None] + behind[:, None] * outward[:, None]
    inside = table.lookup(np.ones_like(table.objects), spots)
    room = np.where(inside, table.lookup(table.to_object, spots), parameters.room_behind).sum(axis=1)
    return p_WB[np.argsort(-room, kind="stable")]
