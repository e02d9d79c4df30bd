"""What hangs over the table beside the tool's tip: whether the things there are low enough for it.

A bar has nothing but air beside it; right above closed fingers there is a hand, and a camera ahead of it.
"""

import numpy as np
from numpy.typing import NDArray

from riseg_drake.pushing.pusher import Pusher
from riseg_drake.pushing.table_map import TableMap
from riseg_drake.pushing.validity import ValidityParameters, rectangle, steps


def room_below_the_tool(
    b_W: NDArray,
    direction_W: NDArray,
    tip_height: NDArray,
    pushed: NDArray[np.bool_],
    table: TableMap,
    pusher: Pusher,
    parameters: ValidityParameters,
) -> NDArray[np.bool_]:
    """Which of N pushes bring nothing of the tool beside its tip to within the margin of a thing.

    What is `pushed` [rows, columns] stays where it is below the tool from the contact on, everything else is
    passed over from where the tool is lowered to where the push ends. What is ahead of the tip by less than the
    margin may touch what is pushed: it pushes, too.

    Args:
        b_W: contacts [N, 2], m.
        direction_W: [N, 2].
        tip_height: of the end face above what the map tells heights from, [N], m.
        pushed: cells of what is pushed.
        table: the map.
        pusher: the tool.
        parameters: how far it goes.
    """
    free = np.ones(len(b_W), bool)
    tallest, half, margin = float(table.height.max()), pusher.tool.thickness / 2, pusher.parameters.margin
    for overhang in pusher.tool.overhangs:
        room = tip_height + overhang.bottom - margin  # [N]
        if tallest <= room.min(initial=np.inf):
            continue
        across = steps(overhang.y[0] - margin, overhang.y[1] + margin, table)
        behind, ahead = overhang.x[0] - half - margin, overhang.x[1] - half + margin
        for cells, start, end in (
            (~pushed, -parameters.clearance, parameters.d_push),
            (pushed, 0.0, 0.0),
        ):
            if end == start and overhang.x[1] <= half + margin:
                ahead = 0.0
            area = rectangle(b_W, direction_W, steps(behind + start, ahead + end, table), across)
            height = table.lookup(np.where(cells, table.height, 0.0), area).max(axis=(1, 2))
            free &= height <= room
    return free
