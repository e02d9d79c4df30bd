"""How well the camera's pose on the arm is known: expected against observed flow over a still scene.

Where nothing moves but the camera, the optical flow is the expected flow (paper, sec. IV-A), and what is left
between the two is the error of hand-eye pose, latency and intrinsics together, in the unit that counts.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.rgbd import Frame, FramePair
from riseg_drake.segmentation.expected_flow import expected_flow
from riseg_drake.segmentation.optical_flow import DisFlow

GOOD, USABLE = 1.0, 2.0
"""Up to so many pixels (median) the pose is good, or still usable; motions of objects are 2 to 20 pixels."""
SPAN = (4.0, 25.0)
"""A pair is looked at whose expected flow is this large, pixels (median)."""
TEXTURE = 8.0
"""Least gray-value gradient, 1/pixel, of a pixel at which optical flow is believed."""

EXPECTED, OBSERVED = (40, 90, 220), (240, 130, 20)
"""Colours of the arrows: blue and orange."""


@dataclass(frozen=True)
class FlowError:
    """What is left between expected and observed flow in one pair."""

    pair: FramePair
    expected: NDArray[np.float32]
    """[H, W, 2], pixels."""
    observed: NDArray[np.float32]
    """[H, W, 2], pixels."""
    usable: NDArray[np.bool_]
    """[H, W]: depth, texture, and no robot."""

    @property
    def size(self) -> NDArray[np.float32]:
        """|O - E| of the N usable pixels, [N], pixels."""
        return np.linalg.norm(self.observed - self.expected, axis=-1)[self.usable]

    @property
    def mean(self) -> NDArray[np.float64]:
        """Median of O - E over the usable pixels, [2], pixels: an error that all pixels share."""
        return np.median((self.observed - self.expected)[self.usable], axis=0)


def flow_errors(frames: Sequence[Frame]) -> list[FlowError]:
    """Pairs of frames far enough apart, one for each frame that has a partner, with their errors."""
    flow = DisFlow()
    errors = []
    for index, current in enumerate(frames):
        for reference in reversed(frames[:index]):
            pair = FramePair(reference, current)
            depth = reference.unhidden_depth
            expected = expected_flow(depth, pair.X_C1C0, current.intrinsics)
            known = depth > 0
            span = float(np.median(np.linalg.norm(expected[known], axis=-1))) if known.any() else 0.0
            if span < SPAN[0]:
                continue
            if span <= SPAN[1]:
                observed = flow(reference.color, current.color)
                errors.append(FlowError(pair, expected, observed, known & _textured(reference)))
            break
    return [error for error in errors if error.usable.sum() > 500]


def verdict(errors: Sequence[FlowError]) -> tuple[float, str]:
    """The median error over all pairs, pixels, and what to make of it."""
    median = float(np.median(np.concatenate([error.size for error in errors])))
    if median <= GOOD:
        return median, "good"
    if median <= USABLE:
        return median, "usable; a better hand-eye pose or latency would make masks sharper"
    return median, "bad: calibrate hand-eye pose X_EC, and check latency and intrinsics, before any push"


def draw_flow_error(error: FlowError, step: int = 32, scale: float = 2.0) -> NDArray[np.uint8]:
    """The picture [H, W, 3] with expected (blue) and observed (orange) flow as arrows `scale` times as long.

    Expected flow is drawn broad and observed flow thin upon it: where they agree both are seen.
    """
    picture = error.pair.reference.color.copy()
    height, width = error.usable.shape
    for v in range(step // 2, height, step):
        for u in range(step // 2, width, step):
            if not error.usable[v, u]:
                continue
            for flow, color, line in ((error.expected, EXPECTED, 6), (error.observed, OBSERVED, 2)):
                du, dv = scale * flow[v, u]
                tip = (round(u + du), round(v + dv))
                cv2.arrowedLine(picture, (u, v), tip, color, line, cv2.LINE_AA, tipLength=0.3)
    return picture


def _textured(frame: Frame) -> NDArray[np.bool_]:
    gray = cv2.cvtColor(frame.color, cv2.COLOR_RGB2GRAY).astype(np.float32)
    gradient = np.hypot(
        cv2.Sobel(gray, cv2.CV_32F, 1, 0, scale=0.125), cv2.Sobel(gray, cv2.CV_32F, 0, 1, scale=0.125)
    )
    return gradient > TEXTURE
