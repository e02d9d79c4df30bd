"""GetObjsAboveTable (Alg. 3, line 1): which pixels see something that stands on the table.

Alg. 2 needs it too: on a blank table optical flow is invented, so motion counts only above it.
"""

from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.camera import Intrinsics, bounding_region
from riseg_drake.geometry.plane import heights_above_plane, transform_plane
from riseg_drake.geometry.rgbd import Frame, Immutable
from riseg_drake.segmentation.scales import LOWEST, SMALLEST_SEEN
from riseg_drake.segmentation.table_extent import TableExtentParameters, on_this_table
from riseg_drake.segmentation.table_plane import PlaneFitParameters, fit_plane

_DEPTH_NOISE_MIN = 2.0e-4
"""m at 1 m; a rendered depth without noise is taken for no better than that: pixels still are of some size."""
_EVERY = 2
"""Pixels between those that are asked what is around them, ..."""
_AROUND = (9, 9)
"""... so many of which lend their colour: dark patches are about half as wide."""
_ALIKE = 0.5
"""Of its squared distance from the table's colour, at which a colour is a thing's."""
_FEW = 0.05
"""Share of what is around a pixel that must be a thing for it to be of that thing."""


@dataclass
class AboveTableParameters:
    """What counts as standing on the table. The paper names RANSAC and no figure."""

    plane: PlaneFitParameters = field(default_factory=PlaneFitParameters)
    height_min: float = LOWEST
    """m; what is lower is table."""
    noise_multiple: float = 4.0
    """What is nowhere higher than so many standard deviations of the depth seen on the table is table."""
    foot_multiple: float = 2.0
    """The foot of what rises higher than that is as high as so many of them."""
    area_min: float = SMALLEST_SEEN
    """m^2; a smaller piece is noise, not an object."""
    extent: TableExtentParameters = field(default_factory=TableExtentParameters)


@dataclass(frozen=True)
class AboveTable(Immutable):
    """objMask of one frame, and the table that it was measured from."""

    mask: NDArray[np.bool_]
    """[H, W], the paper's objMask; never the robot."""
    height: NDArray[np.float32]
    """[H, W], m above the table; NaN where depth is invalid."""
    plane_W: NDArray[np.float64]
    """[4], n . p_WQ + d is the height of Q above the table; n points up."""
    depth_noise: float
    """Standard deviation of depth at 1 m, as the table itself shows it (m); grows with depth squared."""
    distance: float
    """Median depth of what stands on the table, m; 1 where nothing does."""

    def pixels_per_metre(self, intrinsics: Intrinsics) -> float:
        """How large things that stand on the table appear, about, pixels a metre."""
        return intrinsics.fx / self.distance


NOTHING_ABOVE_TABLE = AboveTable(
    mask=np.zeros((0, 0), bool),
    height=np.zeros((0, 0), np.float32),
    plane_W=np.array([0.0, 0.0, 1.0, 0.0]),
    depth_noise=_DEPTH_NOISE_MIN,
    distance=1.0,
)
"""What stands on the table before the first frame."""


def objects_above_table(frame: Frame, parameters: AboveTableParameters) -> AboveTable:
    """Fit the table by RANSAC and mark what stands on it.

    The hypotheses are drawn from a generator that starts anew each time: the same frame gives the same
    answer, whoever asks and however often.

    Raises:
        NoPlaneError: where no table is to be seen.
    """
    rng = np.random.default_rng(0)
    seen = ~frame.robot
    plane_C = fit_plane(frame.depth, frame.intrinsics, rng, parameters.plane, valid=seen)
    height = heights_above_plane(frame.depth, frame.intrinsics, plane_C)
    on_table = _on_table(height, frame, parameters)
    depth_noise = _depth_noise(height, frame.depth, on_table, parameters)
    high, clearly = _high(height, frame, depth_noise, parameters)
    belonging = on_this_table(frame, height, plane_C, on_table, parameters.height_min, parameters.extent)
    if belonging is not None:
        high &= belonging
    z = frame.depth[high]
    distance = float(np.median(z)) if len(z) else 1.0
    with np.errstate(invalid="ignore"):
        raised = height > 0.5 * parameters.height_min
    mask = _without_specks(high, raised, clearly, frame, parameters.area_min / distance**2)
    return AboveTable(mask, height, transform_plane(frame.X_WC, plane_C), depth_noise, distance)


def _every(n: int) -> tuple[slice, slice]:
    """Every n-th pixel in both directions."""
    return slice(None, None, n), slice(None, None, n)


def _on_table(height: NDArray, frame: Frame, parameters: AboveTableParameters) -> NDArray[np.bool_]:
    """Which of every fifth pixel in both directions lie on the plane, as far as noise may be assumed."""
    h, z, robot = height[_every(5)], frame.depth[_every(5)], frame.robot[_every(5)]
    assumed = np.hypot(parameters.plane.tolerance / 3, parameters.plane.depth_noise * z**2)
    with np.errstate(invalid="ignore"):
        return (np.abs(h) < 3 * assumed) & ~robot


