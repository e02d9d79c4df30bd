"""What the algorithm sees at one moment: I_t with the kinematics that belong to it."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import cv2
import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.camera import Intrinsics

LIKELY_DEPTH = (0.1, 10.0)
"""m; a median depth outside most often means a wrong depth_scale."""


class Immutable:
    """Base of values that nobody changes once they are made, so that a copy may be the thing itself.

    Drake copies the abstract state at every unrestricted update; images should not be copied with it. And
    what stands for nothing (NO_FRAME and the like) is told by `is`, through whatever ports it went.
    """

    def __deepcopy__(self, memo: dict) -> Self:
        """The same value."""
        return self


@dataclass(frozen=True)
class Frame(Immutable):
    """The RGB-D image I_t, and what theta_t says of the same moment.

    Nobody writes into the arrays of a frame: several stages share them.
    """

    sequence: int
    """Counts the frames of one run from 0."""
    time: float
    """When the image was taken, s."""
    intrinsics: Intrinsics
    color: NDArray[np.uint8]
    """[H, W, 3], RGB."""
    depth: NDArray[np.float32]
    """[H, W], metres, 0 = invalid."""
    X_WC: NDArray[np.float64]
    """Pose of the camera, [4, 4], by forward kinematics from theta_t (or as recorded)."""
    robot: NDArray[np.bool_]
    """[H, W], the pixels that the robot itself covers."""
    gain: float = 1.0
    """What gray values are multiplied with, so that frames of different exposure can be compared."""
    source: "Frame | None" = None
    """What this was reduced from, as it came from the camera; None if it is that."""

    @property
    def whole(self) -> "Frame":
        """The frame in all pixels that the camera gave; itself if it was not reduced."""
        return self if self.source is None else self._whole

    @cached_property
    def _whole(self) -> "Frame":
        # Kept only where it is another frame: one that keeps itself would not be freed when it is dropped.
        assert self.source is not None
        return replace(self.source, sequence=self.sequence, time=self.time, X_WC=self.X_WC, gain=self.gain)

    @property
    def reduction(self) -> int:
        """Pixels of the whole frame to one of this, along a row."""
        return self.whole.intrinsics.width // self.intrinsics.width

    @cached_property
    def gray(self) -> NDArray[np.float32]:
        """Gray values [H, W], 0..255 times the gain, as `smooth_gray` makes them; worked out once for all
        stages."""
        gray = smooth_gray(self.color)
        return gray if self.gain == 1 else gray * np.float32(self.gain)

    @cached_property
    def unhidden_gray(self) -> NDArray[np.float32]:
        """The same [H, W] with NaN where the robot is in the way."""
        return np.where(self.robot, np.float32(np.nan), self.gray)

    @cached_property
    def gradient_squared(self) -> NDArray[np.float32]:
        """Of the gray values [H, W], squared gray levels a squared pixel."""
        return cv2.Sobel(self.gray, cv2.CV_32F, 1, 0, scale=0.125) ** 2 + (
            cv2.Sobel(self.gray, cv2.CV_32F, 0, 1, scale=0.125) ** 2
        )

    @cached_property
    def unhidden_depth(self) -> NDArray[np.float32]:
        """Depth [H, W], m, with 0 (invalid) where the robot is in the way."""
        return np.where(self.robot, np.float32(0), self.depth)

    @cached_property
    def typical_depth(self) -> float:
        """Median of every so many-th pixel's depth, m; 1 where there is none."""
        some = self.depth[:: max(1, self.depth.shape[0] // 24), :: max(1, self.depth.shape[1] // 24)]
        return float(np.median(some[some > 0])) if (some > 0).any() else 1.0


NO_FRAME = Frame(
    sequence=-1,
    time=-np.inf,
    intrinsics=Intrinsics(width=0, height=0, fx=1.0, fy=1.0, cx=0.0, cy=0.0),
    color=np.zeros((0, 0, 3), np.uint8),
    depth=np.zeros((0, 0), np.float32),
    X_WC=np.eye(4),
    robot=np.zeros((0, 0), bool),
)
"""What there is before the first image: no pixels, older than any frame."""
NO_MASK = np.zeros((0, 0), np.uint16)
"""The mask of no pixels."""


@dataclass(frozen=True)
class FramePair(Immutable):
    """(I_t-1, I_t) with their kinematics; `reference` is the paper's t-1, `current` its t."""

    reference: Frame
    current: Frame
    residual: float = 0.0
    """Standard deviation of O_t - E_t where nothing moves, pixels, as far as it was measured."""
    given_residual: float = 0.0
    """The same by the poses as they came, pixels of the whole frame; 0 where that was not asked."""
    pose_error: float = 0.0
    """Pixels of the whole frame by which poses that are taken as they came may err; 0: they are exact."""
    span: float = 0.0
    """Effective flow that the reference and the frame before `current` turned out to span, pixels: so far
    had things moved."""

    @property
    def whole(self) -> "FramePair":
        """The same in all pixels that the camera gave; `residual` and `span` are still those of this pair."""
        if self.current.source is None:
            return self
        return replace(self, reference=self.reference.whole, current=self.current.whole)

    @property
    def X_C1C0(self) -> NDArray[np.float64]:
        """The paper's camT_{t-1,t}, [4, 4]: takes points of the camera at t-1 to the camera at t."""
        return np.linalg.inv(self.current.X_WC) @ self.reference.X_WC


_NEAREST, _FARTHEST = 1e-4, 1e3
"""m; of depth that is believed."""

NO_PAIR = FramePair(NO_FRAME, NO_FRAME)
"""What there is before the first frame."""


def smooth_gray(color: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Gray values [H, W], 0..255, of colours [H, W, 3], smoothed enough to be interpolated between pixels."""
    gray = cv2.cvtColor(color, cv2.COLOR_RGB2GRAY)
    return cv2.GaussianBlur(gray, (0, 0), 0.7).astype(np.float32)


def sanitize_depth(depth: NDArray) -> NDArray[np.float32]:
    """Depth [H, W] in metres as float32 with every spelling of "invalid" (NaN, inf, < 0) turned into 0.

    So is what no camera measures, nearer than 0.1 mm or farther than 1 km: squares and inverses of it would not
    be numbers.
    """
    with np.errstate(over="ignore"):
        depth = np.asarray(depth).astype(np.float32)
    return np.where((depth > _NEAREST) & (depth < _FARTHEST), depth, np.float32(0))


def unlikely_median(depth: NDArray[np.float32]) -> float | None:
    """The median of a depth image [H, W], m, 0 = invalid, where no table scene has it; None where it is likely,
    or there is no depth."""
    if not (depth > 0).any():
        return None
    median = float(np.median(depth[depth > 0]))
    return None if LIKELY_DEPTH[0] <= median <= LIKELY_DEPTH[1] else median
