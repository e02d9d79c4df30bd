"""Frames with masks that any writer can be given: noise in every image, ids far apart, holes in depth."""

import numpy as np

from riseg_drake.export.segmented_frame import SegmentedFrame
from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.geometry.se3 import exp_se3

CAMERA = Intrinsics(64, 48, 61.25, 60.75, 31.5, 23.25)
NOTHING, TWO = 1, 2
"""Numbers of a frame that shows no object, and of one in which id 300 is in two pieces."""


def frame(number: int) -> SegmentedFrame:
    rng = np.random.default_rng(number)
    mask = np.zeros(CAMERA.shape, np.uint16)
    if number != NOTHING:
        mask[5:20, 10 + number : 30] = 2
        mask[30:40, 40:55] = 300
        mask[33:36, 44:48] = 0
    if number == TWO:
        mask[0:3, 0:4] = 300
    depth = rng.integers(400, 900, CAMERA.shape).astype(np.float32) / 1000
    depth[rng.random(CAMERA.shape) < 0.1] = 0
    return SegmentedFrame(
        number=number,
        time=1.5 + number / 15,
        name=f"rgb/film {number}.png",
        intrinsics=CAMERA,
        color=rng.integers(0, 256, (*CAMERA.shape, 3), np.uint8),
        depth=depth,
        X_WC=exp_se3(np.array([3.0, 0.2, -0.1, 0.3, 0.1 * number, 0.5])),
        mask=mask,
        confidence={2: 0.875, 300: 0.5},
    )


FRAMES = [frame(k) for k in range(4)]
