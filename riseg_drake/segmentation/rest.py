"""Does anything move? Seen from one frame to the next, of the camera and of what it looks at."""

from dataclasses import dataclass, replace

import numpy as np

from riseg_drake.geometry.reduction import one_of_each
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
    """Pixels of the whole frame that the camera may move from one to the next: joint angles carry noise."""
    sigmas: float = 3.0
    """Standard deviations of the difference of two gray values from which a pixel has changed."""
    share: float = 0.004
    """Of what stands on the table, so much may change."""


def is_still(
    before: Frame, frame: Frame, above: AboveTable, noise: MeasurementNoise, parameters: RestParameters
) -> bool:
    """Whether two frames, one after the other, show the same.

    In all their pixels, of which a small motion changes more: of those that a pixel of a reduced frame covers
    one is looked at.
    """
    whole_0, whole_1 = before.whole, frame.whole
    span = camera_span(whole_0, whole_1)
    if span > parameters.camera_span:
        return False
    looked_at = above.mask & ~frame.robot & ~before.robot
    if not looked_at.any():
        return True
    gray_0, gray_1, gradient_squared = (
        one_of_each(image, frame.reduction)[looked_at]
        for image in (whole_0.gray, whole_1.gray, whole_0.gradient_squared)
    )
    # What the camera's own last creeping does to the image is no motion of things.
    variance = gray_variance(gradient_squared, replace(noise, registration=noise.registration + span))
    return bool(np.mean((gray_1 - gray_0) ** 2 > parameters.sigmas**2 * variance) < parameters.share)
