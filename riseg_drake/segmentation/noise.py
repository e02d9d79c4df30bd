"""What the measurements are worth: standard deviations of flow, depth and colour."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from riseg_drake.segmentation.scales import FLOW_NOISE

_WINDOW = 9
"""Pixels on a side of the window that flow is taken to match; DIS matches patches of 8."""
_NOISE_GRADIENT = 0.057
"""Mean squared gradient of white noise of variance 1 after `smooth_gray`: not texture."""


@dataclass
class MeasurementNoise:
    """Noise of one frame pair's measurements; depth noise is read off the table in every frame."""

    flow: float = FLOW_NOISE
    """Standard deviation of optical flow on textured surfaces, pixels."""
    flow_max: float = 2.0
    """Where so little texture is that flow is worse than that, pixels, it is not used."""
    color: float = 2.0
    """Standard deviation of a gray value, of 255."""
    registration: float = 0.25
    """How far a rightly predicted pixel still is from where it appears (interpolation, pose), pixels."""


def depth_sigma(depth: NDArray, noise_at_1m: float) -> NDArray:
    """Standard deviation of stereo depth [...], m: a constant disparity error grows with depth squared."""
    return noise_at_1m * depth**2


def gray_variance(gradient_squared: NDArray[np.float32], noise: MeasurementNoise) -> NDArray[np.float32]:
    """Variance [...] of the difference between a gray value and where it should reappear.

    Sensor noise of both images, and what a small error of position makes of the gradient, of which the square
    [...] is given, see `Frame.gradient_squared`.
    """
    return np.float32(2 * noise.color**2) + np.float32(noise.registration**2) * gradient_squared


def flow_sigma(gray: NDArray[np.float32], noise: MeasurementNoise) -> NDArray[np.float32]:
    """Standard deviation [H, W] of optical flow, pixels, as far as the image itself tells.

    Matching a window of n pixels finds a shift to within 2 sigma^2 / (n lambda), with lambda the mean
    squared gradient in the direction where there is least of it (Lucas and Kanade's normal equations).
    """
    gradient_u = cv2.Sobel(gray, cv2.CV_32F, 1, 0, scale=0.125)
    gradient_v = cv2.Sobel(gray, cv2.CV_32F, 0, 1, scale=0.125)
    uu, uv, vv = (
        cv2.boxFilter(a * b, -1, (_WINDOW, _WINDOW))
        for a, b in ((gradient_u, gradient_u), (gradient_u, gradient_v), (gradient_v, gradient_v))
    )
    least = 0.5 * (uu + vv - np.sqrt((uu - vv) ** 2 + 4 * uv**2))
    texture = np.maximum(least - np.float32(_NOISE_GRADIENT * noise.color**2), np.float32(1e-3))
    return np.sqrt(np.float32(noise.flow**2) + np.float32(2 * noise.color**2 / _WINDOW**2) / texture)
