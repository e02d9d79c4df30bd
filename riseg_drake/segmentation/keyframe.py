"""The picture of the last rest, cut into superpixels: what every later frame is compared with."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.camera import WHOLE, Region, bounding_region
from riseg_drake.geometry.nearest import nearest_values
from riseg_drake.geometry.reduction import one_of_each
from riseg_drake.geometry.rgbd import Frame, Immutable
from riseg_drake.segmentation.above_table import AboveTable
from riseg_drake.segmentation.alignment import EdgePixels, edge_pixels, has_contrast
from riseg_drake.segmentation.noise import MeasurementNoise, gray_variance
from riseg_drake.segmentation.occlusion import with_occlusions
from riseg_drake.segmentation.propagation import draw_labels
from riseg_drake.segmentation.superpixels import (
    Superpixels,
    split_superpixels,
    superpixels,
    with_gaps,
    with_pieces,
)
from riseg_drake.segmentation.support import may_lie_on
from riseg_drake.segmentation.surface import SurfacePixels, surface_pixels

_BOUNDARY = np.ones((5, 5), np.uint8)
"""Two pixels on each side of an outline are blurred, interpolated across it, or without true depth."""
_PINHOLE = np.ones((3, 3), np.uint8)
"""A larger hole in depth is mostly an outline's."""
_THERE = 0.015
"""m; what is seen within that of where it is drawn may be it."""


@dataclass
class KeyframeParameters:
    """How finely a keyframe is looked at."""

    superpixel: float = 0.006
    """m on the object; size of the superpixels, each of which is taken to lie on one body."""
    edge_pixels: int = 6000
    """At most so many pixels sharpen motions."""
    behind: float = 0.012
    """m; surfaces on both sides of what is in front of them may be one if they are as high within that."""
    pieces: bool = True
    """What was one body is one, in however many pieces it is seen now."""
    gap: float = 0.01
    """m; the widest gap across which two things that are seen may be one."""


@dataclass(frozen=True)
class Keyframe(Immutable):
    """A frame cut into N superpixels."""

    frame: Frame
    above: AboveTable
    region: Region
    """The part of the view that is cut: all that stands there."""
    height: NDArray[np.float32]
    """[h, w] of the region, m above the table, medians of five by five pixels; what stands there without depth
    is as high as what is near."""
    superpixels: Superpixels
    """Of the region."""
    side: float
    """Pixels; of a superpixel, about, where they were cut."""
    over: NDArray[np.bool_]
    """[M], borders at which one side may lie on the other."""
    area: NDArray[np.intp]
    """[N], pixels of each superpixel."""
    points: SurfacePixels
    """What is compared: pixels with depth, not at an occlusion boundary, every second; neighbours err alike."""
    owner: NDArray[np.intp]
    """[W], superpixel of each point."""
    gray: NDArray[np.float32]
    """[W], of each point."""
    variance: NDArray[np.float32]
    """[W], of the difference between that and where it should reappear."""
    gradient_squared: NDArray[np.float32]
    """[W], of the gray value, squared gray levels a squared pixel."""
    edges: EdgePixels
    """What sharpens motions; their `piece` is the superpixel."""

    @property
    def count(self) -> int:
        """N."""
        return self.superpixels.count

    @property
    def borders(self) -> NDArray[np.intp]:
        """[M, 2], pairs of superpixels that touch, or may be one behind something or across a gap."""
        return self.superpixels.borders

    @property
    def behind(self) -> NDArray[np.bool_]:
        """[M], which of them lie behind something."""
        return self.superpixels.behind

    @property
    def across(self) -> NDArray[np.bool_]:
        """[M], which of them lie across a gap."""
        return self.superpixels.across

    @property
    def length(self) -> NDArray[np.float64]:
        """[M], of each border, in sides of a superpixel."""
        return self.superpixels.length / self.side

    @cached_property
    def point_count(self) -> NDArray[np.intp]:
        """[N], how many points each superpixel has."""
        return np.bincount(self.owner, minlength=self.count)

    def share_of_points(self, which: NDArray[np.intp]) -> NDArray[np.float64]:
        """Of each superpixel's points the share [N] that is among some of them, by their numbers."""
        return np.bincount(self.owner.take(which), minlength=self.count) / np.maximum(self.point_count, 1)

    @cached_property
    def covered(self) -> NDArray[np.bool_]:
        """[H, W], what stands there, and four pixels around it."""
        return cv2.dilate(self.above.mask.view(np.uint8), np.ones((9, 9), np.uint8)).view(bool)

    @cached_property
    def plane_K(self) -> NDArray[np.float64]:
        """[4], the table's plane in the keyframe's own camera."""
        return self.above.plane_W @ self.frame.X_WC

    @property
    def pixels_per_metre(self) -> float:
        """How large things appear, about, pixels a metre."""
        return self.above.pixels_per_metre(self.frame.intrinsics)

    def image_of(self, values: NDArray, outside: int = 0) -> NDArray:
        """A value for each superpixel [N] as an image [H, W], `outside` where there is none."""
        image = np.full(self.frame.depth.shape, outside, values.dtype)
        label = self.superpixels.label
        image[self.region] = np.append(values, np.array(outside, values.dtype)).take(label)
        return image


