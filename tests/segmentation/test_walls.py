"""Walls on the plane of a table, seen from the origin: found where nothing is behind them, and only there."""

import numpy as np
import pytest

from riseg_drake.segmentation.walls import WallParameters, _fitted_line, _lines, find_walls, in_walls


def seen(wall_at: float, width: float, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Feet, heights and depths of a table's 600 points before y = 1.2, and of 400 on an upright plane."""
    table = rng.uniform([-0.5, 0.4], [0.5, 1.2], (600, 2))
    wall = np.column_stack([rng.uniform(-width / 2, width / 2, 400), rng.normal(wall_at, 0.003, 400)])
    height = np.concatenate([np.zeros(600), rng.uniform(0, 0.6, 400)])
    return (
        np.vstack([table, wall]).astype(np.float32),
        height.astype(np.float32),
        np.full(1000, 1.0, np.float32),
    )


@pytest.mark.parametrize("seed", range(5))
def test_a_wall_that_touches_the_table_is_found_where_it_is(seed: int) -> None:
    feet, height, depth = seen(1.2, 1.0, np.random.default_rng(seed))
    (line,) = find_walls(feet, height, depth, WallParameters())
    np.testing.assert_allclose(line, [0, -1, 1.2], atol=0.005)
    inside = in_walls(np.array([line]), feet, depth, WallParameters())
    assert np.mean(inside[600:]) > 0.99
    assert np.mean(inside[:600]) < 0.05


def test_a_wide_box_with_the_table_behind_it_is_no_wall() -> None:
    feet, height, depth = seen(0.8, 1.0, np.random.default_rng(0))
    assert not len(find_walls(feet, height, depth, WallParameters()))


def test_a_narrow_box_at_the_far_edge_is_no_wall() -> None:
    feet, height, depth = seen(1.2, 0.3, np.random.default_rng(0))
    assert not len(find_walls(feet, height, depth, WallParameters()))


def test_two_walls_of_a_corner_are_both_found() -> None:
    rng = np.random.default_rng(1)
    feet, height, depth = seen(1.2, 1.0, rng)
    side = np.column_stack([rng.normal(-0.5, 0.003, 300), rng.uniform(0.4, 1.2, 300)]).astype(np.float32)
    walls = find_walls(
        np.vstack([feet, side]),
        np.append(height, rng.uniform(0, 0.6, 300).astype(np.float32)),
        np.append(depth, np.ones(300, np.float32)),
        WallParameters(),
    )
    assert len(walls) == 2
    np.testing.assert_allclose(walls[np.argsort(-np.abs(walls[:, 1]))], [[0, -1, 1.2], [1, 0, 0.5]], atol=0.01)


@pytest.mark.parametrize(("points", "walls"), [(340, 1), (275, 0)])
def test_a_point_behind_a_line_weighs_against_it_as_much_as_two_on_it(points: int, walls: int) -> None:
    # Of a line with 400 points and 50 behind it, and one with nothing behind it, the one worth more is asked
    # first; the first is no wall, as a tenth and more lies behind it, and with that the search ends.
    rng = np.random.default_rng(3)
    first = np.column_stack([np.full(400, -0.5), rng.uniform(-0.6, 0.6, 400)])
    behind, beside = (
        np.column_stack([rng.uniform(*x, n), np.full(n, 1.2)])
        for x, n in (((-0.9, -0.7), 50), ((-0.3, 0.8), points - 50))
    )
    feet = np.vstack([first, behind, beside]).astype(np.float32)
    every = np.ones(len(feet), np.float32)
    assert len(find_walls(feet, 0.3 * every, 0.5 * every, WallParameters())) == walls


def test_a_line_is_that_of_least_squares_with_the_camera_before_it() -> None:
    points = np.array([[0.0, 1.0], [1.0, 1.2], [2.0, 1.4]])
    for sign in (1, -1):
        line = _fitted_line(sign * points)
        expected = np.array([0.2, -1.0, sign * 1.0]) / np.hypot(0.2, 1.0) * sign
        np.testing.assert_allclose(line, expected, atol=1e-9)
    two = _lines(np.array([[0.0, 1.0], [0, 0]]), np.array([[1.0, 1.0], [0.05, 0.05]]))
    np.testing.assert_allclose(two, [[0, -1, 1]], atol=1e-12)  # nearer than 10 cm there is none


def test_a_walls_points_appear_before_and_behind_it_by_three_deviations_of_depth() -> None:
    parameters, wall = WallParameters(thickness=0.01, depth_noise=0.002), np.array([[0.0, -1.0, 1.2]])
    for depth, reach in ((1.0, 0.016), (2.0, 0.034)):
        feet = np.array([[0.3, 1.2 - reach - 1e-4], [0.3, 1.2 - reach + 1e-4], [0.0, 5.0]], np.float32)
        inside = in_walls(wall, feet, np.full(3, depth, np.float32), parameters)
        assert inside.tolist() == [False, True, True]
    assert not in_walls(np.empty((0, 3)), feet, np.ones(3), parameters).any()
