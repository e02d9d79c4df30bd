"""Which of many valid pushes teaches most and disturbs least.

The paper takes the first valid push. All of them are compared here: the best moves one unknown object,
alone, into free space, distinctly from what it touches.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from riseg_drake.pushing.contact import Contacts
from riseg_drake.pushing.table_map import TableMap
from riseg_drake.pushing.tried_pushes import TriedPush
from riseg_drake.pushing.validity import ValidityParameters, overlap_after_push


@dataclass
class RankingParameters:
    """Weights of the costs that are summed; each cost is about 0 for good and 1 for bad."""

    overlap: float = 1.0
    """Share of the cluster that would come to lie on other objects, relative to l_act."""
    overlap_beyond: float = 0.5
    """The same for twice the push distance: free space ahead is better than a gap just wide enough."""
    edgy: float = 0.2
    """Touching with a small part of the bar's width: corners slip off, faces do not."""
    beside_target: float = 1.0
    """What of the bar's face meets unsegmented things beside the cluster: both would move alike."""
    small: float = 0.5
    """Small clusters after big ones."""
    near_segmented: float = 0.3
    """Share of the cluster within reach of a push of segmented objects: those would be moved again."""
    unseen: float = 0.3
    """Share of the way to the contact that the camera could not see."""
    tipping: float = 0.5
    """Height over extent along the push, beyond 1: tall narrow things topple."""
    turning: float = 0.3
    """Turning the camera by half a turn: it costs time, and takes the scene out of view."""
    tried: float = 2.0
    """Closeness to a push that was tried, with what it was aimed at still unsegmented."""
    tried_distance: float = 0.03
    """Distance, m, over which that closeness fades."""
    refused_distance: float = 0.015
    """A push that changed nothing is not repeated within this distance, m ..."""
    refused_angle: float = 0.5
    """... and within this angle, rad."""


def cost_of_pushes(
    contacts: Contacts,
    direction_W: NDArray,
    overlap: NDArray,
    cluster: NDArray[np.bool_],
    table: TableMap,
    largest_cluster: int,
    tried: Sequence[TriedPush],
    heading_W: NDArray | None,
    validity: ValidityParameters,
    parameters: RankingParameters,
) -> NDArray[np.float64]:
    """Cost [N] of N candidates of one cluster, less is better; infinite for those to be refused.

    `overlap` [N] is |isect| / |P|, `largest_cluster` the number of cells of the largest cluster, and
    `heading_W` [2] where the camera's "up" points now (None if turning costs nothing).
    """
    P = table.points(cluster)
    beyond = overlap_after_push(direction_W, cluster, table, 2 * validity.d_push)
    along = P @ direction_W.T  # [M, N]
    extent = along.max(axis=0) - along.min(axis=0) + table.cell
    top = float(np.percentile(table.height[cluster], 95))
    cost = (
        parameters.overlap * overlap / validity.l_act
        + parameters.overlap_beyond * beyond
        + parameters.edgy * (1.0 - contacts.face)
        + parameters.beside_target * contacts.beside_target
        + parameters.small * (1.0 - len(P) / largest_cluster)
        + parameters.near_segmented * _share_near_segmented(cluster, table, validity.d_push)
        + parameters.unseen * contacts.unseen
        + parameters.tipping * np.clip(top / extent - 1.0, 0.0, 1.0)
    )
    if heading_W is not None:
        turn = np.arccos(np.clip(direction_W @ heading_W, -1.0, 1.0))
        cost += parameters.turning * turn / np.pi
    for push in tried:
        distance = np.linalg.norm(contacts.b_W - push.p_WB[:2], axis=1)
        alike = direction_W @ push.direction_W
        fading = np.exp(-0.5 * (distance / parameters.tried_distance) ** 2)
        cost += parameters.tried * fading * (1.0 + alike) / 2
        if not push.changed:
            same_place = distance < parameters.refused_distance
            cost[same_place & (alike > np.cos(parameters.refused_angle))] = np.inf
    return cost


def _share_near_segmented(cluster: NDArray[np.bool_], table: TableMap, distance: float) -> float:
    """Share of a cluster's points with a segmented object at a distance in any of 8 directions."""
    if not table.segmented.any():
        return 0.0
    P = table.points(cluster)
    angle = np.arange(8) * np.pi / 4
    around = P[:, None] + distance * np.column_stack([np.cos(angle), np.sin(angle)])
    return float(table.lookup(table.segmented, around).any(axis=1).mean())
