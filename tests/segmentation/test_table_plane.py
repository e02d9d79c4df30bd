"""The table plane against closed forms."""

import numpy as np
import pytest

from riseg_drake.geometry.camera import rays
from riseg_drake.geometry.plane import heights_above_plane
from riseg_drake.segmentation.table_plane import fit_plane
from tests.geometry.planes import CAMERA, tilted_plane


def depth_of_plane(plane_C: np.ndarray) -> np.ndarray:
    return (-plane_C[3] / (rays(CAMERA).astype(float) @ plane_C[:3])).astype(np.float32)


def with_noise(depth: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """D415-like: standard deviation 0.0023 z^2, quantised to a millimetre."""
    noisy = depth + rng.normal(size=depth.shape) * 0.0023 * depth**2
    return (np.round(noisy * 1000) / 1000).astype(np.float32)


def angle_between(plane_a: np.ndarray, plane_b: np.ndarray) -> float:
    return float(np.arctan2(np.linalg.norm(np.cross(plane_a[:3], plane_b[:3])), plane_a[:3] @ plane_b[:3]))


@pytest.mark.parametrize("tilt", [0.0, 0.3, 0.8])
def test_noise_free_plane_is_found_exactly_at_any_tilt(tilt: float) -> None:
    plane_C = tilted_plane(tilt, 0.5)
    found_C = fit_plane(depth_of_plane(plane_C), CAMERA, np.random.default_rng(0))
    np.testing.assert_allclose(found_C, plane_C, atol=1e-6)


@pytest.mark.parametrize("seed", range(5))
def test_noisy_table_on_a_third_of_the_image_is_found_below_boxes(seed: int) -> None:
    rng = np.random.default_rng(seed)
    plane_C = tilted_plane(0.15, 0.5)
    depth = depth_of_plane(plane_C)
    # Two flat-topped boxes fill two thirds; each alone has as many pixels as the table.
    depth[:, :215] -= np.float32(0.08)
    depth[:, 215:430] -= np.float32(0.05)
    depth = with_noise(depth, rng)
    depth[rng.random(depth.shape) < 0.1] = 0
    found_C = fit_plane(depth, CAMERA, rng)
    assert angle_between(found_C, plane_C) < np.deg2rad(0.3)
    table = heights_above_plane(depth, CAMERA, found_C)[:, 430:]
    assert abs(np.nanmedian(table)) < 5e-4


def test_bigger_flat_top_loses_against_the_table_below_it() -> None:
    plane_C = tilted_plane(0.0, 0.5)
    depth = depth_of_plane(plane_C)
    depth[:, :350] -= np.float32(0.06)  # 55 % of the image
    found_C = fit_plane(depth, CAMERA, np.random.default_rng(0))
    np.testing.assert_allclose(found_C, plane_C, atol=1e-5)


def test_a_table_is_chosen_beside_a_bigger_wall_and_over_a_bigger_floor() -> None:
    elevation = np.radians(40)
    up = np.array([0.0, -np.cos(elevation), -np.sin(elevation)])
    back = np.array([0.0, np.sin(elevation), -np.cos(elevation)])
    table_C, floor_C, wall_C = np.append(up, 0.7), np.append(up, 1.42), np.append(back, 1.4)
    table, floor, wall = (
        np.where(depth > 0, depth, np.inf) for depth in map(depth_of_plane, (table_C, floor_C, wall_C))
    )
    v, u = np.mgrid[:480, :640]
    depth = np.minimum(floor, wall)
    depth[(v > 200) & (v < 400) & (u > 160) & (u < 480)] = table[(v > 200) & (v < 400) & (u > 160) & (u < 480)]
    found_C = fit_plane(with_noise(depth, np.random.default_rng(0)), CAMERA, np.random.default_rng(0))
    assert angle_between(found_C, table_C) < np.radians(0.5)
    assert abs(found_C[3] - table_C[3]) < 0.005


def test_same_seed_gives_the_same_plane() -> None:
    depth = with_noise(depth_of_plane(tilted_plane(0.1, 0.5)), np.random.default_rng(1))
    first, second = (fit_plane(depth, CAMERA, np.random.default_rng(7)) for _ in range(2))
    assert np.array_equal(first, second)


def test_masked_pixels_do_not_take_part() -> None:
    plane_C = tilted_plane(0.0, 0.5)
    depth = depth_of_plane(plane_C)
    robot = np.zeros(CAMERA.shape, bool)
    robot[:400] = True
    depth[robot] = 0.55  # a big false plane below the table
    found_C = fit_plane(depth, CAMERA, np.random.default_rng(0), valid=~robot)
    np.testing.assert_allclose(found_C, plane_C, atol=1e-5)


@pytest.mark.parametrize("case", ["empty", "scattered"])
def test_image_without_a_plane_is_a_clear_error(case: str) -> None:
    rng = np.random.default_rng(0)
    depth = np.zeros(CAMERA.shape, np.float32)
    if case == "scattered":
        depth = rng.uniform(0.3, 1.5, CAMERA.shape).astype(np.float32)
    with pytest.raises(ValueError, match="no plane"):
        fit_plane(depth, CAMERA, rng)
