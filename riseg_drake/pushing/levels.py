"""What lies on other things, seen for itself: the map above a level.

Things that lie on each other move as one when the lowest of them is pushed. Above the level of what carries it,
the upper one is a thing on a table of its own: all of Alg. 3 holds there, and the bar passes over the rest.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from riseg_drake.pushing.table_map import TableMap


@dataclass
class LevelsParameters:
    """Which steps are seen as the edge of what lies on something (none of it in the paper)."""

    step: float = 0.010
    """m; the least step of height: what the bar needs to meet the upper thing, and to pass over the lower."""
    over: float = 0.004
    """m; the level lies so much above what the bar is to pass over, whose depth errs."""


_APART = 3
"""Cells between the two that are compared: right at an edge the camera measures what lies between them."""


def raised(
    table: TableMap,
    things: NDArray[np.int_],
    minimum_area: float,
    d_push: float,
    parameters: LevelsParameters,
) -> Iterator[tuple[NDArray[np.bool_], TableMap]]:
    """For each thing that lies on another, by all that is seen, its upper part and the map above that level.

    Args:
        table: the scene.
        things: [rows, columns], ids of what may be several things, 0 elsewhere.
        minimum_area: m^2, of the upper part and of the lower: what is smaller is no object.
        d_push: how far a push goes, m.
        parameters: see there.

    Yields:
        the upper part [rows, columns]; the map, in which nothing is lower than the level and all but that part
        is known.
    """
    for a in np.unique(things[things > 0]):
        thing = things == a
        level = _level(thing, table, minimum_area, parameters)
        if level is None:
            continue
        standing = table.objects & (table.height > level)
        upper, lower = thing & standing, thing & ~standing
        area = table.cell_area * min(np.count_nonzero(upper), np.count_nonzero(lower))
        # Should it be one thing, it may fall over: pushed at its top, once it has gone as far as it is wide.
        if area >= minimum_area and _width(thing, table) >= 2 * d_push:
            yield (
                upper,
                replace(
                    table,
                    objects=standing,
                    segmented=standing & ~upper,
                    height=np.where(standing, table.height - np.float32(level), np.float32(0)),
                    plane_W=table.plane_W - np.array([0.0, 0.0, 0.0, level]),
                    doubtful=None,
                ),
            )


def _level(
    thing: NDArray[np.bool_], table: TableMap, minimum_area: float, parameters: LevelsParameters
) -> float | None:
    """The lowest height, m, at which a thing [rows, columns] has steps as long as the smallest object is wide.

    What is pushed near its top tilts, and falls back when it is let go. None where no steps are so long.
    """
    low, high = [], []
    for axis in (0, 1):
        inside, height = np.moveaxis(thing, axis, 0), np.moveaxis(table.height, axis, 0)
        both = inside[_APART:] & inside[:-_APART]
        ends = np.stack([height[_APART:][both], height[:-_APART][both]])
        low.append(ends.min(0) + parameters.over)
        high.append(ends.max(0) - (parameters.step - parameters.over))
    first, last = np.concatenate(low), np.concatenate(high)
    steps = first <= last
    if not steps.any():
        return None
    # The number of steps around a level changes only where one of them begins or ends.
    levels = np.sort(first[steps])
    around = np.searchsorted(levels, levels, side="right") - np.searchsorted(np.sort(last[steps]), levels)
    enough = around >= _APART * np.sqrt(minimum_area) / table.cell
    return float(levels[enough.argmax()]) if enough.any() else None


def _width(thing: NDArray[np.bool_], table: TableMap) -> float:
    """The shorter side of the rectangle around a thing [rows, columns], m."""
    cells = np.column_stack(np.nonzero(thing)[::-1]).astype(np.float32)
    return table.cell * min(cv2.minAreaRect(cells)[1])
