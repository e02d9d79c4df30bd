"""How well the pose of a camera that is fixed to the world is known: the arm as drawn against the arm as seen.

Such a camera sees no flow of its own, but it sees the arm. From joint angles and X_WC follows where the arm
should be in the picture; from depth, against a picture without it, where it is. How far the one must be shifted
to lie on the other is the error of X_WC, intrinsics and latency together, at the arm's distance.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.rgbd import Frame

GOOD, USABLE = 2.0, 4.0
"""Up to so many pixels (median) the pose is good, or still usable. At 0.75 m a pixel is 1.2 mm, and masks leave
5 pixels around the drawn arm (3, and 3 mm on the arm)."""
NEARER, NEARER_SHARE = 0.03, 0.02
"""What is nearer than the scene without the arm by this much, m, and this share of its distance, is the arm."""
LEAST = 0.004
"""Share of the picture that the drawn arm must take up to be compared."""
REACH = 40
"""Shifts are looked for up to so many pixels."""
PLATEAU = 0.998
"""Shifts of almost the best overlap count as the best: depth ends a little within the arm's outline all
around."""

DRAWN, SEEN = (40, 90, 220), (240, 130, 20)
"""Colours of the outlines: blue and orange."""


@dataclass(frozen=True)
class OutlineError:
    """What lies between the arm as drawn and as seen in one picture."""

    frame: Frame
    """`robot` is the arm as drawn."""
    seen: NDArray[np.bool_]
    """[H, W]"""
    shift: NDArray[np.float64]
    """[2], pixels from where it is drawn to where it is seen."""

    @property
    def size(self) -> float:
        """Pixels."""
        return float(np.linalg.norm(self.shift))


def outline_errors(frames: Sequence[Frame]) -> list[OutlineError]:
    """Of every frame after the first, which shows the scene without the arm, where the arm can be compared."""
    errors = []
    for frame in frames[1:]:
        hidden = frames[0].robot  # what the first cannot tell of
        drawn, seen = frame.robot & ~hidden, seen_arm(frames[0], frame)
        least = LEAST * drawn.size
        if np.count_nonzero(drawn) >= least and np.count_nonzero(seen) >= least / 2:
            errors.append(OutlineError(frame, seen, shift_between(drawn, seen)))
    return errors


def seen_arm(without: Frame, frame: Frame) -> NDArray[np.bool_]:
    """Pixels [H, W] where something stands nearer than the scene without the arm had it."""
    before, now = without.depth, frame.depth
    nearer = before - now > NEARER + NEARER_SHARE * before
    seen = nearer & (before > 0) & (now > 0) & ~without.robot
    return cv2.morphologyEx(seen.astype(np.uint8), cv2.MORPH_OPEN, np.ones((5, 5), np.uint8)) > 0


def shift_between(drawn: NDArray[np.bool_], seen: NDArray[np.bool_]) -> NDArray[np.float64]:
    """By how many pixels [2] the drawn area must be shifted to cover the most of the seen one.

    Where several cover almost the same, the middle of them.
    """
    # Beyond the picture's edge neither is known: the drawn arm is compared where it stays inside for any shift.
    inner = drawn[REACH:-REACH, REACH:-REACH].astype(np.float32)
    # What is seen beside the drawn arm speaks as much against a shift as what is missing speaks for it.
    overlap = cv2.matchTemplate(2 * seen.astype(np.float32) - 1, 2 * inner - 1, cv2.TM_CCORR)
    best = float(overlap.max())
    v, u = np.nonzero(overlap >= best - (1 - PLATEAU) * inner.sum())
    return np.array([float(u.mean()), float(v.mean())]) - float(REACH)


def outline_verdict(errors: Sequence[OutlineError]) -> tuple[float, str]:
    """The median error, pixels, and what to do."""
    median = float(np.median([error.size for error in errors]))
    if median <= GOOD:
        return median, "good"
    if median <= USABLE:
        return median, "usable; a better X_WC makes better masks and pushes"
    return median, "bad: calibrate X_WC, and check latency and intrinsics, before any push"


def draw_outline_error(error: OutlineError) -> NDArray[np.uint8]:
    """The picture [H, W, 3] with both outlines."""
    picture = error.frame.color.copy()
    for area, color, width in ((error.frame.robot, DRAWN, 3), (error.seen, SEEN, 1)):
        outlines, _ = cv2.findContours(area.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        cv2.drawContours(picture, outlines, -1, color, width)
    return picture
