from dataclasses import replace

import numpy as np
import pytest

from riseg_drake.geometry.camera import Intrinsics, rays
from riseg_drake.geometry.se3 import exp_se3
from riseg_drake.stations.sensor_noise import (
    SensorNoise,
    Sight,
    depth_std,
    every_depth_error,
    grazing_angles,
    noisy_color,
    noisy_depth,
    occlusion_shadow,
)
from riseg_drake.stations.smooth_error import SmoothErrorParameters

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


CAMERA = Intrinsics(SHAPE[1], SHAPE[0], 308.0, 308.0, 159.5, 119.5)


def sight(gray=128):
    return Sight(np.full((*SHAPE, 3), gray, np.uint8), CAMERA, np.eye(4), seed=1)


def tilted_plane(degrees):
    """Depth of a plane 0.5 m ahead, turned about the image's vertical by an angle."""
    n = np.array([np.sin(np.radians(degrees)), 0, np.cos(np.radians(degrees))])
    return (0.5 * n[2] / (rays(CAMERA) @ n)).astype(np.float32)


def missing(depth, seen, **switches):
    noise = SensorNoise(occlusion_shadow=False, edge_dropout=0.0, **switches)
    return np.mean([noisy_depth(depth, noise, np.random.default_rng(k), seen) == 0 for k in range(8)], axis=0)


@pytest.mark.parametrize("degrees", [0, 30, 60, 80])
def test_the_grazing_angle_is_that_of_the_line_of_sight_and_the_normal(degrees):
    depth = tilted_plane(degrees)
    angle = grazing_angles(depth, CAMERA)
    assert angle[119, 159] == pytest.approx(degrees, abs=0.3)
    ray = rays(CAMERA)[119, 240].astype(float)
    n = np.array([np.sin(np.radians(degrees)), 0, np.cos(np.radians(degrees))])
    if degrees < 70:  # the plane is still ahead there
        expected = np.degrees(np.arccos(ray @ n / np.linalg.norm(ray)))
        assert angle[119, 240] == pytest.approx(expected, abs=0.5)


@pytest.mark.parametrize(("gray", "share"), [(0, 0.2), (24, 0.1), (48, 0.0), (200, 0.0)])
def test_the_darker_it_is_the_more_depth_is_missing(gray, share):
    assert missing(plane(0.5), sight(gray), dark_dropout=0.2).mean() == pytest.approx(share, abs=0.03)


def test_what_is_grazed_loses_depth_in_proportion_beyond_the_angle():
    middle = (slice(100, 140), slice(140, 180))
    lost = {d: missing(tilted_plane(d), sight(), grazing_dropout=0.5)[middle].mean() for d in (20, 40, 70)}
    assert lost[20] == lost[40] == 0
    assert lost[70] == pytest.approx(0.5 * (70 - 45) / (90 - 45), abs=0.08)


def test_holes_are_patches_not_specks():
    noise = SensorNoise(occlusion_shadow=False, edge_dropout=0.0, dark_dropout=0.2)
    lost = noisy_depth(plane(0.5), noise, np.random.default_rng(0), sight(0)) == 0
    assert lost[:, 1:][lost[:, :-1]].mean() > 0.7  # 0.2 for specks


def test_flying_pixels_lie_between_near_and_far_and_at_edges_only():
    noise = SensorNoise(occlusion_shadow=False, edge_dropout=0.0, disparity_std=0.0, quantum=0.0, flying=0.25)
    seen = noisy_depth(step(0.4, 0.5), noise, np.random.default_rng(3))
    fly = (seen > 0.4001) & (seen < 0.4999)
    assert fly[:, 159:161].mean() == pytest.approx(0.25, abs=0.06)
    assert fly.sum() == fly[:, 159:161].sum()
    assert seen[fly].mean() == pytest.approx(0.45, abs=0.01)


def test_depth_lies_beside_colour_by_the_shift():
    noise = SensorNoise(occlusion_shadow=False, edge_dropout=0.0, disparity_std=0.0, depth_shift=[3, -2])
    seen = noisy_depth(step(0.4, 0.5), noise, np.random.default_rng(0))
    np.testing.assert_allclose(seen[:-2, 3:], step(0.4, 0.5)[2:, :-3], atol=1e-6)
    assert not seen[:, :3].any()
    assert not seen[-2:].any()


def test_the_smooth_error_grows_with_the_square_of_distance_and_belongs_to_the_view():
    smooth = SmoothErrorParameters(disparity_std=0.2, flicker=0.0)
    noise = SensorNoise(quantum=0.0, disparity_std=0.0, smooth=smooth)
    near, far = (noisy_depth(plane(z), noise, np.random.default_rng(5), sight()) - z for z in (0.4, 0.8))
    np.testing.assert_allclose(far, 4 * near, atol=1e-6)
    assert near.std() == pytest.approx(0.4**2 * 0.2 / (645 * 0.055), rel=0.2)
    moved = replace(sight(), X_WC=exp_se3(np.array([0, 0, 0, 0.05, 0, 0])))
    other = noisy_depth(plane(0.4), noise, np.random.default_rng(5), moved) - 0.4
    assert abs(np.corrcoef(near.ravel(), other.ravel())[0, 1]) < 0.3


def test_every_depth_error_switches_each_on_and_the_default_none():
    on, off = every_depth_error(), SensorNoise()
    for name in ("flying", "dark_dropout", "grazing_dropout"):
        assert getattr(on, name) > 0 == getattr(off, name)
    assert on.smooth.disparity_std > 0 == off.smooth.disparity_std
    assert any(on.depth_shift)
    assert not any(off.depth_shift)


def test_what_is_switched_off_leaves_the_picture_as_it_was():
    drawn = [noisy_depth(step(0.4, 0.5), SensorNoise(), np.random.default_rng(8), s) for s in (None, sight(0))]
    np.testing.assert_array_equal(*drawn)
