from types import SimpleNamespace

import numpy as np
import pytest

from riseg_drake.pushing.push_planning import _heading
from riseg_drake.robot.kinematics import READY


def fixed_at(towards_W):
    """Only what the heading asks for: a camera fixed to the world that looks along a direction."""
    X_WC = np.eye(4)
    X_WC[:3, 2] = np.array(towards_W) / np.linalg.norm(towards_W)
    return SimpleNamespace(fixed_camera=X_WC)


def test_a_camera_on_the_wrist_sees_a_push_best_straight_ahead_of_the_tool(panda):
    np.testing.assert_allclose(_heading(panda, READY), [1.0, 0.0], atol=1e-9)
    turned = READY + np.array([0.4, 0, 0, 0, 0, 0, 0])
    np.testing.assert_allclose(_heading(panda, turned), [np.cos(0.4), np.sin(0.4)], atol=1e-9)


@pytest.mark.parametrize(
    ("looks_along", "heading"),
    [([-1.0, 0.0, -1.0], [1.0, 0.0]), ([0.0, 3.0, -4.0], [0.0, -1.0]), ([-0.3, 0.4, -0.2], [0.6, -0.8])],
)
def test_a_fixed_camera_sees_best_what_is_pushed_towards_it(looks_along, heading):
    np.testing.assert_allclose(_heading(fixed_at(looks_along), READY), heading, atol=1e-12)


def test_for_a_camera_straight_above_no_direction_is_better_than_another():
    assert _heading(fixed_at([0.0, 0.05, -1.0]), READY) is None
