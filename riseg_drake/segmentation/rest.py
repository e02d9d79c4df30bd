"""Does anything move? Seen from one frame to the next, of the camera and of what it looks at."""

from dataclasses import dataclass

import numpy as np

from riseg_drake.geometry.rgbd import Frame
from riseg_drake.segmentation.above_table import AboveTable
from riseg_drake.segmentation.frame_pairs import camera_span
from riseg_drake.segmentation.noise import MeasurementNoise


@dataclass
class RestParameters:
    """When a scene is at rest."""

    time: float = 0.1
    """s without any change after which it is."""
    camera_span: float = 1.0
    """Pixels that the camera may move from one frame to the next: joint angles carry noise."""
    sigmas: float = 6.0
    """Standard deviations of gray values' noise from which a pixel has changed."""
    share: float = 0.004
    """Of what stands on the table, so much may change."""


def is_still(
    before: Frame, frame: Frame, above: AboveTable, noise: MeasurementNoise, parameters: RestParameters
) -> bool:
    """Whether two frames, one after the other, show the same."""
    if camera_span(before, frame) > parameters.camera_span:
        return False
    looked_at = above.mask & ~frame.robot & ~before.robot
    if not looked_at.any():
        return True
    difference = np.abs(frame.gray[looked_at] - before.gray[looked_at])
    return bool(np.mean(difference > parameters.sigmas * noise.color) < parameters.share)
