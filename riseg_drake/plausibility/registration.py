"""Depth against colour: whether edges of the one lie where the other has them, and run as they do."""

from collections.abc import Sequence
from dataclasses import dataclass

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
_STRONG = 0.95
"""Quantile of the gradients of an image; what is stronger counts no more than that."""
_PART, _FEWEST_PARTS = 20, 10
"""Pixels a side of the parts of an image that agree by chance each for itself, and how many must have edges: of
fewer some shift is always liked by all."""
_SMOOTH_COLOR, _SMOOTH_DEPTH = 1.0, 2.0
"""Pixels (standard deviation) over which the directions of edges are taken: those of depth are ragged."""


@dataclass(frozen=True)
class Shift:
    """By how much depth lies beside colour."""

    u: float
    """Pixels to the right by which depth must be shifted, and"""
    v: float
    """down: the middle of all shifts at which edges agree by more than half of what they do at best."""
    best: float
    """Agreement at the best shift, 0..1, and"""
    here: float
    """the best one near none."""


def edge_agreement(frames: Sequence[Frame]) -> NDArray[np.float64] | None:
    """Mean gradient of colour, 0..1, across edges of depth that are shifted by up to REACH to all sides.

    A gradient g counts by its part across the edge, (g . n)^2 / |g|: half of |g| where directions have nothing
    to do with each other. As cos^2 a = (1 + cos 2a) / 2, it is three correlations.

    [2 * rows + 1, 2 * columns + 1], no shift in the middle; None where depth has too few edges.
    """
    rows, columns = REACH
    total = np.zeros((2 * rows + 1, 2 * columns + 1))
    count = 0
    for frame in frames:
        edges = _edges(frame)
        count += edges.count
        for color, normal in zip(edges.color, edges.normals, strict=True):
            total += 0.5 * cv2.matchTemplate(color, normal, cv2.TM_CCORR)
    return total / count if count >= _FEWEST else None


def best_shift(agreement: NDArray, near: float) -> Shift:
    """Where edges agree best, and how well within `near` pixels of where they are.

    `agreement` [2 * rows + 1, 2 * columns + 1] is that of `edge_agreement`.
    """
    rows, columns = REACH
    dv, du = np.mgrid[-rows : rows + 1, -columns : columns + 1]
    best = float(agreement.max())
    # The edges of poor depth are smeared: agreement has a flat top then, whose middle tells more than its peak.
    above = agreement - (best + float(np.median(agreement))) / 2
    _, parts = cv2.connectedComponents((above > 0).astype(np.uint8))
    weight = np.where(parts == parts.flat[int(np.argmax(agreement))], np.maximum(above, 0), 0)
    weight /= max(float(weight.sum()), 1e-12)
    here = float(agreement[np.hypot(dv, du) <= near].max())
    return Shift(float((weight * du).sum()), float((weight * dv).sum()), best, here)


