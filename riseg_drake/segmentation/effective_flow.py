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
from riseg_drake.segmentation.noise import MeasurementNoise, gray_variance, smooth_gray

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
    area_min: float = 1.0e-4
    """m^2; where less than that moves, nothing does."""


def effective_flow(optical_flow: NDArray, expected_flow: NDArray) -> NDArray:
    """X_t = O_t - E_t [H, W, 2], pixels; NaN where E_t is."""
    return optical_flow - expected_flow


def moving_pixels(
    pair: FramePair,
    expected_flow: NDArray[np.float32],
    optical_flow: NDArray[np.float32],
    above_0: NDArray[np.bool_],
    noise: MeasurementNoise,
    parameters: MovingParameters,
) -> NDArray[np.bool_]:
    """||X_t|| >> 0 [H, W]: what moves of its own, in the view of t-1."""
    moving = np.zeros_like(above_0)
    if not above_0.any():
        return moving
    depth = pair.reference.depth[above_0]
    pixels_per_metre = pair.current.intrinsics.fx / max(float(np.median(depth)), 1e-3)
    pixels_min = parameters.area_min * pixels_per_metre**2
    window = 2 * max(1, round(0.5 * parameters.window * pixels_per_metre)) + 1

    flow_min = max(parameters.flow_min, parameters.residual_multiple * pair.residual)
    region = bounding_region(above_0, margin=window)
    X_t = effective_flow(optical_flow[region], expected_flow[region])
    with np.errstate(invalid="ignore"):
        candidate = above_0[region] & (X_t[..., 0] ** 2 + X_t[..., 1] ** 2 > flow_min**2)
    if np.count_nonzero(candidate) < pixels_min:
        return moving
    evidence = zero_motion_evidence(pair, expected_flow, optical_flow, region, noise, window)
    candidate &= evidence > parameters.evidence_min
    if np.count_nonzero(candidate) >= pixels_min:
        moving[region] = candidate
    return moving


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
    I_0, I_1 = smooth_gray(pair.reference.color[region]), smooth_gray(pair.current.color)
    variance = gray_variance(I_0, noise)
    uv = pixel_grid(*pair.current.intrinsics.shape)[region]
    robot_1 = pair.current.robot.astype(np.uint8)
    worse, hidden = np.zeros_like(I_0), np.zeros(I_0.shape, bool)
    for sign, flow in ((1.0, np.nan_to_num(expected_flow[region])), (-1.0, optical_flow[region])):
        warped = cv2.remap(I_1, uv + flow, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        worse += np.float32(sign) * np.minimum((warped - I_0) ** 2 / variance, _COST_MAX)
        hidden |= cv2.remap(robot_1, uv + flow, None, cv2.INTER_NEAREST) > 0
    # Behind the robot nothing can be compared, and flow invents something that fits.
    worse[hidden] = 0
    return cv2.boxFilter(worse, -1, (window, window))
