"""What a RealSense D415 makes of a perfect picture: noise, gaps and rounding of colour and depth.

The D415 triangulates: a disparity d = f b / z is measured with an error of some hundredths of a pixel,
so depth errs by z^2 sigma_d / (f b), alike over the few pixels of a matching window; what only one of
the two imagers sees has no depth; the result is rounded to millimetres.

That is the sensor as its data sheet has it, and the default. Real depth errs in more ways, each of which can be
switched on here (`every_depth_error` has all): smoothly, over tens of pixels and differently from each view;
without depth where it is dark or seen at a grazing angle; with depth between near and far at edges; beside
colour by some pixels. docs/sensing.md says where their figures come from.
"""

from dataclasses import dataclass, field
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from riseg_drake.geometry.camera import Intrinsics, rays
from riseg_drake.stations.smooth_error import SmoothErrorParameters, smooth_error

_PATCH = 3.0
"""Width (one sigma) of the patches without depth, px."""


@dataclass
class SensorNoise:
    """How strong each imperfection is. Defaults: a D415 at 0.3 to 0.6 m."""

    enabled: bool = True
    """False: a perfect sensor, whatever else is said here."""
    color_std: float = field(default=2.0, metadata={"least": 0.0, "most": 40.0})
    """Standard deviation of each colour channel, levels of 255."""
    disparity_std: float = field(default=0.08, metadata={"least": 0.0, "most": 10.0})
    """Standard deviation of the disparity, px."""
    focal_length: float = field(default=645.0, metadata={"least": 10.0, "most": 100000.0})
    """Focal length of the infrared imagers, px."""
    baseline: float = field(default=0.055, metadata={"least": 0.001, "most": 10.0})
    """Distance of the infrared imagers, m."""
    correlation: float = field(default=1.5, metadata={"least": 0.1, "most": 50.0})
    """Width (one sigma) over which the depth noise is alike, px."""
    quantum: float = field(default=0.001, metadata={"least": 0.0, "most": 0.1})
    """Depth is rounded to multiples of this, m; 0: not at all."""
    occlusion_shadow: bool = True
    """Whether depth is missing where the second imager's view is blocked."""
    edge_step: float = field(default=0.01, metadata={"least": 0.0001, "most": 1.0})
    """A depth difference between neighbouring pixels that counts as an edge, m."""
    edge_dropout: float = field(default=0.5, metadata={"least": 0.0, "most": 1.0})
    """Share of the pixels at an edge that lose their depth."""
    flying: float = field(default=0.0, metadata={"least": 0.0, "most": 1.0})
    """Share of those that keep it whose depth lies anywhere between near and far; measured 0.12."""
    smooth: SmoothErrorParameters = field(default_factory=SmoothErrorParameters)
    """The error that is alike over tens of pixels."""
    dark_level: float = field(default=48.0, metadata={"least": 1.0, "most": 255.0})
    """Gray level of 255 below which depth may be missing,"""
    dark_dropout: float = field(default=0.0, metadata={"least": 0.0, "most": 1.0})
    """and the share that is, in patches, where it is black; measured 0.2."""
    grazing_angle: float = field(default=45.0, metadata={"least": 2.0, "most": 89.0})
    """Angle between line of sight and normal, degrees, above which depth may be missing,"""
    grazing_dropout: float = field(default=0.0, metadata={"least": 0.0, "most": 1.0})
    """and the share that is, in patches, just short of 90 degrees; measured 0.07."""
    depth_shift: list[int] = field(
        default_factory=lambda: [0, 0], metadata={"sizes": (2,), "least": -100, "most": 100}
    )
    """Whole pixels, right and down, by which depth lies beside colour; measured 1 to 5."""


def every_depth_error() -> SensorNoise:
    """All errors of depth, as strong as they were measured on a RealSense (docs/sensing.md)."""
    return SensorNoise(
        flying=0.12,
        smooth=SmoothErrorParameters(disparity_std=0.2),
        dark_dropout=0.2,
        grazing_dropout=0.07,
        depth_shift=[-1, -1],
    )


