"""Alg. 2, line 3: X_t = O_t - E_t, and the pixels where it is more than noise.

Flow on a blank surface is invented, so its length alone proves nothing. A pixel moves if it stands
above the table, its effective flow is long enough, and the images agree: standing still explains them
clearly worse than the observed flow does (the zero-motion test).
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.camera import Region, bounding_region, pixel_grid
from riseg_drake.geometry.rgbd import FramePair
from riseg_drake.segmentation.above_table import AboveTable
from riseg_drake.segmentation.noise import MeasurementNoise, gray_variance
from riseg_drake.segmentation.scales import SMALLEST_SEEN

_COST_MAX = np.float32(25)
"""Squared normalised residuals count no more than that."""


@dataclass
class MovingParameters:
    """The paper's ||X_t|| >> 0, made a test."""

    flow_min: float = 0.8
    """Pixels; shorter effective flow is noise."""
    residual_multiple: float = 4.0
    """What is shorter than so many standard deviations of the flow of what stands still is noise, too."""
    evidence_min: float = 0.7
    """By how much standing still must explain the images worse, in squared normalised residuals."""
    window: float = 0.006
    """m on the object over which that evidence is averaged."""
    area_min: float = SMALLEST_SEEN
    """m^2; where less than that moves, nothing does."""


def effective_flow(optical_flow: NDArray, expected_flow: NDArray) -> NDArray:
    """X_t = O_t - E_t [H, W, 2], pixels; NaN where E_t is."""
    return optical_flow - expected_flow


def moving_pixels(
    pair: FramePair,
    expected_flow: NDArray[np.float32],
    optical_flow: NDArray[np.float32],
    above_0: AboveTable,
    noise: MeasurementNoise,
    parameters: MovingParameters,
) -> NDArray[np.bool_]:
    """||X_t|| >> 0 [H, W]: what moves of its own, in the view of t-1."""
    moving = np.zeros_like(above_0.mask)
    if not above_0.mask.any():
        return moving
    pixels_per_metre = above_0.pixels_per_metre(pair.reference.intrinsics)
    pixels_min = parameters.area_min * pixels_per_metre**2
    window = 2 * max(1, round(0.5 * parameters.window * pixels_per_metre)) + 1

    flow_min = max(parameters.flow_min, parameters.residual_multiple * pair.residual)
    region = bounding_region(above_0.mask)
    X_t = effective_flow(optical_flow[region], expected_flow[region])
    with np.errstate(invalid="ignore"):
        moving[region] = above_0.mask[region] & (X_t[..., 0] ** 2 + X_t[..., 1] ** 2 > flow_min**2)
    if np.count_nonzero(moving) >= pixels_min:
        region = bounding_region(moving, margin=window)
        evidence = zero_motion_evidence(pair, expected_flow, optical_flow, region, noise, window)
        moving[region] &= evidence > parameters.evidence_min
    return moving if np.count_nonzero(moving) >= pixels_min else np.zeros_like(moving)


def zero_motion_evidence(
    pair: FramePair,
    expected_flow: NDArray[np.float32],
    optical_flow: NDArray[np.float32],
    region: Region,
    noise: MeasurementNoise,
    window: int,
) -> NDArray[np.float32]:
    """How much worse E_t explains the two images than O_t does, averaged over a window of pixels.

    The difference of the squared gray residuals over their variance, [h, w] of a region: about 0 where
    nothing moves, or where there is no texture to tell.
    """
    # Every other row and column will do for a mean over a window.
    half = (slice(None, None, 2), slice(None, None, 2))
    I_0, I_1 = pair.reference.gray[region][half], pair.current.unhidden_gray
    per_variance = 1 / gray_variance(pair.reference.gradient_squared[region][half], noise)
    uv = pixel_grid(*pair.current.intrinsics.shape)[region][half]
    E_t, O_t = expected_flow[region][half], optical_flow[region][half]
    costs = []
    for flow in (E_t, O_t):
        residual = cv2.remap(I_1, uv + flow, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        residual -= I_0
        residual *= residual
        residual *= per_variance
        costs.append(np.minimum(residual, _COST_MAX))
    worse = costs[0] - costs[1]
    # Behind the robot nothing can be compared, and flow invents something that fits.
    worse[np.isnan(worse) | np.isnan(E_t[..., 0])] = 0
    mean = cv2.boxFilter(worse, -1, (window // 2 | 1,) * 2)
    height, width = per_variance.shape
    whole = cv2.resize(mean, (2 * width, 2 * height), interpolation=cv2.INTER_NEAREST)
    return whole[: region[0].stop - region[0].start, : region[1].stop - region[1].start]
