"""The table plane against closed forms."""

from contextlib import suppress

import numpy as np
import pytest

from riseg_drake.geometry.camera import rays
from riseg_drake.geometry.plane import heights_above_plane
from riseg_drake.segmentation.table_plane import (
    NoPlaneError,
    PlaneFitParameters,
    _least_squares_plane,
    _worth,
    fit_plane,
)
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


def test_a_plane_is_worth_what_lies_on_it_less_what_lies_below_and_far_above_and_less_if_it_leans() -> None:
    parameters = PlaneFitParameters()
    upright, leaning = np.array([0.0, -1.0, 0.0]), np.array([1.0, 0.0, 0.0])
    near, far = 0.5 * parameters.object_height, 2 * parameters.object_height
    heights = np.array([0.0, 0.0005, -0.0005, near, -near, -near, far, -far])
    nearness = np.array([1.0, 2.0, 4.0, 8.0, 0.5, 0.25, 0.125, 16.0])
    # Half its tolerance from the plane, a point counts 1 - 1 / 4.
    on, below, above = 1.0 + 0.75 * 6.0, 0.75, 0.125
    expected = on - parameters.below_penalty * below - parameters.above_penalty * above
    for normal, share in ((upright, 1.0), (leaning, parameters.upright_share)):
        p_CQ = (heights[:, None] - 0.5) * normal
        (worth,) = _worth(np.append(normal, 0.5)[None], p_CQ, np.full(8, 0.001), nearness, parameters)
        assert worth == pytest.approx(expected * (share if expected > 0 else 1.0), rel=1e-4)
    # What speaks against it is not less for a plane that leans.
    p_CQ = np.array([[-0.5 - near, 0.0, 0.0]])
    (worth,) = _worth(np.append(leaning, 0.5)[None], p_CQ, np.array([0.001]), np.ones(1), parameters)
    assert worth == pytest.approx(-parameters.below_penalty)
    # A plane that is as upright as can be has its worth, if some of it is against it or not.
    (worth,) = _worth(
        np.append(upright, 0.5)[None], p_CQ[:, [1, 0, 2]] * -1, np.array([0.001]), np.ones(1), parameters
    )
    assert worth == pytest.approx(-parameters.below_penalty)


def test_the_plane_of_least_squares_weighs_its_points() -> None:
    rng = np.random.default_rng(0)
    p_CQ = rng.normal(size=(50, 3)) * [1, 1, 0.02] + [0, 0, 2.0]
    count = rng.integers(1, 5, 50)
    plane_C = _least_squares_plane(p_CQ, count.astype(float))
    repeated = np.repeat(p_CQ, count, axis=0)
    normal = np.linalg.svd(repeated - repeated.mean(0))[2][2]
    np.testing.assert_allclose(np.abs(plane_C[:3] @ normal), 1, atol=1e-9)
    assert plane_C[:3] @ repeated.mean(0) + plane_C[3] == pytest.approx(0, abs=1e-9)
    assert plane_C[3] > 0


@pytest.mark.parametrize(("points", "first", "second"), [(2048, 131, 512), (8, 3, 3)])
def test_a_sixteenth_of_the_points_asks_all_planes_a_quarter_the_best_eighth_and_what_is_far_counts_less(
    monkeypatch: pytest.MonkeyPatch, points: int, first: int, second: int
) -> None:
    asked = []

    def worth(planes, p_CQ, tolerance, nearness, parameters):
        asked.append((len(planes), p_CQ[:, 2], nearness))
        return _worth(planes, p_CQ, tolerance, nearness, parameters)

    monkeypatch.setattr("riseg_drake.segmentation.table_plane._worth", worth)
    depth = np.full(CAMERA.shape, 1.0, np.float32)
    depth[:, 320:] = 3.0
    with suppress(NoPlaneError):
        fit_plane(depth, CAMERA, np.random.default_rng(0), PlaneFitParameters(points=points))
    (all_planes, z, nearness), (kept, few_z, _) = asked
    assert (len(z), len(few_z), kept) == (first, second, all_planes // 8 + 1)
    # From 1.5 times the nearest fifth on, points count by the square of depth.
    nearest = np.quantile(few_z, 0.2)
    assert nearest == 1.0 or points < 100
    np.testing.assert_allclose(nearness, np.minimum(1.0, (1.5 * nearest / z) ** 2))
