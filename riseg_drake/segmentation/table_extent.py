"""Where the table ends: what stands beside or behind it is none of its objects (not in the paper).

A camera that looks at a table from one side sees the room as well: walls, chairs, shelves are above the
table's plane, too, but not above the table. Three things tell them from objects:

- A wall is a wide upright plane with nothing behind it. It may touch the table, and objects may touch it.
- The table reaches as far as the convex hull of what is seen of it. An object at its edge hides the table
  behind itself and sticks out of the hull, but it is one connected surface with what lies inside.
- What stands on the floor goes on below the table's plane. What stands on the table does not.
"""

from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.geometry.rgbd import Frame
from riseg_drake.segmentation.walls import WallParameters, find_walls, in_walls

_STEP = 10
"""Every so many pixels are looked at first."""
_CELL, _COARSE_CELL = 0.01, 0.04
"""m; of the map of the table, and of the one in which its parts are put together."""
_REACH = 4.0
"""m; the map is cut off that far from the camera."""
_BROAD_SHARE = 0.7
"""Of what lies on the plane; where less than that is broad, the table is full of things."""
_PIXELS_MIN = 12
"""Of every tenth; where fewer see the table, nothing can be said of its end."""


@dataclass
class TableExtentParameters:
    """What belongs to a table."""

    elsewhere_share: float = 0.03
    """Share of the image that must be wall, floor, or far from the table, before its end matters at all."""
    far: float = 0.03
    """m beside the seen table; what is farther is surely elsewhere."""
    margin: float = 0.01
    """m beside the seen table; so near is still on it."""
    unseen: float = 0.2
    """m; so far the table is taken to go on where the image cuts it off."""
    gap: float = 0.15
    """m; what hides the table parts it no farther than that."""
    walls: WallParameters = field(default_factory=WallParameters)
    step: float = 0.02
    """m; where neighbouring pixels differ more in depth, what they see is not connected. Farther than 1 m
    it grows with the square of depth."""
    inside_share: float = 0.3
    """Of a connected surface, that makes it the table's."""
    sunk: float = 0.05
    """m below the table's plane; what reaches that deep stands on the floor."""
    sunk_share: float = 0.1
    """Of a connected surface, that makes it the floor's."""
    tall: float = 0.45
    """m; what is higher is no object but furniture, a person or a wall."""
    tall_share: float = 0.3
    """Of a connected surface, that makes it such a thing."""


def on_this_table(
    frame: Frame,
    height: NDArray[np.float32],
    plane_C: NDArray[np.float64],
    on_table: NDArray[np.bool_],
    height_min: float,
    parameters: TableExtentParameters,
) -> NDArray[np.bool_] | None:
    """Pixels [H, W] that see the table or what stands on it; None where the image shows nothing else.

    Args:
        frame: what is seen.
        height: [H, W], m above the table's plane, NaN where depth is invalid.
        plane_C: [4], the table.
        on_table: which of every fifth pixel in both directions lie on the plane.
        height_min: m; what is less far above the plane is still the table.
        parameters: see there.
    """
    along = _axes(plane_C[:3])
    every = (slice(None, None, _STEP), slice(None, None, _STEP))
    few, depth, feet = height[every], frame.depth[every], _feet(frame, along, _STEP)
    seen = np.isfinite(few) & ~frame.robot[every]
    with np.errstate(invalid="ignore"):
        above, sunk = few > height_min, few < -parameters.sunk
    walls = find_walls(feet[seen], few[seen], depth[seen], parameters.walls)
    beyond = in_walls(walls, feet, depth, parameters.walls) & above
    wide = _broad(on_table)[::2, ::2] & seen & ~beyond
    if np.count_nonzero(wide) < _PIXELS_MIN:
        return None
    top = _largest(wide, feet, parameters.gap)
    table = _Table(np.vstack([feet[_ends(top)], _going_on(top, feet, parameters.unseen)]))
    beyond |= sunk | (above & ~table.holds(feet, parameters.far))
    if np.count_nonzero(beyond & seen) < parameters.elsewhere_share * few.size:
        return None
    return _standing_on(table, walls, frame, height, along, height_min, parameters)


def _axes(normal: NDArray) -> NDArray[np.float64]:
    """Two directions [2, 3] in a plane."""
    helper = np.eye(3)[np.argmin(np.abs(normal))]
    first = np.cross(normal, helper)
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(normal, first)])


def _feet(frame: Frame, along: NDArray, step: int) -> NDArray[np.float32]:
    """Where on the plane [h, w, 2], m, the points of every so many pixels stand, seen from the camera's foot.

    As for heights, depth times what is linear in u and in v: no point is ever built.
    """
    k: Intrinsics = frame.intrinsics
    u = (np.arange(0, k.width, step) - k.cx) / k.fx
    v = (np.arange(0, k.height, step) - k.cy) / k.fy
    depth = frame.depth[::step, ::step]
    feet = np.empty((*depth.shape, 2), np.float32)
    for axis, (x, y, z) in enumerate(along):
        linear = (x * u + z).astype(np.float32) + (y * v).astype(np.float32)[:, None]
        np.multiply(linear, depth, out=feet[..., axis])
    return feet


