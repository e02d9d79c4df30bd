"""The arm's path of one push, by the arm's own forward kinematics."""

from dataclasses import replace

import numpy as np
import pytest

from riseg_drake.pushing.arm_path import ArmPhase, PushPath
from riseg_drake.pushing.decision import PathStage
from riseg_drake.pushing.find_action import find_action
from riseg_drake.pushing.push import NO_PUSH
from riseg_drake.pushing.push_path import PushPathParameters, plan_push_path
from riseg_drake.pushing.pusher import PusherParameters
from riseg_drake.pushing.tried_pushes import KnownScene
from riseg_drake.robot.kinematics import observation_posture, observe_pose
from riseg_drake.robot.limits import PANDA_LIMITS
from tests.pushing.bar import BAR


@pytest.fixture(scope="module")
def q_observe(panda):
    return panda.solve_ik(observe_pose([0.5, 0.0, 0.0], 0.5, panda.X_EC))


def planned(drawn, panda, q_observe):
    push = find_action(
        KnownScene(drawn.map()),
        np.random.default_rng(0),
        BAR,
        plan_path=lambda push: plan_push_path(push, panda, q_observe),
    ).push
    assert push is not NO_PUSH
    return push


@pytest.fixture(scope="module")
def push(new_table, panda, q_observe):
    drawn = new_table()
    drawn.box(0.5, 0.08, 0.05, 0.04, yaw=0.5, height=0.015).box(0.42, 0.08, 0.03, 0.06)
    return planned(drawn.box(0.56, 0.04, 0.03, 0.06), panda, q_observe)


def samples(path, step=0.005):
    return np.arange(0.0, path.duration, step)


def test_path_stays_within_the_joints_limits_at_every_sample(push):
    time = samples(push.path, 0.002)
    q = push.path.trajectory.vector_values(time).T
    assert (PANDA_LIMITS.room(q) >= 0.05 - 1e-3).all()
    bounds = (PANDA_LIMITS.velocity, PANDA_LIMITS.acceleration, PANDA_LIMITS.jerk)
    for order, bound in enumerate(bounds, 1):
        rate = push.path.trajectory.MakeDerivative(order).vector_values(time)
        assert (np.abs(rate).max(axis=1) <= 0.65 * bound).all()


def test_velocity_and_acceleration_have_no_jumps(push):
    time = samples(push.path, 0.001)
    for order, largest in ((1, PANDA_LIMITS.acceleration), (2, PANDA_LIMITS.jerk)):
        rate = push.path.trajectory.MakeDerivative(order).vector_values(time)
        assert (np.abs(np.diff(rate)).max(axis=1) <= 0.001 * largest).all()


def test_path_begins_and_ends_at_the_observation_posture(push, q_observe):
    assert push.path.position(0.0) == pytest.approx(q_observe)
    assert push.path.position(push.path.duration + 1.0) == pytest.approx(q_observe)


def test_tip_keeps_to_the_line_of_the_push_at_the_speed_of_the_push(push, panda):
    path, ahead_W = push.path, np.append(push.direction_W, 0.0)
    travelled = []
    for time in np.linspace(path.push_start, path.push_end, 60):
        X_WE = panda.X_WE(path.position(time))
        offset = X_WE[:3, 3] - push.p_WE
        travelled.append(offset @ ahead_W)
        assert np.linalg.norm(offset - travelled[-1] * ahead_W) < 5e-4
        np.testing.assert_allclose(X_WE[:3, 0], ahead_W, atol=2e-3)
        np.testing.assert_allclose(X_WE[:3, 2], [0, 0, -1], atol=2e-3)
    assert travelled[0] == pytest.approx(0.0, abs=1e-5)
    assert travelled[-1] == pytest.approx(0.01 + 0.02, abs=1e-5)
    step = (path.push_end - path.push_start) / 59
    assert np.diff(travelled).max() / step == pytest.approx(0.02, rel=0.03)


def test_tip_never_comes_below_its_floor_and_crosses_above_everything(push, panda):
    path = push.path
    lowest = np.inf
    for time in samples(path, 0.02):
        X_WE = panda.X_WE(path.position(time))
        lowest = min(lowest, X_WE[2, 3])
        if np.linalg.norm(X_WE[:2, 3] - push.p_WE[:2]) > push.length + 1e-3:
            assert X_WE[2, 3] >= push.tallest + 0.01
    assert lowest == pytest.approx(push.tip_height, abs=2e-4)
    assert lowest >= PusherParameters().lowest_tip_height - 2e-4


