"""What every export is made of: one RGB-D image with its mask."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.camera import Intrinsics


@dataclass(frozen=True)
class SegmentedFrame:
    """I_t with L_t."""

    number: int
    """Counts the frames from 0."""
    time: float
    """s"""
    name: str
    """The file of its colour image, relative to the recording."""
    intrinsics: Intrinsics
    color: NDArray[np.uint8]
    """[H, W, 3], RGB."""
    depth: NDArray[np.float32]
    """[H, W], metres, 0 = invalid."""
    X_WC: NDArray[np.float64]
    """The camera's pose, [4, 4]."""
    mask: NDArray[np.uint16]
    """[H, W], ids, 0 = background."""
    confidence: Mapping[int, float] = field(default_factory=dict)
    """Of each id the probability that it is one object and all of it."""

    @property
    def object_ids(self) -> list[int]:
        """Those that the mask shows, rising."""
        return [int(a) for a in np.unique(self.mask[self.mask > 0])]

    @property
    def stem(self) -> str:
        """The number in six digits, as most layouts name images."""
        return f"{self.number:06d}"


def camera_matrix(k: Intrinsics) -> NDArray[np.float64]:
    """K [3, 3], pixels."""
    return np.array([[k.fx, 0, k.cx], [0, k.fy, k.cy], [0, 0, 1]])


def bounding_box(mask: NDArray[np.bool_]) -> list[int]:
    """[x, y, width, height] of a mask [H, W] that is not empty, pixels."""
    rows, columns = np.flatnonzero(mask.any(1)), np.flatnonzero(mask.any(0))
    x, y = int(columns[0]), int(rows[0])
    return [x, y, int(columns[-1]) - x + 1, int(rows[-1]) - y + 1]
