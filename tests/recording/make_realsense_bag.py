"""Makes realsense_2_56.bag, where `pip install pyrealsense2==2.56.5.9235` has put the last that writes .bag."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.geometry.se3 import exp_se3
from tests.recording.made_realsense import RealSenseKind, record

BAG = Path(__file__).with_name("realsense_2_56.bag")
COLOR = Intrinsics(64, 48, 62.25, 62.5, 33.125, 22.875)
DEPTH = Intrinsics(80, 48, 60.5, 60.75, 40.25, 23.625)
X_CD = exp_se3(np.array([0.01, -0.02, 0.03, 0.015, 0.002, -0.001]))
FRAMES = 3


def patterns() -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Frames in whole numbers, so that they are the same on every machine; depth in units of 0.1 mm."""
    for k in range(FRAMES):
        v, u = np.mgrid[:48, :64]
        color = np.stack([3 * u + 10 * k, 5 * v, u ^ v], axis=-1).astype(np.uint8)
        v, u = np.mgrid[:48, :80]
        yield color, (5000 + 8 * u - 4 * v + k).astype(np.uint16)


if __name__ == "__main__":
    record(BAG, RealSenseKind(COLOR, DEPTH, X_CD, unit=0.0001), patterns())
