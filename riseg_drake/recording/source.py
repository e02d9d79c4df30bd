"""What every source of recorded frames has in common, whatever it was written by."""

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.geometry.rgbd import unlikely_median
from riseg_drake.recording.layout import LeftOut, RecordedFrame
from riseg_drake.recording.stamped_lists import StampedTable

STAMP_LIMIT = 0.02
"""How far the stamps of what belongs together may lie apart, s; the TUM tools' own value."""


@dataclass(frozen=True)
class SourceOptions:
    """What a person may say of a recording that it does not say itself."""

    stamp_limit: float = STAMP_LIMIT
    """How far apart in time what belongs together may be, s."""
    follow: bool = False
    """Whether links may lead out of a folder."""
    rate: float | None = None
    """Images a second of a folder whose images have numbers for names, Hz."""
    topics: Mapping[str, str] = field(default_factory=dict)
    """Topics of a bag, or folders of a folder, by what they hold: color, depth and so on."""
    world_frame: str | None = None
    """The frame of a bag's transforms in which camera poses are given; the topmost if None."""
    robot: bool = False
    """Whether a robot is named that the joint angles of a bag belong to."""


class RecordedSource(ABC):
    """Frames of a recording, one after the other; only what is small is held in memory.

    What cannot be used is left out and noted in `left_out`, what is possible but odd in `warnings`; both may
    grow while frames are read.
    """

    path: Path
    """What was opened."""
    intrinsics: Intrinsics
    """Of the frames that come out."""
    depth_scale: float
    """Units of depth in a metre, as the source keeps them."""
    camera_poses: str | None
    """What the camera's poses are from; None if it stands still."""
    joints: StampedTable | None
    """The joint angles, None without any."""
    left_out: list[LeftOut]
    warnings: list[str]
    scale_is_asked: bool = False
    """Whether somebody else asks before the work whether depth is likely, and reading need not."""

    @abstractmethod
    def __len__(self) -> int:
        """How many frames there are to read; those that turn out to be damaged are among them."""

    @abstractmethod
    def __iter__(self) -> Iterator[RecordedFrame]:
        """Read from the beginning."""

    @abstractmethod
    def leave_out(self, frame: RecordedFrame, why: str) -> None:
        """Note that a frame was passed over."""

    @abstractmethod
    def times(self) -> list[float]:
        """Of all frames, s."""

    @property
    def rate(self) -> float:
        """Frames a second, by the median; 1 for a single frame."""
        times = self.times()
        return float(1 / np.median(np.diff(times))) if len(times) > 1 else 1.0

    def holds_images(self, folder: str) -> bool:
        """Whether `robot` or `label` is there and holds something."""
        return False

    def images_beside(self, folder: str) -> int:
        """How many frames have an image of their own in `robot` or `label`."""
        return 0

    def _look_at_scale(self, depth: NDArray[np.float32], file: Path | str) -> None:
        """Warn of a depth [H, W], m, that is unlikely on the whole; `file` says what it is measured in."""
        median = None if self.scale_is_asked else unlikely_median(depth)
        if median is not None:
            self.warnings.append(
                f"{file}: the median depth is {median:.3g} m, which is unlikely; "
                f'is "depth_scale" (units per metre) right?'
            )
