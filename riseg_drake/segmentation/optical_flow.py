"""Alg. 2, line 2: the flow that the images themselves show.

Any method serves that follows the protocol `FlowMethod`; the paper uses RAFT and says that any other
may stand in. Dense inverse search (DIS, OpenCV) is the default here: it needs no weights and no GPU.
"""

from dataclasses import dataclass, field
from typing import Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.camera import bounding_region
from riseg_drake.geometry.rgbd import FramePair
from riseg_drake.segmentation.above_table import AboveTable
from riseg_drake.segmentation.expected_flow import pixel_projection

DIS_PRESETS = {
    "ultrafast": cv2.DISOPTICAL_FLOW_PRESET_ULTRAFAST,
    "fast": cv2.DISOPTICAL_FLOW_PRESET_FAST,
    "medium": cv2.DISOPTICAL_FLOW_PRESET_MEDIUM,
}

NO_FLOW = np.zeros((0, 0, 2), np.float32)
"""The flow of no pixels: E_t and O_t before the first pair."""

_MARGIN, _MARGIN_FAR = 0.03, 0.0625
"""Share of the image's width by which flow is worked out around what stands on the table: objects' own motion
from one frame of a pair to the other, and what a window covers. The second where a pair spans far: as long as
such a reference stays, and once more."""
_FAR = 0.0125
"""Share of the image's width that a pair spans from which on it spans far."""

_LEAST = 16
"""Pixels; of a narrower part of the image no method can tell flow, and some refuse it."""


class FlowMethod(Protocol):
    """What a flow method must do."""

    def __call__(self, color_0: NDArray[np.uint8], color_1: NDArray[np.uint8]) -> NDArray[np.float32]:
        """Flow O_t [H, W, 2] in pixels from image 0 to image 1, both [H, W, 3] RGB."""
        ...


def flow_around(above_0: AboveTable, pair: FramePair, method: FlowMethod) -> NDArray[np.float32]:
    """O_t [H, W, 2], pixels, where it is needed: in and around what stands on the table, NaN elsewhere.

    The method sees a part of each image: that of t lies where the camera's motion has moved that of
    t-1, to the whole pixel. What has moved must still be in it: what leaves the part has no flow, and what is
    made up in its place spans little, so that nothing would renew the reference.

    Args:
        above_0: what stands on the table, at t-1.
        pair: the frames of t-1 and t.
        method: any flow method.
    """
    height, width = above_0.mask.shape
    flow = np.full((height, width, 2), np.nan, np.float32)
    if not above_0.mask.any():
        return flow
    margin = _MARGIN if pair.span < _FAR * width else _MARGIN_FAR
    rows, columns = bounding_region(above_0.mask, margin=round(margin * width))
    u, v = 0.5 * (columns.start + columns.stop), 0.5 * (rows.start + rows.stop)
    M = pixel_projection(pair.X_C1C0, pair.reference.intrinsics)
    a, b, c = M @ np.array([u, v, 1.0, 1 / above_0.distance])
    du, dv = round(float(a / c - u)), round(float(b / c - v))
    rows, shifted_rows = _seen_in_both(rows, dv, height)
    columns, shifted_columns = _seen_in_both(columns, du, width)
    if min(rows.stop - rows.start, columns.stop - columns.start) >= _LEAST:
        images = pair.reference.color[rows, columns], pair.current.color[shifted_rows, shifted_columns]
        flow[rows, columns] = cv2.add(method(*images), (du, dv, 0, 0))
    return flow


def _seen_in_both(span: slice, shift: int, size: int) -> tuple[slice, slice]:
    """The part of some rows or columns that lies in an image of that size before and after a shift."""
    start, stop = max(span.start, -shift), min(span.stop, size, size - shift)
    return slice(start, stop), slice(start + shift, stop + shift)


@dataclass
class DisFlowParameters:
    """Dense inverse search (Kroeger et al. 2016), as OpenCV has it."""

    preset: str = field(default="medium", metadata={"choices": tuple(DIS_PRESETS)})
    """"ultrafast", "fast" or "medium": 2, 3 and 14 ms at 640x480 on two cores."""
    refinements: int = 2
    """Variational iterations on each scale. OpenCV's presets have 5; the last three move flow by 0.03 px."""


class DisFlow:
    """`FlowMethod` by OpenCV's dense inverse search on gray images. Deterministic."""

    def __init__(self, parameters: DisFlowParameters | None = None) -> None:
        """Prepare the method; ValueError for an unknown preset."""
        parameters = parameters or DisFlowParameters()
        preset = parameters.preset
        if preset not in DIS_PRESETS:
            raise ValueError(f"no DIS preset {preset!r}: choose one of {', '.join(DIS_PRESETS)}")
        self._dis = cv2.DISOpticalFlow_create(DIS_PRESETS[preset])
        self._dis.setVariationalRefinementIterations(parameters.refinements)

    def __call__(self, color_0: NDArray[np.uint8], color_1: NDArray[np.uint8]) -> NDArray[np.float32]:
        """Flow O_t [H, W, 2], pixels."""
        gray_0, gray_1 = (cv2.cvtColor(c, cv2.COLOR_RGB2GRAY) for c in (color_0, color_1))
        return self._dis.calc(gray_0, gray_1, None)
