"""Alg. 3, line 10: IsValidPush, the paper's three criteria for a push from b towards c.

Each criterion is a function over N candidates at once. Points are p_W [N, 2] on the table, directions
unit vectors [N, 2] along bc.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from riseg_drake.pushing.pusher import Pusher
from riseg_drake.pushing.table_map import TableMap


@dataclass
class ValidityParameters:
    """The constants of IsValidPush."""

    d_push: float = 0.02
    """How far an object is pushed, m (paper: 2 cm)."""
    l_act: float = 0.3
    """Largest share of the moved cluster that may come to lie on other objects (paper: 0.3)."""
    with_others: bool = True
    """Where nothing can be pushed alone, push it with what it touches, or by way of it (the paper: never). A
    wedged-in object then moves its neighbours, too, which by then mostly are known."""
    clearance: float = 0.010
    """Distance of the pusher's face from the contact where it is lowered, m: the paper's "short
    distance from b"."""


@dataclass(frozen=True)
class Validity:
    """What IsValidPush says about N candidates, criterion by criterion, each [N]."""

    center_on_object: NDArray[np.bool_]
    accessible: NDArray[np.bool_]
    moves_alone: NDArray[np.bool_]
    overlap: NDArray[np.float64]
    """|isect| / |P| of each candidate."""

    @property
    def valid(self) -> NDArray[np.bool_]:
        """[N], the paper's IsValidPush."""
        return self.center_on_object & self.accessible & self.moves_alone


def is_valid_push(
    b_W: NDArray,
    direction_W: NDArray,
    center_W: NDArray,
    cluster: NDArray[np.bool_],
    table: TableMap,
    pusher: Pusher,
    parameters: ValidityParameters,
) -> Validity:
    """IsValidPush for all candidates of one cluster: N contact points b with directions bc, one c.

    `b_W` [N, 2] and `center_W` [2] are in m, `direction_W` is [N, 2]; `cluster` is P as cells of the map
    [rows, columns], `table.objects` objMask.
    """
    overlap = overlap_after_push(direction_W, cluster, table, parameters.d_push)
    return Validity(
        center_on_object=np.full(len(b_W), center_on_object(center_W, table)),
        accessible=accessible(b_W, direction_W, table, pusher, parameters.clearance),
        moves_alone=overlap <= parameters.l_act,
        overlap=overlap,
    )


def center_on_object(center_W: NDArray, table: TableMap) -> bool:
    """First criterion: objMask^c = 1 at c [2], m."""
    return bool(table.lookup(table.objects, center_W))


def accessible(
    b_W: NDArray, direction_W: NDArray, table: TableMap, pusher: Pusher, clearance: float
) -> NDArray[np.bool_]:
    """Second criterion: objMask = 0 in all of the area the end effector needs, a short distance from b.

    The area is the tip's cross section with its margin all around, the tip's face being `clearance`, m,
    behind b along cb; b [N, 2], m, directions bc [N, 2].
    """
    tool, margin = pusher.tool, pusher.parameters.margin
    along = steps(-clearance - tool.thickness - margin, -clearance + min(margin, clearance / 2), table)
    across = steps(-tool.width / 2 - margin, tool.width / 2 + margin, table)
    area = rectangle(b_W, direction_W, along, across)
    occupied: NDArray[np.bool_] = np.any(table.lookup(table.objects, area), axis=(1, 2))
    return ~occupied


def overlap_after_push(
    direction_W: NDArray, cluster: NDArray[np.bool_], table: TableMap, distance: float
) -> NDArray[np.float64]:
    """Third criterion: |isect| / |P|, where isect is P moved along bc, and objMask without P (eq. 4).

    For directions bc [N, 2] and P as cells [rows, columns], moved by `distance`, m.
    """
    return share_after_push(table.objects & ~cluster, direction_W, cluster, table, distance)


def share_after_push(
    cells: NDArray[np.bool_],
    direction_W: NDArray,
    cluster: NDArray[np.bool_],
    table: TableMap,
    distance: float,
) -> NDArray[np.float64]:
    """Share [N] of a cluster that lies on some cells [rows, columns] once moved by `distance`, m.

    Along directions [N, 2].
    """
    P = table.points(cluster)
    if len(P) > 1500:  # a share needs no more points than that
        P = P[:: len(P) // 1500 + 1]
    moved = P[None] + distance * direction_W[:, None]
    return table.lookup(cells, moved).mean(axis=1)


def rectangle(p_W: NDArray, direction_W: NDArray, along: NDArray, across: NDArray) -> NDArray[np.float64]:
    """Points [N, S, T, 2] of a grid around each of N points: `along` [S] its direction, `across` [T]."""
    left_W = np.stack([-direction_W[:, 1], direction_W[:, 0]], axis=1)
    return (
        p_W[:, None, None]
        + along[None, :, None, None] * direction_W[:, None, None]
        + across[None, None, :, None] * left_W[:, None, None]
    )


def steps(start: float, stop: float, table: TableMap) -> NDArray[np.float64]:
    """Values [N] from start to stop, m, both included, no further apart than the map's cells."""
    return np.linspace(start, stop, int(np.ceil((stop - start) / table.cell)) + 1)