@pytest.mark.parametrize(("height", "tip"), [(0.005, 0.00225), (0.007, 0.00315)])
def test_low_things_are_pushed_with_a_tip_as_low_as_they_are_and_room_below_it(
    drawn, panda, q_observe, height, tip
):
    push = planned(drawn.box(0.5, 0.0, 0.05, 0.04, height=height), panda, q_observe)
    lowest = min(panda.clearance(push.path.position(time)) for time in samples(push.path, 0.02))
    assert push.tip_height == pytest.approx(tip)
    assert lowest == pytest.approx(tip, abs=2e-4)
    assert lowest < 0.004  # that it is the tip, not the arm, that comes this close


def test_descent_is_straight_down(push, panda):
    path = push.path
    for time in samples(path, 0.02):
        p_WE = panda.X_WE(path.position(time))[:3, 3]
        if p_WE[2] < push.tallest + 0.005 and path.phase(time) is ArmPhase.APPROACH:
            assert np.linalg.norm(p_WE[:2] - push.p_WE[:2]) < 5e-4


def test_arm_keeps_clear_of_the_table_and_of_itself(push, panda):
    for time in samples(push.path, 0.05):
        assert panda.clearance(push.path.position(time)) >= 0.003


def test_phases_follow_each_other(push):
    phases = [push.path.phase(time) for time in samples(push.path)]
    order = [ArmPhase.APPROACH, ArmPhase.PUSH, ArmPhase.RETREAT]
    assert [p for p, before in zip(phases, [None, *phases], strict=False) if p != before] == order


def test_tip_rises_first_where_the_observation_posture_is_lower_than_things(push, panda, q_observe):
    tall = replace(push, tallest=0.16)
    path = plan_push_path(tall, panda, q_observe)
    heights = [panda.X_WE(path.position(time)) for time in samples(path, 0.02)]
    for X_WE in heights:
        away = min(np.linalg.norm(X_WE[:2, 3] - p_W[:2]) for p_W in (push.p_WE, panda.X_WE(q_observe)[:3, 3]))
        assert away < push.length + 1e-3 or X_WE[2, 3] > 0.17


def test_with_one_side_of_the_tool_or_the_other_the_arm_pushes_every_way(push, panda, q_observe):
    fronts, backs = [], []
    for yaw in np.deg2rad(np.arange(-180, 180, 40)):
        for x, y in ((0.38, 0.12), (0.6, -0.12)):
            along = np.array([np.cos(yaw), np.sin(yaw)])
            at = replace(push, p_WE=np.array([x, y, push.p_WE[2]]), direction_W=along)
            front, back = (
                isinstance(plan_push_path(replace(at, turned=turned), panda, q_observe), PushPath)
                for turned in (False, True)
            )
            assert front or back
            fronts.append(front)
            backs.append(back)
    assert not all(fronts)
    assert not all(backs)


def test_with_its_back_the_tool_goes_the_same_way_turned_by_half_a_turn(push, panda, q_observe):
    aside = replace(push, direction_W=np.array([0.0, -1.0]), p_WE=np.array([0.5, -0.12, push.p_WE[2]]))
    ways = [plan_push_path(replace(aside, turned=turned), panda, q_observe) for turned in (False, True)]
    assert all(isinstance(way, PushPath) for way in ways)
    for share in (0.0, 0.3, 1.0):
        times = [way.push_start + share * (way.push_end - way.push_start) for way in ways]
        X_WE, X_WTurned = (panda.X_WE(way.position(time)) for way, time in zip(ways, times, strict=True))
        np.testing.assert_allclose(X_WTurned[:3, 3], X_WE[:3, 3], atol=1e-4)
        np.testing.assert_allclose(X_WE[:3, :3].T @ X_WTurned[:3, :3], np.diag([-1.0, -1.0, 1.0]), atol=1e-3)


@pytest.mark.parametrize("x", [0.95, 0.05])
def test_push_out_of_reach_has_no_path(push, panda, q_observe, x):
    assert plan_push_path(replace(push, p_WE=np.array([x, 0.1, 0.008])), panda, q_observe) is PathStage.POSTURE


def test_things_as_tall_as_the_pusher_are_not_pushed(push, panda, q_observe):
    assert plan_push_path(replace(push, tallest=0.27), panda, q_observe) is PathStage.ROOM_BELOW_THE_FLANGE


@pytest.fixture(scope="module")
def q_leaning(panda):
    return observation_posture(panda, [0.5, 0.0], 0.5, pitch=np.pi / 4)