def _depth_noise(
    height: NDArray, depth: NDArray, on_table: NDArray[np.bool_], parameters: AboveTableParameters
) -> float:
    """Noise of depth at 1 m (m), from the scatter of the table's own pixels about the plane."""
    if np.count_nonzero(on_table) < 100:
        return parameters.plane.depth_noise
    h, z = height[_every(5)][on_table], depth[_every(5)][on_table]
    # Not by a median: depth in whole millimetres makes it 0 on a table that faces the camera.
    return max(float(np.sqrt(np.mean((h / z**2) ** 2))), _DEPTH_NOISE_MIN)


def _high(
    height: NDArray[np.float32], frame: Frame, depth_noise: float, parameters: AboveTableParameters
) -> tuple[NDArray[np.bool_], NDArray[np.bool_] | None]:
    """What may stand on the table [H, W], and what surely does; None where that is the same."""
    clear, foot = (
        np.float32(multiple * depth_noise) for multiple in (parameters.noise_multiple, parameters.foot_multiple)
    )
    lowest = np.float32(parameters.height_min)
    with np.errstate(invalid="ignore"):
        if clear * frame.depth.max() ** 2 <= lowest:
            return (height > lowest) & ~frame.robot, None
        z_squared = frame.depth**2
        high = (height > np.maximum(lowest, foot * z_squared)) & ~frame.robot
        return high, high & (height > clear * z_squared)


def _without_specks(
    mask: NDArray[np.bool_],
    raised: NDArray[np.bool_],
    clearly: NDArray[np.bool_] | None,
    frame: Frame,
    area_min: float,
) -> NDArray[np.bool_]:
    """Close pinholes, add what has no depth and a thing's colour, or is enclosed without depth or `raised`
    above the table (low things have pixels that noise makes lower), drop pieces that look smaller than
    `area_min` (m^2 at 1 m), or of which less than that rises clearly."""
    out = np.zeros_like(mask)
    if not mask.any():
        return out
    region = bounding_region(mask, margin=2)
    robot, depth, color = frame.robot[region], frame.depth[region], frame.color[region]
    closed = cv2.morphologyEx(mask[region].astype(np.uint8), cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
    missing = np.nonzero((depth == 0) & (closed == 0) & ~robot)
    closed[missing] = _colored_like_things(missing, color, mask[region], (depth > 0) & (closed == 0) & ~robot)
    closed |= _enclosed(((depth == 0) | raised[region]) & (closed == 0), closed)
    np.copyto(closed, 0, where=robot)
    number, label, stats, _ = cv2.connectedComponentsWithStats(closed, connectivity=4)
    pixels_min = area_min * frame.intrinsics.fx * frame.intrinsics.fy
    keep = stats[:, cv2.CC_STAT_AREA] >= pixels_min
    if clearly is not None:
        keep &= np.bincount(label[clearly[region]], minlength=number) >= pixels_min
    keep[0] = False
    out[region] = keep.take(label)
    return out


def _colored_like_things(
    vu: tuple[NDArray[np.intp], ...],
    color: NDArray[np.uint8],
    thing: NDArray[np.bool_],
    table: NDArray[np.bool_],
) -> NDArray[np.bool_]:
    """Which of N pixels look like the `thing` [H, W] around them rather than the `table` around them.

    Stereo has no depth on the last pixels before an edge nor on the first behind it, and none in patches of
    what is dark: colour tells which are the thing's. That around them, as light and shadow are not everywhere
    the same.
    """
    few = np.ascontiguousarray(color[_every(_EVERY)])
    parts = [which[_every(_EVERY)].astype(np.uint8) for which in (thing, table)]
    shares = [cv2.boxFilter(part, cv2.CV_32F, _AROUND) for part in parts]
    v, u = vu
    coarse = v // _EVERY * few.shape[1] + u // _EVERY
    alike = shares[0].ravel().take(coarse) > _FEW
    # Most pixels without depth are far from all things: the others' colours are asked alone.
    near = np.flatnonzero(alike)
    own, coarse = color[v[near], u[near]].astype(np.float32), coarse[near]
    off = []
    for part, share in zip(parts, shares, strict=True):
        total = cv2.boxFilter(cv2.copyTo(few, part), cv2.CV_32F, _AROUND).reshape(-1, 3)
        mean = total.take(coarse, axis=0) / np.maximum(share.ravel().take(coarse), 1e-6)[:, None]
        squared = np.square(own - mean)
        off.append(squared[:, 0] + squared[:, 1] + squared[:, 2])
    alike[near] = (off[0] < _ALIKE * off[1]) | (shares[1].ravel().take(coarse) < _FEW / 10)
    return alike


def _enclosed(holes: NDArray[np.bool_], around: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """Those of the holes [H, W] that border on nothing but what is 1."""
    number, label = cv2.connectedComponents(holes.view(np.uint8), connectivity=4)
    outside = cv2.dilate((~holes & (around == 0)).view(np.uint8), np.ones((3, 3), np.uint8))
    beside = cv2.bitwise_and(outside, holes.view(np.uint8)).view(bool)
    keep = np.ones(number, bool)
    for open_label in (label[beside], label[0], label[-1], label[:, 0], label[:, -1]):
        keep[open_label] = False
    keep[0] = False
    return keep.take(label)
