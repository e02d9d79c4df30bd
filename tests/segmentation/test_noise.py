"""How far flow is trusted: not at all on blank surfaces, less where the sensor is worse."""

from dataclasses import replace

import numpy as np
from scipy import ndimage

from riseg_drake.geometry.rgbd import smooth_gray
from riseg_drake.segmentation.noise import MeasurementNoise, depth_sigma, flow_sigma, gray_variance
from riseg_drake.segmentation.optical_flow import DisFlow
from tests.segmentation.drawn_scene import Texture

NOISE = MeasurementNoise()


def textured(contrast: float, shift: float = 0.0) -> np.ndarray:
    """A textured image [H, W, 3] before rounding, moved to the right by some pixels."""
    v, u = np.mgrid[:120, :160].astype(float)
    points = np.stack([u - shift, v, np.zeros_like(u)], axis=-1).reshape(-1, 3) * 0.001
    return Texture(seed=1, contrast=contrast).color(points).reshape(120, 160, 3)


def noisy(color: np.ndarray, rng: np.random.Generator, sigma: float = NOISE.color) -> np.ndarray:
    return np.clip(np.rint(color + rng.normal(0, sigma, color.shape)), 0, 255).astype(np.uint8)


def sigma_of(color: np.ndarray, noise: MeasurementNoise = NOISE) -> float:
    return float(np.median(flow_sigma(smooth_gray(color), noise)))


def test_flow_on_a_blank_surface_is_not_to_be_used() -> None:
    blank = np.full((120, 160, 3), 230.0)
    rng = np.random.default_rng(0)
    assert sigma_of(blank.astype(np.uint8)) > NOISE.flow_max
    # Sensor noise is not texture.
    assert sigma_of(noisy(blank, rng)) > NOISE.flow_max


def test_flow_on_texture_is_nearly_as_good_as_it_gets() -> None:
    texture = noisy(textured(24.0), np.random.default_rng(0))
    assert NOISE.flow <= sigma_of(texture) < 1.5 * NOISE.flow


def test_stripes_show_flow_in_one_direction_only_and_are_not_trusted() -> None:
    stripes = np.tile(128 + 60 * np.sin(np.arange(160) / 2.0)[None, :, None], (120, 1, 3))
    assert sigma_of(stripes.astype(np.uint8)) > NOISE.flow_max


def test_less_contrast_means_less_trust() -> None:
    rng = np.random.default_rng(0)
    sigmas = [sigma_of(noisy(textured(contrast), rng)) for contrast in (24.0, 8.0, 3.0)]
    assert sigmas == sorted(sigmas)
    assert sigmas[0] < sigmas[2]


def test_more_noise_of_colour_means_less_trust() -> None:
    texture = noisy(textured(6.0), np.random.default_rng(0))
    sigmas = [sigma_of(texture, replace(NOISE, color=color)) for color in (0.5, 2.0, 5.0)]
    assert sigmas[0] < sigmas[1] < sigmas[2]


def test_it_tells_where_dense_inverse_search_goes_wrong() -> None:
    """Left half textured, right half nearly blank: errors and what is claimed of them go together."""
    rng = np.random.default_rng(0)
    left = np.arange(160)[None, :, None] < 80
    first, second = (noisy(np.where(left, textured(24.0, s), textured(0.3, s)), rng) for s in (0.0, 1.0))
    error = np.linalg.norm(DisFlow()(first, second) - np.float32([1, 0]), axis=-1)
    claimed = flow_sigma(smooth_gray(first), NOISE)
    trusted = claimed < NOISE.flow_max
    assert np.mean(trusted[16:-16, 16:64]) > 0.95
    assert np.mean(trusted[16:-16, 96:-16]) < 0.05
    assert np.sqrt(np.mean(error[16:-16, 16:64] ** 2)) < 3 * np.median(claimed[16:-16, 16:64])
    assert np.sqrt(np.mean(error[16:-16, 96:-16] ** 2)) > 2 * NOISE.flow


def test_depth_noise_grows_with_the_square_of_depth() -> None:
    np.testing.assert_allclose(depth_sigma(np.array([0.5, 1.0, 2.0]), 0.002), [0.0005, 0.002, 0.008])


def test_flows_noise_is_that_of_the_structure_tensors_smaller_eigenvalue() -> None:
    # Another implementation: scipy's filters, numpy's eigenvalues.
    gray = smooth_gray(noisy(textured(10.0), np.random.default_rng(0)))
    gradient = [ndimage.sobel(gray.astype(float), axis) / 8 for axis in (1, 0)]
    tensor = np.array([[ndimage.uniform_filter(a * b, 9) for a in gradient] for b in gradient])
    least = np.linalg.eigvalsh(tensor.transpose(2, 3, 0, 1))[..., 0]
    texture = np.maximum(least - 0.057 * NOISE.color**2, 1e-3)
    expected = np.sqrt(NOISE.flow**2 + 2 * NOISE.color**2 / (81 * texture))
    inner = np.s_[6:-6, 6:-6]
    np.testing.assert_allclose(flow_sigma(gray, NOISE)[inner], expected[inner], rtol=2e-3)


def test_a_gray_value_errs_by_the_noise_of_both_images_and_a_quarter_pixel_of_its_gradient() -> None:
    squared = np.array([0.0, 16.0, 400.0], np.float32)
    np.testing.assert_allclose(gray_variance(squared, NOISE), [8.0, 9.0, 33.0])
