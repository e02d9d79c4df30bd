import numpy as np
import pytest

from riseg_drake.stations.sensor_noise import (
    SensorNoise,
    depth_std,
    noisy_color,
    noisy_depth,
    occlusion_shadow,
)

SHAPE = (240, 320)


def plane(z):
    return np.full(SHAPE, z, np.float32)


def step(left, right, column=160):
    depth = plane(left)
    depth[:, column:] = right
    return depth


@pytest.mark.parametrize("z", [0.35, 0.5, 1.2])
def test_depth_noise_has_the_spread_that_triangulation_gives(z):
    noise = SensorNoise(quantum=0.0)
    error = noisy_depth(plane(z), noise, np.random.default_rng(0)) - z
    assert error.std() == pytest.approx(z**2 * 0.08 / (645 * 0.055), rel=0.05)
    assert abs(error.mean()) < 0.1 * error.std()
    assert depth_std(z, noise) == pytest.approx(z**2 * 0.08 / (645 * 0.055))


def test_depth_noise_is_alike_over_a_few_pixels_only():
    error = noisy_depth(plane(0.5), SensorNoise(quantum=0.0), np.random.default_rng(1)) - 0.5
    # Two samples of white noise blurred by a Gaussian of width s correlate as exp(-distance^2 / 4 s^2).
    for distance in (1, 2, 3, 10):
        correlation = np.corrcoef(error[:, distance:].ravel(), error[:, :-distance].ravel())[0, 1]
        assert correlation == pytest.approx(np.exp(-(distance**2) / (4 * 1.5**2)), abs=0.04)


def test_depth_is_rounded_to_millimetres():
    millimetres = 1000 * noisy_depth(plane(0.4), SensorNoise(), np.random.default_rng(2))
    np.testing.assert_allclose(millimetres, np.round(millimetres), atol=1e-3)
    assert len(np.unique(millimetres.round())) > 2


def test_depth_is_missing_left_of_something_near_as_wide_as_the_difference_in_disparity():
    noise = SensorNoise()
    shadow = occlusion_shadow(step(0.5, 0.4), noise)
    width = noise.focal_length * noise.baseline * (1 / 0.4 - 1 / 0.5)  # 17.7 px
    columns = np.nonzero(shadow[100])[0]
    assert columns.max() == 159
    assert len(columns) == pytest.approx(width, abs=1)


def test_no_shadow_falls_to_the_right_of_something_near_nor_on_invalid_depth():
    assert not occlusion_shadow(step(0.4, 0.5), SensorNoise()).any()
    assert not occlusion_shadow(step(0.0, 0.4), SensorNoise()).any()


def test_half_of_the_pixels_at_an_edge_lose_their_depth_and_none_elsewhere():
    noise = SensorNoise(occlusion_shadow=False)
    lost = noisy_depth(step(0.4, 0.5), noise, np.random.default_rng(3)) == 0
    assert lost[:, 159:161].mean() == pytest.approx(0.5, abs=0.08)
    assert not lost[:, :158].any()
    assert not lost[:, 162:].any()


def test_what_is_invalid_stays_invalid():
    lost = noisy_depth(plane(0.0), SensorNoise(), np.random.default_rng(4))
    assert not lost.any()


def test_color_noise_has_its_spread_and_saturates():
    noise, rng = SensorNoise(), np.random.default_rng(5)
    gray = np.full((*SHAPE, 3), 128, np.uint8)
    error = noisy_color(gray, noise, rng).astype(float) - 128
    assert error.std() == pytest.approx(noise.color_std, rel=0.05)
    assert abs(error.mean()) < 0.05
    assert noisy_color(np.full_like(gray, 255), noise, rng).min() > 240
    assert noisy_color(np.zeros_like(gray), noise, rng).max() < 15


def test_a_perfect_sensor_changes_nothing():
    perfect, rng = SensorNoise(enabled=False), np.random.default_rng(6)
    depth, color = step(0.5, 0.4), np.full((*SHAPE, 3), 7, np.uint8)
    np.testing.assert_array_equal(noisy_depth(depth, perfect, rng), depth)
    np.testing.assert_array_equal(noisy_color(color, perfect, rng), color)


def test_the_same_generator_state_gives_the_same_noise_and_another_one_other_noise():
    first, again, other = (
        noisy_depth(plane(0.5), SensorNoise(), np.random.default_rng([7, n])) for n in (0, 0, 1)
    )
    np.testing.assert_array_equal(first, again)
    assert (first != other).mean() > 0.3
