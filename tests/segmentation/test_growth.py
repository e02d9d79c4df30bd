"""Growing by similar flow, against a search written as the paper writes it."""

from collections import deque
from dataclasses import replace

import numpy as np
import pytest

from riseg_drake.segmentation.bfif import no_groups
from riseg_drake.segmentation.growth import grow_by_similar_flow
from riseg_drake.segmentation.motions import BFIFGroups

SIMILAR = 0.35


def seeded(pixels: list[tuple[int, int]], groups: list[int]) -> BFIFGroups:
    """Groups that consist of seeds (v, u) alone."""
    return replace(no_groups(), pixel=np.array(pixels, np.intp).reshape(-1, 2), group=np.array(groups, np.intp))


def searched(flow: np.ndarray, moving: np.ndarray, seed: tuple[int, int]) -> np.ndarray:
    """Breadth first from one seed over moving neighbours of similar flow."""
    reached = np.zeros(moving.shape, bool)
    reached[seed] = True
    queue = deque([seed])
    while queue:
        v, u = queue.popleft()
        for a, b in ((v - 1, u), (v + 1, u), (v, u - 1), (v, u + 1)):
            inside = 0 <= a < moving.shape[0] and 0 <= b < moving.shape[1]
            if not inside or reached[a, b] or not moving[a, b]:
                continue
            if np.linalg.norm(flow[a, b] - flow[v, u]) < SIMILAR:
                reached[a, b] = True
                queue.append((a, b))
    return reached


@pytest.mark.parametrize("draw", range(8))
def test_one_seed_grows_to_what_breadth_first_search_reaches(draw: int) -> None:
    rng = np.random.default_rng(draw)
    flow = rng.choice([0.0, 2.0], (24, 30, 1), p=[0.25, 0.75]) + rng.uniform(-0.1, 0.1, (24, 30, 2))
    moving = rng.uniform(size=(24, 30)) < 0.85
    flow[~moving & (rng.uniform(size=moving.shape) < 0.3)] = np.nan
    seed = tuple(np.argwhere(moving)[rng.integers(moving.sum())])
    grown = grow_by_similar_flow(flow, moving, seeded([seed], [0]), SIMILAR)
    np.testing.assert_array_equal(grown > 0, searched(flow, moving, seed))
    np.testing.assert_array_equal(np.unique(grown[grown > 0]), [1])


def test_flow_that_changes_gently_is_one_piece_however_much_it_changes() -> None:
    flow = np.stack(np.broadcast_arrays(np.arange(40) * 0.2, np.zeros((10, 1))), axis=-1)
    grown = grow_by_similar_flow(flow, np.ones((10, 40), bool), seeded([(3, 1)], [0]), SIMILAR)
    assert (grown == 1).all()


def test_two_bodies_that_touch_are_grown_apart_by_the_step_in_flow() -> None:
    flow = np.zeros((20, 40, 2))
    flow[:, :22, 0], flow[:, 22:, 1] = 2.0, 3.0
    seeds = seeded([(4, 4), (15, 10), (10, 35)], [1, 1, 0])
    grown = grow_by_similar_flow(flow, np.ones((20, 40), bool), seeds, SIMILAR)
    assert (grown[:, :22] == 2).all()
    assert (grown[:, 22:] == 1).all()


def test_a_piece_that_two_groups_claim_goes_to_the_nearest_seed() -> None:
    moving = np.ones((9, 40), bool)
    grown = grow_by_similar_flow(np.zeros((9, 40, 2)), moving, seeded([(4, 5), (4, 30)], [0, 1]), SIMILAR)
    assert (grown[:, :15] == 1).all()
    assert (grown[:, 21:] == 2).all()


def test_nothing_grows_without_a_seed_nor_from_a_seed_of_no_group() -> None:
    moving = np.ones((9, 12), bool)
    flow = np.zeros((9, 12, 2))
    assert not grow_by_similar_flow(flow, moving, seeded([], []), SIMILAR).any()
    assert not grow_by_similar_flow(flow, moving, seeded([(2, 2)], [-1]), SIMILAR).any()
