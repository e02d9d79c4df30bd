"""What planning hands on: the camera's view as a map, the heading, the tried pushes, the arm's path."""

from types import SimpleNamespace

import numpy as np
import pytest

from riseg_drake.pushing import push_planning
from riseg_drake.pushing.push import NO_PUSH
from riseg_drake.pushing.push_planning import PushPlanningParameters, _heading, plan_push
from riseg_drake.robot.kinematics import READY
from tests.pushing.bar import BAR

Q = np.arange(7.0)


class Arm:
    """Its tip's x axis is not level, and so shorter from above."""

    fixed_camera, tool = None, BAR

    def X_WE(self, q):
        assert q is Q
        X_WE = np.eye(4)
        X_WE[:3, 0] = [0.3, -0.4, np.sqrt(0.75)]
        return X_WE


@pytest.fixture
def asked(monkeypatch):
    """What each of the three steps was given, and what it gave."""
    given = {}

    def step(name):
        def calc(*arguments):
            given[name] = arguments
            return name

        return calc

    for name in ("map_table", "find_action", "plan_push_path"):
        monkeypatch.setattr(push_planning, name, step(name))
    return given


def test_each_step_gets_what_it_asks_for_and_the_heading_is_the_tip_s_level_direction(asked):
    parameters, arm, rng, tried = PushPlanningParameters(), Arm(), np.random.default_rng(0), ("tried",)
    assert plan_push("frame", "above", "mask", Q, arm, rng, tried, parameters, "found") == "find_action"
    assert asked["map_table"] == ("frame", "above", "mask", parameters.action.table, "found")
    known, generator, tool, action, path_of = asked["find_action"]
    assert (known.table, known.tried, generator) == ("map_table", tried, rng)
    assert tool is arm.tool
    assert action is parameters.action
    np.testing.assert_allclose(known.heading_W, [0.6, -0.8])
    assert path_of("push") == "plan_push_path"
    assert asked["plan_push_path"] == ("push", arm, Q, parameters.path)


def test_without_parameters_the_defaults_are_taken_and_given_ones_are_not_replaced(asked):
    plan_push("frame", "above", "mask", Q, Arm(), np.random.default_rng(0))
    assert asked["find_action"][3] == PushPlanningParameters().action
    assert asked["map_table"][4] is None
    given = PushPlanningParameters()
    given.action.paths = 3
    plan_push("frame", "above", "mask", Q, Arm(), np.random.default_rng(0), parameters=given)
    assert asked["find_action"][3].paths == 3


def test_no_push_has_the_shapes_of_a_push_and_can_never_be_the_cheapest():
    assert [part.shape for part in (NO_PUSH.p_WE, NO_PUSH.direction_W, NO_PUSH.p_WB)] == [(3,), (2,), (3,)]
    assert NO_PUSH.center_W.shape == (2,)
    assert NO_PUSH.cluster_W.shape == (0, 2)
    for part in (NO_PUSH.p_WE, NO_PUSH.direction_W, NO_PUSH.p_WB, NO_PUSH.center_W):
        np.testing.assert_array_equal(part, 0)
    assert (NO_PUSH.length, NO_PUSH.d_push, NO_PUSH.tip_height, NO_PUSH.tallest) == (0, 0, 0, 0)
    assert NO_PUSH.cost == np.inf
    assert NO_PUSH.path is None


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