def _broad(on_table: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """What lies on the plane without thin strips: there a wall or a chair crosses it."""
    broad = cv2.morphologyEx(on_table.astype(np.uint8), cv2.MORPH_OPEN, np.ones((3, 3), np.uint8)) > 0
    # A full table has thin gaps only.
    full = np.count_nonzero(broad) < _BROAD_SHARE * np.count_nonzero(on_table)
    return on_table if full else broad


def _largest(wide: NDArray[np.bool_], feet: NDArray, gap: float) -> NDArray[np.bool_]:
    """Which pixels [h, w] see the largest connected part of the table; what lies between two parts, and
    hides the table, does not part them."""
    size = int(2 * _REACH / _COARSE_CELL)
    cells = ((feet[wide] + _REACH) / _COARSE_CELL).astype(int).clip(0, size - 1)
    picture = np.zeros((size, size), np.uint8)
    picture[cells[:, 1], cells[:, 0]] = 1
    reach = 2 * round(gap / 2 / _COARSE_CELL) + 1
    near = cv2.dilate(picture, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (reach, reach)))
    label = cv2.connectedComponents(near)[1][cells[:, 1], cells[:, 0]]
    out = wide.copy()
    out[wide] = label == np.argmax(np.bincount(label))
    return out


def _ends(top: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The first and the last pixel of every row: rows are straight on the plane, too, so the hull of these
    is that of all."""
    out, rows = np.zeros_like(top), np.flatnonzero(top.any(1))
    out[rows, top[rows].argmax(1)] = True
    out[rows, -1 - top[rows, ::-1].argmax(1)] = True
    return out


def _going_on(top: NDArray[np.bool_], feet: NDArray, unseen: float) -> NDArray[np.float32]:
    """Points [N, 2] of the table outside of the image, beyond where its border cuts the table off."""
    cut_off = top.copy()
    cut_off[1:-1, 1:-1] = False
    edge = feet[cut_off]
    outwards = edge - feet[top].mean(axis=0)
    return edge + unseen * outwards / np.maximum(np.linalg.norm(outwards, axis=1, keepdims=True), 1e-6)


class _Table:
    """The convex hull of what is seen of a table, on its plane."""

    def __init__(self, feet: NDArray):
        near = feet.clip(-_REACH, _REACH)
        self._hull = cv2.convexHull(near.reshape(-1, 1, 2))
        self._origin = near.min(axis=0) - 0.1
        self._size = np.ceil((near.max(axis=0) + 0.1 - self._origin) / _CELL).astype(int)

    def holds(self, feet: NDArray, margin: float) -> NDArray[np.bool_]:
        """Which points [h, w, 2] lie inside, or no more than a margin, m, outside; if it is below 0, so far
        from the edge."""
        picture = np.zeros(self._size[::-1], np.uint8)
        corners = np.rint((self._hull - self._origin) / _CELL).astype(np.int32)
        cv2.fillConvexPoly(picture, corners, 1)
        # A thick outline: half of it lies outside, the other half inside.
        thickness = 2 * round(abs(margin) / _CELL) + 1
        cv2.polylines(picture, [corners], True, 1 if margin > 0 else 0, thickness)
        at = (feet - self._origin) * np.float32(1 / _CELL)
        return cv2.remap(picture, at.astype(np.float32, copy=False), None, cv2.INTER_NEAREST) > 0


def _standing_on(
    table: _Table,
    walls: NDArray,
    frame: Frame,
    height: NDArray[np.float32],
    along: NDArray,
    height_min: float,
    parameters: TableExtentParameters,
) -> NDArray[np.bool_]:
    """The pixels [H, W] of connected surfaces that stand on the table."""
    # Every second pixel will do; what they see is cut apart where depth makes a step.
    depth, few = frame.depth[::2, ::2], height[::2, ::2]
    feet = _feet(frame, along, 2)
    with np.errstate(invalid="ignore"):
        off = ((few > height_min) | (few < -parameters.sunk)) & ~frame.robot[::2, ::2]
    whole = off & ~in_walls(walls, feet, depth, parameters.walls)
    step = np.float32(parameters.step) * np.maximum(depth, 1) ** 2
    whole[1:] &= np.abs(np.diff(depth, axis=0)) <= step[1:]
    whole[:, 1:] &= np.abs(np.diff(depth, axis=1)) <= step[:, 1:]
    number, label = cv2.connectedComponents(whole.astype(np.uint8), connectivity=4)
    with np.errstate(invalid="ignore"):
        inside, sunk, tall = (
            _share(what, label, number)
            for what in (table.holds(feet, parameters.margin), few < 0, few > parameters.tall)
        )
    mine = inside >= parameters.inside_share
    mine &= (sunk <= parameters.sunk_share) & (tall <= parameters.tall_share)
    # An object that touches a chair is one surface with it: of such, what lies well inside.
    mixed = ~mine & (tall <= parameters.tall_share)
    mine[0] = mixed[0] = False
    belongs = mine[label] | (mixed[label] & table.holds(feet, -parameters.far))
    # What no surface holds, between the pixels and at a step, goes with what is beside it.
    beside = cv2.dilate(belongs.view(np.uint8), np.ones((3, 3), np.uint8)) > 0
    belongs = beside & ~(whole & ~belongs)
    large = cv2.resize(
        belongs.view(np.uint8), (2 * belongs.shape[1], 2 * belongs.shape[0]), interpolation=cv2.INTER_NEAREST
    )
    return large[: height.shape[0], : height.shape[1]] > 0


def _share(what: NDArray[np.bool_], label: NDArray[np.int32], number: int) -> NDArray[np.float64]:
    """Which share of each label's pixels, [number], is something."""
    count = np.bincount(label.ravel(), minlength=number)
    return np.bincount(label[what], minlength=number) / np.maximum(count, 1)
