"""What the measurements are worth: standard deviations of flow, depth and colour."""

from dataclasses import dataclass

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