@dataclass(frozen=True)
class Sight:
    """What some errors of depth depend on, besides depth."""

    color: NDArray[np.uint8]
    """[H, W, 3], without noise."""
    intrinsics: Intrinsics
    X_WC: NDArray[np.float64]
    """Pose of the camera [4, 4]: from the same view depth errs in the same way."""
    seed: int
    """Which of all sensors it is: draws how it errs."""


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
    depth: NDArray[np.float32], noise: SensorNoise, rng: np.random.Generator, sight: Sight | None = None
) -> NDArray[np.float32]:
    """Depth [H, W], m, as the sensor reports it; 0 = invalid, before and after.

    Smooth errors and holes in what is dark or grazed are left out where no `sight` is given.
    """
    if not noise.enabled:
        return depth
    valid = depth > 0
    if noise.occlusion_shadow:
        valid &= ~occlusion_shadow(depth, noise)
    edges = _edges(depth, noise.edge_step)
    if noise.edge_dropout > 0:
        valid &= ~(edges & _drawn(noise.edge_dropout, depth.shape, rng))
    noisy = _correlated_normal(depth.shape, noise.correlation, rng)
    noisy *= depth_std(depth, noise)
    if sight is not None and noise.smooth.disparity_std > 0:
        per_pixel = depth * depth * np.float32(1 / (noise.focal_length * noise.baseline))
        noisy += per_pixel * smooth_error(depth.shape, sight.X_WC, noise.smooth, sight.seed, rng)
    noisy += depth
    if noise.flying > 0:
        fly = edges & valid & _drawn(noise.flying, depth.shape, rng)
        noisy[fly] = _between_near_and_far(depth, rng)[fly]
    if sight is not None:
        valid &= ~_holes(depth, sight, noise, rng)
    if noise.quantum > 0:
        np.rint(np.multiply(noisy, np.float32(1 / noise.quantum), out=noisy), out=noisy)
        noisy *= np.float32(noise.quantum)
    noisy[~valid] = 0
    return _shifted(noisy, noise.depth_shift)


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


def grazing_angles(depth: NDArray[np.float32], intrinsics: Intrinsics) -> NDArray[np.float32]:
    """Angle [H, W], degrees, between the line of sight and the normal of what depth [H, W], m, shows.

    On a plane 1 / z is linear in (u, v). Nonsense at edges of depth.
    """
    with np.errstate(divide="ignore"):
        q = np.where(depth > 0, 1 / depth, 0).astype(np.float32)
    slope_u = cv2.Sobel(q, cv2.CV_32F, 1, 0, scale=0.125) * np.float32(intrinsics.fx)
    slope_v = cv2.Sobel(q, cv2.CV_32F, 0, 1, scale=0.125) * np.float32(intrinsics.fy)
    ray = rays(intrinsics)
    along = q - slope_u * ray[..., 0] - slope_v * ray[..., 1]
    length = np.sqrt(slope_u**2 + slope_v**2 + along**2) * np.linalg.norm(ray, axis=-1)
    return np.degrees(np.arccos(np.clip(q / np.maximum(length, np.float32(1e-9)), 0, 1))).astype(np.float32)


def _holes(
    depth: NDArray[np.float32], sight: Sight, noise: SensorNoise, rng: np.random.Generator
) -> NDArray[np.bool_]:
    """Where depth is missing since it is dark there, or seen at a grazing angle; in patches."""
    share = np.zeros(depth.shape, np.float32)
    if noise.dark_dropout > 0:
        gray = cv2.cvtColor(np.ascontiguousarray(sight.color), cv2.COLOR_RGB2GRAY)
        share += noise.dark_dropout * np.clip(1 - gray / np.float32(noise.dark_level), 0, 1)
    if noise.grazing_dropout > 0:
        beyond = (grazing_angles(depth, sight.intrinsics) - noise.grazing_angle) / (90 - noise.grazing_angle)
        share += noise.grazing_dropout * np.clip(beyond, 0, 1)
    if not share.any():
        return share > 0
    return _correlated_normal(depth.shape, _PATCH, rng) < ndtri(np.minimum(share, 0.999))


def _between_near_and_far(depth: NDArray[np.float32], rng: np.random.Generator) -> NDArray[np.float32]:
    """A depth [H, W], m, drawn for each pixel from between the nearest and the farthest about it."""
    window = np.ones((3, 3), np.uint8)
    far = cv2.dilate(depth, window)
    near = cv2.erode(np.where(depth > 0, depth, far), window)
    return near + (far - near) * (_random_bytes(depth.shape, rng) + np.float32(0.5)) / np.float32(256)


def _shifted(depth: NDArray[np.float32], shift: list[int]) -> NDArray[np.float32]:
    """Depth [H, W] moved by whole pixels to the right and down, 0 where it came from nowhere."""
    du, dv = shift
    if du == 0 and dv == 0:
        return depth
    there = np.array([[1, 0, du], [0, 1, dv]], np.float32)
    return cv2.warpAffine(depth, there, depth.shape[::-1], flags=cv2.INTER_NEAREST)


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
