"""Does anything move? Seen from one frame to the next, of the camera and of what it looks at."""

from dataclasses import dataclass, replace

import numpy as np

from riseg_drake.geometry.rgbd import Frame
from riseg_drake.segmentation.above_table import AboveTable
from riseg_drake.segmentation.frame_pairs import camera_span
from riseg_drake.segmentation.noise import MeasurementNoise, gray_variance


@dataclass
class RestParameters:
    """When a scene is at rest."""

    time: float = 0.1
    """s without any change after which it is."""
    camera_span: float = 1.0
    """Pixels that the camera may move from one frame to the next: joint angles carry noise."""
    sigmas: float = 3.0
    """Standard deviations of the difference of two gray values from which a pixel has changed."""
    share: float = 0.004
    """Of what stands on the table, so much may change."""


def is_still(
    before: Frame, frame: Frame, above: AboveTable, noise: MeasurementNoise, parameters: RestParameters
) -> bool:
    """Whether two frames, one after the other, show the same."""
    span = camera_span(before, frame)
    if span > parameters.camera_span:
        return False
    looked_at = above.mask & ~frame.robot & ~before.robot
    if not looked_at.any():
        return True
    # What the camera's own last creeping does to the image is no motion of things.
    variance = gray_variance(before.gray, replace(noise, registration=noise.registration + span))
    squared = (frame.gray - before.gray)[looked_at] ** 2
    return bool(np.mean(squared > parameters.sigmas**2 * variance[looked_at]) < parameters.share)
