"""What a RealSense D415 makes of a perfect picture: noise, gaps and rounding of colour and depth.

The D415 triangulates: a disparity d = f b / z is measured with an error of some hundredths of a pixel,
so depth errs by z^2 sigma_d / (f b), alike over the few pixels of a matching window; what only one of
the two imagers sees has no depth; the result is rounded to millimetres.
"""

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri


@dataclass
class SensorNoise:
    """How strong each imperfection is. Defaults: a D415 at 0.3 to 0.6 m."""

    enabled: bool = True
    """False: a perfect sensor, whatever else is said here."""
    color_std: float = 2.0
    """Standard deviation of each colour channel, levels of 255."""
    disparity_std: float = 0.08
    """Standard deviation of the disparity, px."""
    focal_length: float = 645.0
    """Focal length of the infrared imagers, px."""
    baseline: float = 0.055
    """Distance of the infrared imagers, m."""
    correlation: float = 1.5
    """Width (one sigma) over which the depth noise is alike, px."""
    quantum: float = 0.001
    """Depth is rounded to multiples of this, m; 0: not at all."""
    occlusion_shadow: bool = True
    """Whether depth is missing where the second imager's view is blocked."""
    edge_step: float = 0.01
    """A depth difference between neighbouring pixels that counts as an edge, m."""
    edge_dropout: float = 0.5
    """Share of the pixels at an edge that lose their depth."""


def depth_std(depth: NDArray, noise: SensorNoise) -> NDArray:
    """Standard deviation of the depth noise, m, at depths [...], m (rounding not included)."""
    return depth * depth * np.float32(noise.disparity_std / (noise.focal_length * noise.baseline))


def noisy_color(color: NDArray[np.uint8], noise: SensorNoise, rng: np.random.Generator) -> NDArray[np.uint8]:
    """Colour [H, W, 3] as the sensor reports it, saturating at 0 and 255."""
    if not noise.enabled or noise.color_std == 0:
        return color
    levels = np.round(noise.color_std * _normal_quantiles()).astype(np.int8)
    drawn = cv2.LUT(_random_bytes(color.shape, rng), levels)
    return np.asarray(cv2.add(color, drawn, dtype=cv2.CV_8U), np.uint8)


def noisy_depth(
    depth: NDArray[np.float32], noise: SensorNoise, rng: np.random.Generator
) -> NDArray[np.float32]:
    """Depth [H, W], m, as the sensor reports it; 0 = invalid, before and after."""
    if not noise.enabled:
        return depth
    valid = depth > 0
    if noise.occlusion_shadow:
        valid &= ~occlusion_shadow(depth, noise)
    if noise.edge_dropout > 0:
        valid &= ~(_edges(depth, noise.edge_step) & _drawn(noise.edge_dropout, depth.shape, rng))
    noisy = _correlated_normal(depth.shape, noise.correlation, rng)
    noisy *= depth_std(depth, noise)
    noisy += depth
    if noise.quantum > 0:
        np.rint(np.multiply(noisy, np.float32(1 / noise.quantum), out=noisy), out=noisy)
        noisy *= np.float32(noise.quantum)
    noisy[~valid] = 0
    return noisy


def occlusion_shadow(depth: NDArray[np.float32], noise: SensorNoise) -> NDArray[np.bool_]:
    """Pixels [H, W] that only the left imager sees: those just left of something nearer.

    A point at column u lands in the right imager at u - d. It is hidden there if a point further right,
    necessarily nearer, lands at the same column or left of it.
    """
    invalid = depth == 0
    with np.errstate(divide="ignore"):
        landing = np.float32(-noise.focal_length * noise.baseline) / depth
    landing += np.arange(depth.shape[1], dtype=np.float32)
    landing[invalid] = np.inf
    leftmost_from_here_on = np.minimum.accumulate(landing[:, ::-1], axis=1)[:, ::-1]
    shadow = np.zeros(depth.shape, bool)
    np.greater_equal(landing[:, :-1], leftmost_from_here_on[:, 1:], out=shadow[:, :-1])
    shadow[invalid] = False
    return shadow


def _edges(depth: NDArray[np.float32], step: float) -> NDArray[np.bool_]:
    """Pixels about which depth differs by more than `step`, m; what is invalid counts as at 0."""
    return cv2.morphologyEx(depth, cv2.MORPH_GRADIENT, np.ones((3, 3), np.uint8)) > step


def _correlated_normal(shape: tuple[int, ...], width: float, rng: np.random.Generator) -> NDArray[np.float32]:
    """Normal noise of unit variance [H, W] that is alike over `width` px."""
    table = _normal_quantiles().astype(np.float32)
    white = np.asarray(cv2.LUT(_random_bytes(shape, rng), table), np.float32)
    if width <= 0:
        return white
    size = 2 * int(np.ceil(3 * width)) + 1
    kernel = cv2.getGaussianKernel(size, width)
    blurred = np.asarray(cv2.GaussianBlur(white, (size, size), width), np.float32)
    blurred /= np.float32(np.sum(kernel**2))  # the standard deviation that weights k (x) k leave
    return blurred


def _drawn(share: float, shape: tuple[int, ...], rng: np.random.Generator) -> NDArray[np.bool_]:
    return _random_bytes(shape, rng) < 256 * share


def _random_bytes(shape: tuple[int, ...], rng: np.random.Generator) -> NDArray[np.uint8]:
    return np.frombuffer(rng.bytes(int(np.prod(shape))), np.uint8).reshape(shape)


@lru_cache(maxsize=1)
def _normal_quantiles() -> NDArray[np.float64]:
    """Unit normal noise for every byte; looking bytes up is ten times as fast as drawing normals."""
    quantiles = ndtri((np.arange(256) + 0.5) / 256)
    quantiles /= quantiles.std()
    quantiles.flags.writeable = False
    return quantiles