def gain_in_errors(frames: Sequence[Frame], agreement: NDArray, near: float) -> float:
    """By how many of its own standard errors edges agree better at the best shift than at the best one within
    `near` pixels.

    What a whole edge says is said by each of its pixels, and in each frame again: the parts of the image, over
    all frames, tell how far chance goes. 0 where edges lie in too few of them.

    `agreement` [2 * rows + 1, 2 * columns + 1] is that of `edge_agreement`.
    """
    rows, columns = REACH
    dv, du = np.mgrid[-rows : rows + 1, -columns : columns + 1]
    within = np.where(np.hypot(dv, du) <= near, agreement, -1)
    best, here = (divmod(int(np.argmax(values)), agreement.shape[1]) for values in (agreement, within))
    gains = np.zeros(-(-np.array(frames[0].depth.shape) // _PART))
    for frame in frames:
        edges = _edges(frame)
        gain = edges.agreement(*best) - edges.agreement(*here)
        for v, u in np.ndindex(*gains.shape):
            gains[v, u] += gain[v * _PART : (v + 1) * _PART, u * _PART : (u + 1) * _PART].sum()
    if np.count_nonzero(gains) < _FEWEST_PARTS:
        return 0.0
    return float(gains.sum() / np.sqrt(np.square(gains).sum()))


def doubts_about_registration(frames: Sequence[Frame], pixels: float, limits: PlausibilityLimits) -> list[str]:
    """Whether depth lies beside colour, in one line or none; one pixel of `frames` is so many of the images."""
    agreement = edge_agreement(frames)
    if agreement is None:
        return []
    shift = best_shift(agreement, limits.shift)
    if np.hypot(shift.u, shift.v) <= limits.shift or shift.best < limits.shift_gain * shift.here:
        return []
    if gain_in_errors(frames, agreement, limits.shift) < limits.shift_errors:
        return []
    return [
        "depth lies beside colour: its edges agree better with those of colour if it is shifted "
        f"by ({pixels * shift.u:+.0f}, {pixels * shift.v:+.0f}) pixels (right, down), {shift.best:.2f} against "
        f"{shift.here:.2f}; depth must be aligned to colour"
    ]


@dataclass(frozen=True)
class _Edges:
    """Edges of depth, and gradients of colour, of one frame."""

    count: int
    """Pixels on edges of depth."""
    normals: list[NDArray[np.float32]]
    """1, cos 2a, sin 2a [H, W] of the edges' directions; 0 where there is none."""
    color: list[NDArray[np.float32]]
    """The same of colour, times how strong it is; wider by REACH on all sides."""

    def agreement(self, row: int, column: int) -> NDArray[np.float32]:
        """[H, W]: what each pixel of an edge adds at one of the shifts, as `edge_agreement` counts them."""
        height, width = self.normals[0].shape
        there = [color[row : row + height, column : column + width] for color in self.color]
        return np.float32(0.5) * np.sum(np.multiply(self.normals, there), axis=0)


def _edges(frame: Frame) -> _Edges:
    rows, columns = REACH
    edges = _depth_edges(frame)
    depth = np.where(frame.depth > 0, frame.depth, frame.depth.max())
    across = _doubled_angle(*_gradient(depth.astype(np.float32), _SMOOTH_DEPTH))
    gray = cv2.cvtColor(frame.color, cv2.COLOR_RGB2GRAY).astype(np.float32)
    x, y = _gradient(gray, _SMOOTH_COLOR)
    strength = np.hypot(x, y)
    strength = np.minimum(strength / max(float(np.quantile(strength, _STRONG)), 1e-3), 1.0)
    strength[frame.robot] = 0
    return _Edges(
        int(np.count_nonzero(edges)),
        [np.where(edges, normal, np.float32(0)) for normal in across],
        [
            cv2.copyMakeBorder(strength * direction, rows, rows, columns, columns, cv2.BORDER_REFLECT_101)
            for direction in _doubled_angle(x, y)
        ],
    )


def _gradient(image: NDArray[np.float32], smooth: float) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """To the right and down, units a pixel."""
    image = cv2.GaussianBlur(image, (0, 0), smooth)
    return cv2.Sobel(image, cv2.CV_32F, 1, 0, scale=1 / 8), cv2.Sobel(image, cv2.CV_32F, 0, 1, scale=1 / 8)


def _doubled_angle(x: NDArray[np.float32], y: NDArray[np.float32]) -> tuple[NDArray, NDArray, NDArray]:
    """1, cos 2a and sin 2a of the directions of gradients: the same for both senses of one direction."""
    squared = np.maximum(x * x + y * y, np.float32(1e-12))
    return np.ones_like(x), (x * x - y * y) / squared, 2 * x * y / squared


def _depth_edges(frame: Frame) -> NDArray[np.bool_]:
    """[H, W]: the last pixels of what is in front, beside a step or the shadow of one."""
    z = frame.depth
    step = np.maximum(_STEP, _STEP_SHARE * z)
    front = (z > 0) & (cv2.dilate(z, _AROUND) - z > step)
    near = np.ones((3, 3), np.uint8)
    beside = (cv2.dilate(z, near) - z > step) | (cv2.erode(z, near) == 0)
    return front & beside & ~(cv2.dilate(frame.robot.astype(np.uint8), _AROUND) > 0)
