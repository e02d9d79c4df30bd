"""Alg. 2, line 3: X_t = O_t - E_t, and the pixels where it is more than noise.

Flow on a blank surface is invented, so its length alone proves nothing. A pixel moves if it stands
above the table, its effective flow is long enough, and the images agree: standing still explains them
clearly worse than the observed flow does (the zero-motion test).
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.camera import pixel_grid
from riseg_drake.geometry.rgbd import FramePair
from riseg_drake.segmentation.noise import MeasurementNoise


@dataclass
class MovingParameters:
    """The paper's ||X_t|| >> 0, made a test."""

    flow_min: float = 0.8
    """Pixels; shorter effective flow is noise."""
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
    X_t = effective_flow(optical_flow, expected_flow)
    with np.errstate(invalid="ignore"):
        moving = above_0 & ((X_t**2).sum(-1) > parameters.flow_min**2)
    pixels_per_metre = _pixels_per_metre(pair, above_0)
    pixels_min = parameters.area_min * pixels_per_metre**2
    if np.count_nonzero(moving) < pixels_min:
        return np.zeros_like(moving)
    size = 2 * max(1, round(0.5 * parameters.window * pixels_per_metre)) + 1
    evidence = zero_motion_evidence(pair, expected_flow, optical_flow, noise, size)
    moving &= evidence > parameters.evidence_min
    if np.count_nonzero(moving) < pixels_min:
        return np.zeros_like(moving)
    return moving


def zero_motion_evidence(
    pair: FramePair,
    expected_flow: NDArray[np.float32],
    optical_flow: NDArray[np.float32],
    noise: MeasurementNoise,
    window: int,
) -> NDArray[np.float32]:
    """How much worse E_t explains the two images than O_t does, [H, W], averaged over a window.

    The difference of the squared gray residuals over their variance: about 0 where nothing moves, or
    where there is no texture to tell; negative never means anything.
    """
    I_0, I_1 = (
        cv2.GaussianBlur(cv2.cvtColor(c, cv2.COLOR_RGB2GRAY), (0, 0), 0.7).astype(np.float32)
        for c in (pair.reference.color, pair.current.color)
    )
    gradient_squared = cv2.Sobel(I_0, cv2.CV_32F, 1, 0, scale=0.125) ** 2
    gradient_squared += cv2.Sobel(I_0, cv2.CV_32F, 0, 1, scale=0.125) ** 2
    variance = 2 * noise.color**2 + noise.registration**2 * gradient_squared
    uv = pixel_grid(*I_0.shape)
    worse = np.zeros_like(I_0)
    for sign, flow in ((1.0, np.nan_to_num(expected_flow)), (-1.0, optical_flow)):
        warped = cv2.remap(I_1, uv + flow, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        worse += np.float32(sign) * np.minimum((warped - I_0) ** 2 / variance, 25.0)
    return cv2.boxFilter(worse, -1, (window, window))


def _pixels_per_metre(pair: FramePair, above_0: NDArray[np.bool_]) -> float:
    depth = pair.reference.depth[above_0]
    depth = depth[depth > 0]
    return pair.current.intrinsics.fx / float(np.median(depth)) if len(depth) else 0.0
