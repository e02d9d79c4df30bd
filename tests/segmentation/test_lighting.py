"""A shadow makes a pattern darker and leaves it the same pattern."""

import numpy as np
import pytest

from riseg_drake.segmentation.lighting import gray_costs

SIGMA = 3.0
PIECE = np.repeat([0, 1], 400)
RELIT = 1.0


def pattern(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).uniform(60, 180, len(PIECE)).astype(np.float32)


def noise(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).normal(0, SIGMA, len(PIECE)).astype(np.float32)


def costs(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    per_variance = np.full(len(before), 1 / SIGMA**2, np.float32)
    return gray_costs(before, after, per_variance, PIECE, 2, cost_max=9.0, relit=RELIT)


def test_in_the_same_light_the_cost_is_the_squared_residual() -> None:
    before, e = pattern(0), noise(1)
    np.testing.assert_allclose(costs(before, before + e), np.minimum((e / SIGMA) ** 2, 9), rtol=1e-3, atol=1e-4)


@pytest.mark.parametrize("light", [0.4, 0.8])
def test_a_piece_in_shadow_costs_what_noise_does_and_the_price_of_another_light(light) -> None:
    before, e = pattern(0), noise(1)
    cost = costs(before, np.where(PIECE == 0, light, 1).astype(np.float32) * before + e)
    assert cost[PIECE == 0].mean() == pytest.approx(1 + RELIT, abs=0.2)
    assert cost[PIECE == 1].mean() == pytest.approx(1, abs=0.2)


def test_another_pattern_is_explained_by_no_light() -> None:
    assert costs(pattern(0), pattern(2)).min(initial=9, where=PIECE == 0) < 9  # some fit by chance
    assert costs(pattern(0), pattern(2)).mean() > 6


def test_what_was_not_found_has_no_cost_and_says_nothing_about_the_rest() -> None:
    before = pattern(0)
    after = 0.5 * before + noise(1)
    after[::3] = np.nan
    cost = costs(before, after)
    assert np.isnan(cost[::3]).all()
    assert np.nanmean(cost) == pytest.approx(1 + RELIT, abs=0.2)
