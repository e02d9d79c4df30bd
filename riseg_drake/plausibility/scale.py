"""Depth's unit: whether what it measures is a table with things on it."""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.rgbd import unlikely_median
from riseg_drake.plausibility.limits import PlausibilityLimits
from riseg_drake.plausibility.views import View

_DISTANCE, _SIZE, _HEIGHT, _NOISE = 0.6, 0.12, 0.09, 0.0035
"""Of a usual table scene: depth of the table, width of the largest thing and height, m, and how thick the
plane is at 1 m, m. Geometric means over three real recordings and eleven rendered ones."""
_LEAST_NOISE = 5e-4
"""m at 1 m; a thinner plane is drawn, or its depth is made smooth, and its thickness says nothing."""
UNITS = (1.0, 100.0, 256.0, 1000.0, 4000.0, 5000.0, 6553.5, 8000.0, 10000.0, 65535.0)
"""Units of depth per metre that cameras and data sets have: metres to tenths of millimetres, KITTI, L515,
TUM and ICL, Replica, SUN, BOP."""


def scene_scale(views: Sequence[View]) -> tuple[float, float] | None:
    """By what factor a scene is larger than the usual table scene, and how far the table is away, m (median).

    A geometric mean of four ratios, so that a high camera alone or a large thing alone does little. Of a
    wrong depth scale all four tell alike: the plane's thickness by its inverse, as noise grows with depth
    squared. None without a table.
    """
    factors, distances = [], []
    for view in views:
        if view.above is None:
            continue
        frame, above = view.frame, view.above
        table = view.table()
        if not table.any():
            continue
        distance = float(np.median(frame.depth[table]))
        ratios = [distance / _DISTANCE]
        if above.depth_noise > _LEAST_NOISE:
            ratios.append(_NOISE / above.depth_noise)
        if above.mask.any():
            _, _, stats, _ = cv2.connectedComponentsWithStats(above.mask.astype(np.uint8))
            size = np.sqrt(stats[1:, cv2.CC_STAT_AREA].max()) * above.distance / frame.intrinsics.fx
            ratios += [size / _SIZE, float(np.nanquantile(above.height[above.mask], 0.95)) / _HEIGHT]
        factors.append(float(np.exp(np.mean(np.log(np.maximum(ratios, 1e-6))))))
        distances.append(distance)
    return (float(np.median(factors)), float(np.median(distances))) if factors else None


def doubts_about_scale(views: Sequence[View], depth_scale: float, limits: PlausibilityLimits) -> list[str]:
    """What is wrong with depth_scale, units per metre, in one line or none."""
    found = scene_scale(views)
    if found is None:
        return []
    factor, distance = found
    usual = "1000 for millimetres, 5000 for TUM, 10000 for tenths of millimetres"
    if not 1 / limits.scale < factor < limits.scale:
        return [
            f'"depth_scale" {depth_scale:g} (units per metre) puts the table {_rounded(distance)} m away and '
            f"makes all there is {_rounded(factor)} times the size of a usual table scene; right is {usual}"
        ]
    if min(abs(depth_scale / unit - 1) for unit in UNITS) > 0.01:
        return [
            f'"depth_scale" {depth_scale:g} (units per metre) is the unit of no camera or data set that is '
            f"known, and puts the table {_rounded(distance)} m away; right is {usual}"
        ]
    return []


def doubts_about_distance(depths: Sequence[NDArray[np.float32]]) -> list[str]:
    """Whether what depth images [H, W], m, see is where no table scene is, in one line or none: of use where
    they show no table."""
    unlikely = [median for depth in depths if (median := unlikely_median(depth)) is not None]
    if not unlikely or 2 * len(unlikely) < len(depths):
        return []
    return [
        f"the median depth is {np.median(unlikely):.3g} m, which is unlikely; "
        'is "depth_scale" (units per metre) right?'
    ]


def _rounded(number: float) -> str:
    """To two digits, and no power of ten where a person would write none."""
    return f"{float(f'{number:.2g}'):g}"
