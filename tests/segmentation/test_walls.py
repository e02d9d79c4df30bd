"""Walls on the plane of a table, seen from the origin: found where nothing is behind them, and only there."""

import numpy as np
import pytest

from riseg_drake.segmentation.walls import WallParameters, find_walls, in_walls


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