def make_keyframe(
    frame: Frame,
    above: AboveTable,
    noise: MeasurementNoise,
    parameters: KeyframeParameters,
    bodies: NDArray[np.integer] | None = None,
) -> Keyframe:
    """Cut what stands on the table of a frame; known borders between bodies [H, W] cut, too."""
    region = bounding_region(above.mask)
    size = max(3, round(parameters.superpixel * above.pixels_per_metre(frame.intrinsics)))
    height = _filled(above.height[region], above.mask[region])
    cut = superpixels(frame.color[region], height, above.mask[region], size)
    if bodies is not None:
        cut = split_superpixels(cut, bodies[region])
    height = cv2.medianBlur(height, 5)
    table = (np.isfinite(above.height) & ~above.mask & ~frame.robot)[region]
    cut = with_occlusions(cut, height, table, parameters.behind)
    cut = with_gaps(cut, parameters.gap * above.pixels_per_metre(frame.intrinsics))
    if bodies is not None and parameters.pieces:
        cut = with_pieces(cut, bodies[region])
    owner = np.full(above.mask.shape, -1, np.intp)
    owner[region] = cut.label
    area = np.bincount(cut.label[cut.label >= 0], minlength=cut.count)
    return Keyframe(
        frame=frame,
        above=above,
        region=region,
        height=height,
        superpixels=cut,
        side=max(1.0, float(np.sqrt(np.median(area))) if len(area) else 1.0),
        over=may_lie_on(cut, height),
        area=area,
        **_compared(frame, owner, noise, parameters),
    )


def in_fewer_pixels(
    keyframe: Keyframe, frame: Frame, above: AboveTable, noise: MeasurementNoise, parameters: KeyframeParameters
) -> Keyframe:
    """The keyframe, cut as it is, in the pixels of its own frame after `reduced`; itself if that is whole."""
    if frame.source is None:
        return keyframe
    owner = one_of_each(keyframe.image_of(np.arange(keyframe.count), -1), frame.reduction)
    return _shown(keyframe, frame, owner, above, noise, parameters)


def seen_again(
    keyframe: Keyframe, frame: Frame, above: AboveTable, noise: MeasurementNoise, parameters: KeyframeParameters
) -> Keyframe:
    """The keyframe, cut as it is, as another frame shows it in which all stands as it stood then.

    From another view depth errs otherwise, gloss shows other lights, and what is near is twice as large. Where
    the frame has no depth, as it is too near, that of the keyframe must do.
    """
    number = keyframe.image_of(np.arange(1, keyframe.count + 1, dtype=np.uint16))
    drawn, depth = draw_labels(keyframe.frame, frame, number, {})
    elsewhere = (frame.depth > 0) & (np.abs(frame.depth - depth) > _THERE)
    owner = np.where(frame.robot | elsewhere, 0, drawn).astype(np.intp) - 1
    completed = replace(frame, depth=np.where(frame.depth > 0, frame.depth, depth))
    return _shown(keyframe, completed, owner, above, noise, parameters)


def _shown(
    keyframe: Keyframe,
    frame: Frame,
    owner: NDArray[np.intp],
    above: AboveTable,
    noise: MeasurementNoise,
    parameters: KeyframeParameters,
) -> Keyframe:
    """The keyframe's superpixels where a frame shows them, `owner` [H, W], -1 = none."""
    return replace(
        keyframe,
        frame=frame,
        above=replace(above, mask=above.mask | (owner >= 0)),
        region=WHOLE,
        superpixels=replace(keyframe.superpixels, label=owner),
        area=np.bincount(owner[owner >= 0], minlength=keyframe.count),
        **_compared(frame, owner, noise, parameters),
    )


def _compared(
    frame: Frame, owner: NDArray[np.intp], noise: MeasurementNoise, parameters: KeyframeParameters
) -> dict[str, Any]:
    """A keyframe's fields from `points` on, by the superpixel [H, W] of each pixel of a frame, -1 = none."""
    variance = gray_variance(frame.gradient_squared, noise)
    measured = cv2.morphologyEx((frame.depth > 0).view(np.uint8), cv2.MORPH_CLOSE, _PINHOLE)
    core = cv2.erode(measured * (owner >= 0).view(np.uint8), _BOUNDARY, borderValue=0) > 0
    core[::2, ::2] = core[1::2, 1::2] = False
    points = surface_pixels(core, frame.depth, frame.intrinsics)
    v, u = points.pixel
    return {
        "points": points,
        "owner": owner[v, u],
        "gray": frame.gray[v, u],
        "variance": variance[v, u],
        "gradient_squared": frame.gradient_squared[v, u],
        "edges": edge_pixels(
            frame, owner, has_contrast(frame.gradient_squared, noise), variance, parameters.edge_pixels
        ),
    }


def _filled(height: NDArray[np.float32], inside: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Heights [H, W] without NaN: inside, that of the nearest pixel inside that has one, 0 elsewhere."""
    known = inside & np.isfinite(height)
    filled = np.nan_to_num(height)
    if known.any():
        nearest, _ = nearest_values(height, known)
        filled = np.where(inside & ~known, nearest, filled)
    return filled
