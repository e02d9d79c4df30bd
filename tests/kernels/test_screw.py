"""The kernel beside the exponential of `geometry.se3`."""

import numpy as np
import pytest

from riseg_drake.geometry.se3 import exp_se3, move_points, translation
from riseg_drake.kernels.screw import screwed

CENTRE = np.array([0.1, -0.2, 0.6])


@pytest.mark.parametrize("size", [0.0, 1e-7, 1e-4, 1e-3, 0.3, 2.0])
def test_it_is_the_exponential_about_the_centre(size):
    rng = np.random.default_rng(0)
    for _ in range(20):
        V, X = size * rng.normal(size=6), exp_se3(rng.normal(size=6))
        expected = translation(CENTRE) @ exp_se3(V) @ translation(-CENTRE) @ X
        np.testing.assert_allclose(screwed(V, CENTRE, X), expected, atol=1e-13)


def test_a_turn_leaves_the_centre_where_it_is():
    V = np.array([0.3, -0.1, 0.2, 0, 0, 0])
    np.testing.assert_allclose(move_points(screwed(V, CENTRE, np.eye(4)), CENTRE), CENTRE, atol=1e-15)
