"""What lies on other things, seen for itself: the map above a level.

Things that lie on each other move as one when the lowest of them is pushed. Above the level of what carries it,
the upper one is a thing on a table of its own: all of Alg. 3 holds there, and the tip passes over the rest.
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
    """m; the least step of height: what the tip needs to meet the upper thing, and to pass over the lower."""
    over: float = 0.004
    """m; the level lies so much above what the tip is to pass over, whose depth errs."""
    friction: float = 0.5
    """Between things and what they stand on: dry cardboard, plastics and wood have 0.2 to 0.5. What is pushed
    higher than half its width by this tilts and falls back, or falls over, where it should slide."""


_APART = 3
"""Cells between the two that are compared: right at an edge the camera measures what lies between them."""


def raised(
    table: TableMap,
    things: NDArray[np.int_],
    minimum_area: float,
    parameters: LevelsParameters,
) -> Iterator[tuple[NDArray[np.bool_], TableMap]]:
    """For each thing that lies on another, by all that is seen, its upper part and the map above that level.

    Args:
        table: the scene.
        things: [rows, columns], ids of what may be several things, 0 elsewhere.
        minimum_area: m^2, of the upper part and of the lower: what is smaller is no object.
        parameters: see there.

    Yields:
        the upper part [rows, columns]; the map, in which nothing is lower than the level and all but that part
        is known.
    """
    for a in np.unique(things[things > 0]):
        thing = things == a
        # Should it be one thing, such as a bottle with its cap, it is to slide all the same.
        slides = _width(thing, table) / 2 / parameters.friction
        for level in _levels(thing, table, minimum_area, parameters):
            if level > slides:
                break
            standing = table.objects & (table.height > level)
            upper, lower = thing & standing, thing & ~standing
            if table.cell_area * min(np.count_nonzero(upper), np.count_nonzero(lower)) >= minimum_area:
                yield (
                    upper,
                    replace(
                        table,
                        objects=standing,
                        segmented=standing & ~upper,
                        height=np.where(standing, table.height - np.float32(level), np.float32(0)),
                        plane_W=table.plane_W - np.array([0.0, 0.0, 0.0, level]),
                        doubtful=None,
                        carrying=table.objects,
                    ),
                )


def _levels(
    thing: NDArray[np.bool_], table: TableMap, minimum_area: float, parameters: LevelsParameters
) -> list[float]:
    """Rising heights, m, just above what a thing [rows, columns] rises from along the smallest object's width.

    The lowest comes first: what is pushed near its top tilts, and falls back when it is let go.
    """
    low, high = [], []
    for axis in (0, 1):
        inside, height = np.moveaxis(thing, axis, 0), np.moveaxis(table.height, axis, 0)
        ends = np.stack([height[_APART:], height[:-_APART]])
        rises = np.where(ends[0] > ends[1], inside[_APART:], inside[:-_APART])
        low.append(ends.min(0)[rises])
        high.append(ends.max(0)[rises])
    foot, top = np.concatenate(low), np.concatenate(high)
    feet = np.sort(foot[top - foot >= parameters.step])
    least = max(1, round(_APART * float(np.sqrt(minimum_area)) / table.cell))
    levels: list[float] = []
    # Where so many steps begin within the depth's error.
    for lowest, highest in zip(feet, feet[least - 1 :], strict=False):
        level = float(highest) + parameters.over
        if highest - lowest <= parameters.over and (not levels or level >= levels[-1] + parameters.step):
            levels.append(level)
    return levels


def _width(thing: NDArray[np.bool_], table: TableMap) -> float:
    """The shorter side of the rectangle around a thing [rows, columns], m."""
    cells = np.column_stack(np.nonzero(thing)[::-1]).astype(np.float32)
    return table.cell * min(cv2.minAreaRect(cells)[1])