@pytest.fixture(scope="module")
def push_from_45_degrees(new_table, panda, q_leaning):
    return planned(new_table().box(0.5, 0.03, 0.05, 0.04, yaw=0.5), panda, q_leaning)


def test_from_a_view_at_45_degrees_the_tool_is_set_upright_on_the_way_over_things(
    push_from_45_degrees, panda, q_leaning
):
    push, path = push_from_45_degrees, push_from_45_degrees.path
    assert path.position(0.0) == pytest.approx(q_leaning)
    assert path.position(path.duration) == pytest.approx(q_leaning)
    leans = []
    for time in samples(path, 0.02):
        X_WE = panda.X_WE(path.position(time))
        leans.append(np.arccos(np.clip(-X_WE[2, 2], -1, 1)))
        if X_WE[2, 3] < push.tallest + 0.005:
            assert leans[-1] < 5e-3
            assert np.linalg.norm(X_WE[:2, 3] - push.p_WE[:2]) < push.length + 1e-3
    assert leans[0] == pytest.approx(np.pi / 4, abs=1e-6)
    # Steadily, never by more than the joints' own speed allows in 20 ms.
    assert np.abs(np.diff(leans)).max() < 0.03


def test_from_a_view_at_45_degrees_no_joint_leaps_and_the_arm_keeps_clear(push_from_45_degrees, panda):
    q = push_from_45_degrees.path.trajectory.vector_values(samples(push_from_45_degrees.path, 0.02)).T
    assert np.abs(np.diff(q, axis=0)).max() < 0.04
    assert all(panda.clearance(each) >= 0.003 for each in q[::3])


@pytest.mark.parametrize("leaning", [False, pytest.param(True, marks=pytest.mark.renders)])
def test_reaches_pushes_all_over_the_work_area(drawn, panda, q_observe, q_leaning, leaning):
    # Pushes towards the robot are partly out of reach: the camera ahead would be in the forearm's place.
    q_from = q_leaning if leaning else q_observe
    planned_count = 0
    start = np.array([[0.38, -0.15], [0.38, 0.15], [0.62, -0.15], [0.62, 0.15], [0.5, 0.0]])
    template = planned(drawn.disc(0.5, 0.0, 0.03), panda, q_observe)
    for p_W in start:
        for angle in np.arange(8) * np.pi / 4:
            push = replace(
                template,
                p_WE=np.append(p_W, 0.008),
                direction_W=np.array([np.cos(angle), np.sin(angle)]),
            )
            planned_count += isinstance(plan_push_path(push, panda, q_from), PushPath)
    assert planned_count >= (20 if leaning else 26)


def test_path_that_takes_too_long_is_no_path(push, panda, q_observe):
    aside = replace(push, direction_W=np.array([0.0, -1.0]), p_WE=np.array([0.5, -0.12, push.p_WE[2]]))
    path = plan_push_path(aside, panda, q_observe)
    only = PushPathParameters(postures=1)
    for longest, stage in ((path.duration + 0.01, None), (path.duration - 0.01, PathStage.DURATION)):
        told = plan_push_path(aside, panda, q_observe, replace(only, longest=longest))
        assert told is stage if stage else isinstance(told, PushPath)


def test_where_one_posture_leads_nowhere_another_is_tried(panda, q_observe):
    push = replace(NO_PUSH, p_WE=np.array([0.5, 0.0, 0.008]), direction_W=np.array([0.0, 1.0]))
    push = replace(push, tip_height=0.008, length=0.03, tallest=0.05)
    one = PushPathParameters(postures=1)
    assert plan_push_path(push, panda, q_observe, one) is PathStage.DESCENT
    path = plan_push_path(push, panda, q_observe, replace(one, postures=4))
    assert isinstance(path, PushPath)
    # Of several that lead nowhere the nearest one's reason is told: the stroke alone takes longer than that.
    none = replace(one, postures=4, longest=1.5)
    assert plan_push_path(push, panda, q_observe, none) is PathStage.DESCENT
    np.testing.assert_allclose(panda.X_WE(path.position(path.push_start))[:3, 3], push.p_WE, atol=1e-4)


def test_no_joint_leaps_between_samples(push):
    q = push.path.trajectory.vector_values(samples(push.path, 0.02)).T
    assert np.abs(np.diff(q, axis=0)).max() < 0.04


def test_slower_limits_take_longer(push, panda, q_observe):
    slow = PushPathParameters(longest=60.0)
    slow.limits.velocity = 0.2
    path = plan_push_path(push, panda, q_observe, slow)
    assert path.duration > push.path.duration
