"""The control box alone, tick by tick: who may do what in which mode, and how far a tick leads."""

import numpy as np
import pytest

from riseg_drake.robot.kinematics import READY
from riseg_drake.robot.limits import PANDA_LIMITS
from riseg_drake.stations.panda_robot import GUIDING, IDLE, MOVE, REFLEX, USER_STOPPED, PandaRobot

EACH = np.arange(1.0, 8.0)


@pytest.fixture
def robot():
    return PandaRobot(PANDA_LIMITS, np.array(READY))


def test_it_begins_idle_and_at_rest_where_it_is_put(robot):
    assert robot.mode == IDLE
    assert robot.reflex_reason == ""
    np.testing.assert_array_equal(robot.q_d, READY)
    np.testing.assert_array_equal([robot.v_d, robot.a_d], np.zeros((2, 7)))


def test_a_tick_is_a_millisecond_of_the_velocity_and_a_thousandth_of_its_change_back(robot):
    robot.begin_control()
    robot.follow(0.01 * EACH)
    np.testing.assert_allclose(robot.q_d, np.array(READY) + 1e-5 * EACH, rtol=0, atol=1e-15)
    np.testing.assert_allclose(robot.a_d, 10 * EACH)
    robot.follow(0.004 * EACH)
    np.testing.assert_allclose(robot.q_d, np.array(READY) + 1.4e-5 * EACH, rtol=0, atol=1e-15)
    np.testing.assert_allclose(robot.a_d, -6 * EACH)
    np.testing.assert_array_equal(robot.v_d, 0.004 * EACH)


@pytest.mark.parametrize("sign", [1, -1])
def test_it_moves_where_one_joint_is_faster_than_a_milliradian_a_second(robot, sign):
    for speed, moving in ((0.0, False), (0.0009, False), (0.0011, True)):
        robot.v_d = np.array([0, 0, 0, 0, 0, sign * speed, 0])
        assert robot.is_moving is moving


def test_control_is_taken_from_idle_alone_and_given_back_to_idle_alone(robot):
    for mode in (MOVE, GUIDING, REFLEX, USER_STOPPED):
        robot.mode, robot.reflex_reason = mode, "why"
        assert not robot.begin_control()
        assert (robot.mode, robot.reflex_reason) == (mode, "why")
    for mode in (GUIDING, REFLEX, USER_STOPPED):
        robot.mode = mode
        robot.end_control()
        assert robot.mode == mode
    robot.mode = IDLE
    assert robot.begin_control()
    assert (robot.mode, robot.reflex_reason) == (MOVE, "")
    robot.end_control()
    assert robot.mode == IDLE


@pytest.mark.parametrize(
    ("mode", "after"),
    [(MOVE, REFLEX), (IDLE, REFLEX), (GUIDING, GUIDING), (REFLEX, REFLEX), (USER_STOPPED, USER_STOPPED)],
)
def test_a_reflex_stops_what_is_not_stopped_already_and_keeps_its_first_reason(robot, mode, after):
    robot.mode, robot.reflex_reason = mode, "first"
    robot.enter_reflex("second")
    assert robot.mode == after
    assert robot.reflex_reason == ("second" if mode in (MOVE, IDLE) else "first")


def test_only_a_stop_is_recovered_from(robot):
    for mode, after in ((REFLEX, IDLE), (USER_STOPPED, IDLE), (MOVE, MOVE), (GUIDING, GUIDING)):
        robot.mode = mode
        robot.recover()
        assert robot.mode == after


@pytest.mark.parametrize("side", ["lower", "upper"])
def test_a_joint_that_leaves_its_range_is_a_reflex_of_that_tick(robot, side):
    sign = 1 if side == "upper" else -1
    robot.begin_control()
    robot.q_d[0] = getattr(PANDA_LIMITS, f"position_{side}")[0] - sign * 1.5e-3
    robot.follow(np.array([sign * 1.0, 0, 0, 0, 0, 0, 0]))
    assert robot.mode == MOVE
    robot.follow(np.array([sign * 1.0, 0, 0, 0, 0, 0, 0]))
    assert (robot.mode, robot.reflex_reason) == (REFLEX, "joint_position_limits_violation")


def test_the_hand_leads_at_its_speed_slows_down_and_lets_go_where_it_wanted(robot):
    goal = np.add(READY, [0.2, 0, 0, -0.1, 0, 0.02, 0])
    robot.guide(goal)
    assert robot.mode == GUIDING
    fastest, ticks = np.zeros(7), 0
    while robot.mode == GUIDING and ticks < 5000:
        ticks += 1
        way = goal - robot.q_d
        robot.stand()
        fastest = np.maximum(fastest, np.abs(robot.v_d))
        # Nearer than 15 mrad the speed is ten times the way, once the brake is off.
        if 0.0005 < abs(way[0]) < 0.015:
            assert robot.v_d[0] == pytest.approx(10 * way[0], rel=0.15)
    assert robot.mode == IDLE
    assert fastest[[0, 3]] == pytest.approx([0.3, 0.3], rel=1e-3)
    assert fastest[5] <= 0.2001
    # When all are within 0.1 mrad, and not before.
    assert np.abs(goal - robot.q_d).max() < 1.1e-4
    # 0.17 rad at 0.3 rad/s, then from 30 mrad to 0.1 mrad by a tenth of a second's decay.
    assert ticks == pytest.approx(1000 * (0.17 / 0.3 + 0.1 * np.log(0.03 / 1e-4)), rel=0.1)
    for _ in range(200):
        robot.stand()
    assert not robot.is_moving


def test_what_was_guided_is_as_it_was_before_even_if_two_hands_take_it(robot):
    robot.enter_reflex("cartesian_reflex")
    robot.guide(np.array(READY) + 0.05)
    robot.guide(np.array(READY))
    robot.stand()
    robot.stand()
    assert (robot.mode, robot.reflex_reason) == (REFLEX, "cartesian_reflex")


def test_nobody_guides_what_is_controlled_nor_beyond_the_limits(robot):
    with pytest.raises(ValueError, match="cannot go there"):
        robot.guide(PANDA_LIMITS.position_upper + 0.01)
    robot.begin_control()
    with pytest.raises(ValueError, match="controlled"):
        robot.guide(np.array(READY))
    assert robot.mode == MOVE


def test_the_stop_button_takes_the_arm_out_of_the_hand(robot):
    robot.guide(np.array(READY) + 0.05)
    for _ in range(30):
        robot.stand()
    robot.user_stop()
    for _ in range(300):
        robot.stand()
    rest = robot.q_d.copy()
    robot.stand()
    np.testing.assert_array_equal(robot.q_d, rest)
    assert robot.mode == USER_STOPPED
    assert np.abs(rest - READY).max() < 0.02
