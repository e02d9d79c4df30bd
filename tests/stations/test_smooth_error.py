"""The smooth error against the Gaussian process that it stands for."""

import numpy as np
import pytest

from riseg_drake.geometry.se3 import exp_se3
from riseg_drake.stations.smooth_error import SmoothErrorParameters, smooth_error

SHAPE = (60, 80)
HERE = exp_se3(np.array([np.pi - 0.2, 0.1, 0.0, 0.4, 0.1, 0.5]))  # looking down, where rotation vectors jump


def fields(count: int, X_WC=HERE, seed: int | None = None, **changes) -> np.ndarray:
    """[count, H, W] errors: of as many sensors, or as many pictures of one."""
    parameters = SmoothErrorParameters(**{"disparity_std": 0.2, **changes})
    return np.array(
        [
            smooth_error(SHAPE, X_WC, parameters, k if seed is None else seed, np.random.default_rng([9, k]))
            for k in range(count)
        ]
    )


def correlation(a: np.ndarray, b: np.ndarray) -> float:
    return float((a * b).mean() / np.sqrt((a**2).mean() * (b**2).mean()))


def test_it_has_its_spread_over_sensors_and_is_centred() -> None:
    errors = fields(120)
    assert errors.std() == pytest.approx(0.2, rel=0.07)
    assert abs(errors.mean()) < 0.02


@pytest.mark.parametrize("distance", [5, 15, 30])
def test_it_is_alike_over_its_width_as_a_squared_exponential_has_it(distance: int) -> None:
    errors = fields(120)
    expected = np.exp(-(distance**2) / (2 * 15.0**2))
    assert correlation(errors[:, :, distance:], errors[:, :, :-distance]) == pytest.approx(expected, abs=0.08)
    assert correlation(errors[:, distance:], errors[:, :-distance]) == pytest.approx(expected, abs=0.08)


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_from_one_view_its_flicker_alone_is_new_in_every_picture(share: float) -> None:
    errors = fields(100, seed=3, flicker=share)
    assert np.var(errors, axis=0).mean() == pytest.approx(share * 0.2**2, rel=0.2, abs=1e-12)


@pytest.mark.parametrize(
    ("V", "exponent"),
    [
        ([0, 0, 0, 0.005, 0, 0], 0.5),
        ([0, 0, 0, 0, 0.006, 0.008], 2.0),
        ([0.009, 0, 0, 0, 0, 0], 0.5),
        ([0, 0.0, 0.018, 0, 0, 0], 2.0),
    ],
    ids=["5 mm", "10 mm", "0.5 degrees", "1 degree"],
)
def test_it_is_another_one_as_the_camera_moves_on(V: list[float], exponent: float) -> None:
    there = HERE @ exp_se3(np.array(V, float))
    X = there.copy()
    X[:3, 3] = HERE[:3, 3] + there[:3, :3] @ np.array(V[3:], float)
    assert correlation(fields(120, flicker=0.0), fields(120, X, flicker=0.0)) == pytest.approx(
        np.exp(-exponent), abs=0.1
    )
