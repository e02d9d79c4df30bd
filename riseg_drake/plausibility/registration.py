"""Depth against colour: whether edges of the one lie where the other has them."""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.rgbd import Frame
from riseg_drake.plausibility.limits import PlausibilityLimits

REACH = (6, 20)
"""Rows and columns by which depth is shifted."""
_STEP, _STEP_SHARE = 0.012, 0.03
"""m, and share of depth: a step of depth is larger than both."""
_AROUND = np.ones((11, 11), np.uint8)
"""How wide a shadow beside a step may be, in which a camera has no depth."""
_FEWEST = 100
"""Pixels on edges of depth, over all frames, to say anything."""


def edge_agreement(frames: Sequence[Frame]) -> NDArray[np.float64] | None:
    """Mean gradient of colour, 0..1, at edges of depth that are shifted by up to REACH to all sides.

    [2 * rows + 1, 2 * columns + 1], no shift in the middle; None where depth has too few edges.
    """
    rows, columns = REACH
    total = np.zeros((2 * rows + 1, 2 * columns + 1))
    count = 0
    for frame in frames:
        v, u = np.nonzero(_depth_edges(frame))
        gradient = np.sqrt(frame.gradient_squared)
        gradient = np.minimum(gradient / max(float(np.quantile(gradient, 0.95)), 1e-3), 1.0)
        gradient[frame.robot] = 0
        around = cv2.copyMakeBorder(gradient, rows, rows, columns, columns, cv2.BORDER_REFLECT_101)
        for i, j in np.ndindex(total.shape):
            total[i, j] += around[v + i, u + j].sum()
        count += len(v)
    return total / count if count >= _FEWEST else None


def doubts_about_registration(frames: Sequence[Frame], pixels: float, limits: PlausibilityLimits) -> list[str]:
    """Whether depth lies beside colour, in one line or none; one pixel of `frames` is so many of the images."""
    agreement = edge_agreement(frames)
    if agreement is None:
        return []
    rows, columns = REACH
    dv, du = np.mgrid[-rows : rows + 1, -columns : columns + 1]
    beside = np.hypot(dv, du) > limits.shift
    i, j = np.unravel_index(np.argmax(agreement), agreement.shape)
    here, best = float(agreement[~beside].max()), float(agreement[i, j])
    if best < limits.shift_gain * here:
        return []
    u, v = pixels * float(du[i, j]), pixels * float(dv[i, j])
    return [
        "depth lies beside colour: its edges agree better with those of colour if it is shifted "
        f"by ({u:+.0f}, {v:+.0f}) pixels (right, down), {best:.2f} against {here:.2f}; depth must "
        "be aligned to colour"
    ]


def _depth_edges(frame: Frame) -> NDArray[np.bool_]:
    """[H, W]: the last pixels of what is in front, beside a step or the shadow of one."""
    z = frame.depth
    step = np.maximum(_STEP, _STEP_SHARE * z)
    front = (z > 0) & (cv2.dilate(z, _AROUND) - z > step)
    near = np.ones((3, 3), np.uint8)
    beside = (cv2.dilate(z, near) - z > step) | (cv2.erode(z, near) == 0)
    return front & beside & ~(cv2.dilate(frame.robot.astype(np.uint8), _AROUND) > 0)
