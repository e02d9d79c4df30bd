"""A surface in another light is darker or brighter by one factor and keeps its pattern."""

import numpy as np
import pytest
from riseg_drake.segmentation.lighting import gray_costs

SIGMA = 3.0
PIECE = np.repeat([0, 1], 400)
CERTAINTY = 2400.0
"""6 / 0.05^2: a factor of 0.95 or 1.05 costs 6 squared residuals."""


def pattern(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).uniform(60, 180, len(PIECE)).astype(np.float32)


def noise(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).normal(0, SIGMA, len(PIECE)).astype(np.float32)


def costs(before: np.ndarray, after: np.ndarray, certainty: float = CERTAINTY) -> np.ndarray:
    per_variance = np.full(len(before), 1 / SIGMA**2, np.float32)
    return gray_costs(before, after, per_variance, PIECE, np.bincount(PIECE), cost_max=9.0, certainty=certainty)


def test_where_the_light_never_changes_the_cost_is_the_squared_residual() -> None:
    before, e = pattern(0), noise(1)
    cost = costs(before, before + e, certainty=1e12)
    np.testing.assert_allclose(cost, np.minimum((e / SIGMA) ** 2, 9), rtol=1e-3, atol=1e-3)


@pytest.mark.parametrize("light", [0.4, 0.8, 1.05])
def test_a_piece_in_another_light_costs_what_noise_does_and_once_the_price_of_that_light(light: float) -> None:
    before, e = pattern(0), noise(1)
    cost = costs(before, np.where(PIECE == 0, light, 1).astype(np.float32) * before + e)
    of_noise = np.bincount(PIECE, np.minimum((e / SIGMA) ** 2, 9))
    price = CERTAINTY * (1 - light) ** 2
    assert cost[PIECE == 0].sum() == pytest.approx(of_noise[0] / max(light, 1) ** 2 + price, rel=0.02)
    assert cost[PIECE == 1].sum() == pytest.approx(of_noise[1], rel=0.02)


def test_the_factor_is_the_likeliest_one() -> None:
    # One pixel that went from 100 to 90: (90 - 100 f)^2 + c (f - 1)^2 is least at f = (9000 + c) / (10000 + c).
    after = np.full(len(PIECE), 100, np.float32)
    after[0] = np.float32(90)
    one = np.arange(len(PIECE))
    cost = gray_costs(
        np.full(len(PIECE), 100, np.float32),
        after,
        np.ones(len(PIECE), np.float32),
        one,
        np.bincount(one),
        1e4,
        1e4,
    )
    assert cost[0] == pytest.approx((90 - 95) ** 2 + 1e4 * 0.05**2)
    np.testing.assert_array_equal(cost[1:], 0)


def test_another_pattern_is_explained_by_no_light() -> None:
    assert costs(pattern(0), pattern(2)).min(initial=9, where=PIECE == 0) < 9  # some fit by chance
    assert costs(pattern(0), pattern(2)).mean() > 6


def test_what_was_not_found_has_no_cost_and_says_nothing_about_the_rest() -> None:
    before = pattern(0)
    after = 0.5 * before + noise(1)
    after[::3] = np.nan
    cost = costs(before, after)
    assert np.isnan(cost[::3]).all()
    found = np.count_nonzero(np.isfinite(cost))
    assert np.nansum(cost) == pytest.approx(found + 2 * CERTAINTY * 0.25, rel=0.1)
