"""What the measurements are worth: standard deviations of flow, depth and colour."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray


@dataclass
class MeasurementNoise:
    """Noise of one frame pair's measurements; depth noise is read off the table in every frame."""

    flow: float = 0.2
    """Standard deviation of optical flow on textured surfaces, pixels."""
    color: float = 3.0
    """Standard deviation of a gray value, of 255."""
    registration: float = 0.25
    """How far a rightly predicted pixel still is from where it appears (interpolation, pose), pixels."""


def depth_sigma(depth: NDArray, noise_at_1m: float) -> NDArray:
    """Standard deviation of stereo depth, m: a constant disparity error grows with depth squared."""
    return noise_at_1m * depth**2


def smooth_gray(color: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Gray values [H, W], 0..255, smoothed just enough to be interpolated between pixels."""
    gray = cv2.cvtColor(color, cv2.COLOR_RGB2GRAY)
    return cv2.GaussianBlur(gray, (0, 0), 0.7).astype(np.float32)


def gray_variance(gray: NDArray[np.float32], noise: MeasurementNoise) -> NDArray[np.float32]:
    """Variance [H, W] of the difference between a gray value and where it should reappear.

    Sensor noise of both images, and what a small error of position makes of the gradient.
    """
    gradient_squared = cv2.Sobel(gray, cv2.CV_32F, 1, 0, scale=0.125) ** 2
    gradient_squared += cv2.Sobel(gray, cv2.CV_32F, 0, 1, scale=0.125) ** 2
    return np.float32(2 * noise.color**2) + np.float32(noise.registration**2) * gradient_squared
