"""Where the tip touches a cluster, how low it must be there, and what else it would sweep through.

The paper pushes at a boundary point. A tip has a width: coming along bc it touches the cluster first
wherever the outline protrudes most within that width.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from riseg_drake.pushing.pusher import Pusher
from riseg_drake.pushing.table_map import TableMap
from riseg_drake.pushing.validity import ValidityParameters, rectangle

SKIN = 0.006
"""Depth, m, behind the first contact over which an object's height there is measured."""


@dataclass(frozen=True)
class Contacts:
    """Of N candidates: the contact, and whether the way to it and through the push is clear."""

    b_W: NDArray[np.float64]
    """[N, 2], the middle of the tip's face when it touches, on the line through boundary point and c."""
    height: NDArray[np.float64]
    """[N], how high the object is where it is touched, m; 0 where the tip misses."""
    face: NDArray[np.float64]
    """[N], share of the tip's width that meets the object within SKIN / 2 of the first contact."""
    tip_height: NDArray[np.float64]
    """[N], height of the tip's end face above the table, m."""
    high_enough: NDArray[np.bool_]
    """[N], the tip touches, and need not come closer to the table than it may."""
    only_target: NDArray[np.bool_]
    """[N], up to the contact the tip meets nothing, and from there on no segmented object."""
    beside_target: NDArray[np.float64]
    """[N], share of what the tip's face moves through that is unsegmented but not of the cluster."""
    unseen: NDArray[np.float64]
    """[N], share of the way to the contact that the camera could not see."""
    transmitted: NDArray[np.float64]
    """[N], share of the push that arrives at the target where others push it: gaps take theirs."""


def find_contacts(
    boundary_W: NDArray,
    direction_W: NDArray,
    cluster: NDArray[np.bool_],
    table: TableMap,
    pusher: Pusher,
    parameters: ValidityParameters,
    target: NDArray[np.bool_] | None = None,
) -> Contacts:
    """The contacts of pushes through N boundary points [N, 2] along unit directions [N, 2].

    Parts of the cluster that the tip's end face passes over at its lowest do not count as contact.
    `target` is the part of the cluster that is to move, if not all of it [rows, columns].
    """
    width, room = pusher.tool.width, pusher.parameters
    lowest_object = room.lowest_tip_height / room.height_share
    reach = max(width, parameters.d_push)
    along = np.arange(-reach, reach, table.cell)
    across = np.linspace(-width / 2, width / 2, int(np.ceil(width / table.cell)) + 1)
    swath = rectangle(boundary_W, direction_W, along, across)
    height = np.where(table.lookup(cluster, swath), table.lookup(table.height, swath), 0.0)
    profile = height.max(axis=2)  # [N, S]
    touching = height >= lowest_object  # [N, S, T]
    touched = touching.any(axis=(1, 2))
    first = np.argmax(touching.any(axis=2), axis=1)  # [N], 0 where nothing is touched
    # The face meets the near edge of the first cell, half a cell before its centre.
    travel = along[first] - table.cell / 2
    behind_face = table.cell * (np.arange(len(along))[None] - first[:, None])  # [N, S]
    skin_height = np.where((behind_face >= 0) & (behind_face <= SKIN), profile, 0.0).max(axis=1)
    near_face = (behind_face >= 0) & (behind_face <= SKIN / 2)
    face = (touching & near_face[..., None]).any(axis=1).mean(axis=1)
    skin_height[~touched] = 0.0
    b_W = boundary_W + travel[:, None] * direction_W

    width += room.margin
    across = np.linspace(-width / 2, width / 2, int(np.ceil(width / table.cell)) + 1)
    gap = rectangle(b_W, direction_W, np.arange(-parameters.clearance, 0.0, table.cell), across)
    stroke = rectangle(b_W, direction_W, np.arange(0.0, parameters.d_push, table.cell), across)
    strangers = table.objects & ~cluster
    known = strangers & table.segmented
    met = np.any(table.lookup(strangers, gap), axis=(1, 2))
    met |= np.any(table.lookup(known, stroke), axis=(1, 2))
    tip_height = np.minimum(room.tip_height, room.height_share * skin_height)
    return Contacts(
        b_W=b_W,
        height=skin_height,
        face=face,
        tip_height=np.maximum(tip_height, room.lowest_tip_height),
        high_enough=touched & (skin_height >= lowest_object),
        only_target=~met,
        beside_target=table.lookup(strangers & ~table.segmented, stroke).mean(axis=(1, 2)),
        unseen=1.0 - table.lookup(table.seen, gap).mean(axis=(1, 2)),
        transmitted=np.ones(len(b_W))
        if target is None
        else _transmitted(b_W, direction_W, target, table, pusher, parameters.d_push),
    )


def _transmitted(
    b_W: NDArray,
    direction_W: NDArray,
    target: NDArray[np.bool_],
    table: TableMap,
    pusher: Pusher,
    d_push: float,
) -> NDArray[np.float64]:
    """Share [N] of a push by `d_push`, m, that arrives at a target behind other things.

    Gaps on the way close up first; and the longer the way through others is than the tip is wide, the sooner
    they turn aside.
    """
    farthest = float(np.linalg.norm(table.points(target)[None] - b_W[:, None], axis=2).max())
    way = b_W[:, None] + np.arange(table.cell / 2, farthest, table.cell)[:, None] * direction_W[:, None]
    arrived = table.lookup(target, way)  # [N, S]
    before = np.cumsum(arrived, axis=1) == 0
    other = table.lookup(table.objects, way)
    gaps, through = (table.cell * np.count_nonzero(before & which, axis=1) for which in (~other, other))
    left = np.clip(1.0 - gaps / d_push, 0.0, 1.0) * pusher.tool.width / (pusher.tool.width + through)
    return np.where(arrived.any(axis=1), left, 0.0)
