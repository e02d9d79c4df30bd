"""Where the table ends: what stands beside or behind it is none of its objects (not in the paper).

A camera that looks at a table from one side sees the room as well. The wall behind is above the table's
plane, too, but not above the table: its foot lies outside of what is seen of the table.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.camera import rays
from riseg_drake.geometry.rgbd import Frame

_STEP = 10
"""Every so many pixels are looked at first."""
_CELL = 0.005
"""m; of the map of the table."""
_REACH = 3.0
"""m; the map is cut off that far from the table's middle."""
_ELSEWHERE_SHARE = 0.03
"""Share of the image that must be far from the table before its end matters at all."""
_BROAD_SHARE = 0.7
"""Of what lies on the plane; where less than that is broad, the table is full of things."""
_FAR, _MARGIN = 0.03, 0.008
"""m beside the seen table: that far is surely elsewhere; so near is still on it."""


def off_table(
    frame: Frame,
    height: NDArray[np.float32],
    plane_C: NDArray[np.float64],
    on_table: NDArray[np.bool_],
    height_min: float,
) -> NDArray[np.bool_] | None:
    """Pixels [H, W] that see what is beside or behind the table; None where the image shows only the table.

    Args:
        frame: what is seen.
        height: [H, W], m above the table's plane, NaN where depth is invalid.
        plane_C: [4], the table.
        on_table: which of every fifth pixel in both directions lie on the plane.
        height_min: m; what is less far below the plane is still the table.
    """
    every = (slice(None, None, _STEP), slice(None, None, _STEP))
    along = _axes(plane_C[:3])
    few = height[every]
    feet = _feet(rays(frame.intrinsics)[every], frame.depth[every], along)
    table = _largest_piece(on_table)[::2, ::2]
    if np.count_nonzero(table) < 12:
        return None
    hull, size, origin = _hull(feet[table])
    with np.errstate(invalid="ignore"):
        sunk = few < -max(0.05, 5 * height_min)
        outside = (few > height_min) & ~_marked(_map(hull, size, _FAR), feet, origin)
    seen = np.isfinite(few) & ~frame.robot[every]
    if np.count_nonzero((sunk | outside) & seen) < _ELSEWHERE_SHARE * few.size:
        return None
    feet = _feet(rays(frame.intrinsics), frame.depth, along)
    return ~_marked(_map(hull, size, _MARGIN), feet, origin)


def _axes(normal: NDArray) -> NDArray[np.float32]:
    """Two directions [2, 3] in a plane."""
    helper = np.eye(3)[np.argmin(np.abs(normal))]
    first = np.cross(normal, helper)
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(normal, first)]).astype(np.float32)


def _feet(ray: NDArray, depth: NDArray, along: NDArray) -> NDArray[np.float32]:
    """Where on the plane, m, points stand that lie `depth` along rays: [..., 2]."""
    return (ray.reshape(-1, 3) @ along.T).reshape(*depth.shape, 2) * depth[..., None]


def _largest_piece(on_table: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The largest connected part; objects between do not part it."""
    # A wall meets the plane in a thin strip, which is none of the table; but a full table has thin gaps.
    broad = cv2.morphologyEx(on_table.astype(np.uint8), cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
    if np.count_nonzero(broad) < _BROAD_SHARE * np.count_nonzero(on_table):
        broad = on_table.astype(np.uint8)
    closed = cv2.morphologyEx(broad, cv2.MORPH_CLOSE, np.ones((7, 7), np.uint8))
    _, label, stats, _ = cv2.connectedComponentsWithStats(closed)
    stats[0, cv2.CC_STAT_AREA] = 0
    return (broad > 0) & (label == np.argmax(stats[:, cv2.CC_STAT_AREA]))


def _hull(feet: NDArray) -> tuple[NDArray[np.int32], tuple[int, int], NDArray]:
    """The convex hull of points on the plane, cells (x, y), the size of a map with room to grow it, and
    where that begins, m."""
    middle = np.median(feet, axis=0)
    near = np.clip(feet, middle - _REACH, middle + _REACH)
    origin = near.min(axis=0) - 2 * _FAR
    cells = ((near - origin) / _CELL).astype(np.int32)
    width, height = cells.max(axis=0) + int(2 * _FAR / _CELL)
    return cv2.convexHull(cells.reshape(-1, 1, 2)), (int(height), int(width)), origin


def _map(hull: NDArray[np.int32], size: tuple[int, int], margin: float) -> NDArray[np.uint8]:
    """1 inside of a convex hull and as far outside as a margin, m, goes."""
    picture = np.zeros(size, np.uint8)
    cv2.fillConvexPoly(picture, hull, 1)
    # A thick outline: half of it lies outside.
    cv2.polylines(picture, [hull], True, 1, thickness=2 * round(margin / _CELL) + 1)
    return picture


def _marked(picture: NDArray[np.uint8], feet: NDArray, origin: NDArray) -> NDArray[np.bool_]:
    """Whether the cell of each point is set; False beyond the map."""
    size = picture.shape[::-1]
    at = np.clip((feet - origin) / _CELL, -1, size).astype(np.intp)
    x, y = at[..., 0], at[..., 1]
    inside = (x >= 0) & (y >= 0) & (x < size[0]) & (y < size[1])
    at = np.where(inside[..., None], at, 0)
    return inside & (picture[at[..., 1], at[..., 0]] > 0)
