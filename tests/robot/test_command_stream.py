import os
from collections import deque
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from riseg_drake.pushing.time_law import SpeedLimits, minimum_jerk, rest_to_rest
from riseg_drake.robot.command_limiter import CommandLimits
from riseg_drake.robot.command_stream import (
    LONGEST_STOP,
    ArmStatus,
    CommandParameters,
    CommandStream,
    TipGeometry,
)
from riseg_drake.robot.kinematics import READY, PandaKinematics, tip_pointing_down
from riseg_drake.robot.limits import FR3_LIMITS, PANDA_LIMITS
from riseg_drake.robot.supervisor import MOVE, REFLEX, Cause, Mode

PERIOD = 0.005
ROBOTS = {"panda": PANDA_LIMITS, "fr3": FR3_LIMITS}
TRIALS = int(os.environ.get("RISEG_COMMAND_TRIALS", "20"))
"""Random plans for each robot in the last test; 10000 were run before this was released."""


class Arm:
    """An arm that does what it is told two periods later, with a command path before it."""

    def __init__(self, mode="position", jacobian=None, robot=PANDA_LIMITS):
        self.p_WE = np.array([0.5, 0.0, 0.2])
        tip = TipGeometry(lambda q: self.p_WE, lambda q: np.eye(6, 7) if jacobian is None else jacobian)
        self.parameters = CommandParameters(mode=mode)
        self.stream = CommandStream(self.parameters, tip, robot)
        self.robot = robot
        self.now = 1000.0
        self.status = ArmStatus(self.now, READY.copy(), np.zeros(7), np.zeros(7), MOVE)
        self.image_time = self.now
        self.coming = [READY.copy()] * 2
        self.commands = []  # None where none was sent
        self.silent_status = False
        self.silent_images = False
        self.gap = 0.001  # between two statuses, all of which are seen

    def step(self):
        command = self.stream.step(self.now, self.status, self.image_time)
        self.commands.append(None if command is None else command.copy())
        if command is not None and self.status.robot_mode == MOVE:
            if self.parameters.mode == "velocity":
                command = self.coming[-1] + PERIOD * command
            self.coming.append(command.copy())
        elif command is None:
            self.coming.append(self.coming[-1])  # it holds
        position = self.coming.pop(0) if len(self.coming) > 2 else self.coming[0]
        self.now += PERIOD
        if not self.silent_status:
            self.status = replace(self.status, time=self.now, position=position, gap=self.gap)
            self.gap = 0.001
        if not self.silent_images:
            self.image_time = self.now - 0.05
        return command

    def run(self, seconds):
        for _ in range(round(seconds / PERIOD)):
            self.step()

    def plan(self, q_to):
        limits = SpeedLimits(0.3, 0.25, 0.1)
        path = rest_to_rest(np.linspace(self.status.position, q_to, 12), minimum_jerk, limits, self.robot)
        for t in np.arange(0, path.end_time() + 1, 0.01):
            self.stream.add_target(self.now + t, path.value(min(t, path.end_time()))[:, 0])
        return path

    def sent(self):
        return np.array([command for command in self.commands if command is not None])


def in_motion(mode="position", jacobian=None, robot=PANDA_LIMITS):
    """An arm in the middle of a fast motion."""
    arm = Arm(mode, jacobian, robot)
    arm.step()
    arm.plan(READY + 0.6)
    arm.run(1.3)
    speed = np.abs(np.diff(arm.sent()[-2:], axis=0)).max() / PERIOD
    assert mode == "velocity" or speed > 0.3
    return arm


def stopping_time(arm):
    """Time from now until the last command that moves, s; the arm's stream must have been stopped by then."""
    first = len(arm.commands)
    arm.run(0.6)
    if arm.parameters.mode == "velocity":
        moving = [np.abs(c).max() > 1e-9 for c in arm.commands[first:] if c is not None]
    else:
        # The last difference that is not zero, from the last command before.
        run = [c for c in arm.commands[first - 1 :] if c is not None]
        moving = [np.abs(b - a).max() > 1e-9 for a, b in pairwise(run)]
    assert not arm.stream.state.may_move
    return PERIOD * (max(np.flatnonzero(moving), default=-1) + 1)


def within_limits(positions, robot=PANDA_LIMITS):
    """Whether positions [N, 7] at even periods, from rest, keep the limits of motion and stop."""
    padded = np.vstack([positions[:1]] * 3 + [positions])
    v, a, j = (np.diff(padded, order, axis=0) / PERIOD**order for order in (1, 2, 3))
    return rates_within_limits(padded, v, a, j, robot)


def velocities_within_limits(velocities, positions, robot=PANDA_LIMITS):
    """The same for velocities [N, 7] that were commanded when the plan was at positions [N, 7]."""
    padded = np.vstack([np.zeros((2, 7)), velocities])
    a, j = (np.diff(padded, order, axis=0) / PERIOD**order for order in (1, 2))
    return rates_within_limits(positions, velocities[1:], a, j, robot)


def rates_within_limits(positions, v, a, j, robot):
    limits = CommandLimits()
    # On the way from one position to the next a joint may be as fast as at the better of both.
    lowest, highest = (limits.velocity * bound for bound in robot.velocity_range(positions))
    lowest, highest = np.minimum(lowest[:-1], lowest[1:]), np.maximum(highest[:-1], highest[1:])
    return (
        ((lowest * (1 + 1e-6) - 1e-9 <= v) & (v <= highest * (1 + 1e-6) + 1e-9)).all()
        and (np.abs(a) <= limits.stop_acceleration * robot.acceleration * (1 + 1e-6) + 1e-6).all()
        and (np.abs(j) <= limits.stop_jerk * robot.jerk * (1 + 1e-6) + 1e-3).all()
    )


def test_nothing_is_sent_before_the_arm_has_spoken():
    arm = Arm()
    arm.status = None
    assert arm.stream.step(arm.now, None, arm.now) is None


def test_the_first_command_is_where_the_arm_is():
    arm = Arm()
    arm.status = replace(arm.status, position=READY + 0.123)
    arm.coming = [READY + 0.123] * 2
    np.testing.assert_array_equal(arm.step(), READY + 0.123)


def test_a_motion_arrives():
    arm = in_motion()
    arm.run(4)
    np.testing.assert_allclose(arm.sent()[-1], READY + 0.6, atol=1e-6)
    assert arm.stream.behind == 0
    assert within_limits(arm.sent())


def test_velocity_mode_arrives_and_ends_in_zeros():
    arm = in_motion("velocity")
    arm.run(4)
    np.testing.assert_allclose(arm.status.position, READY + 0.6, atol=1e-3)
    arm = in_motion("velocity")
    arm.stream.end(Cause.FINISHED)
    assert stopping_time(arm) <= 0.3
    np.testing.assert_array_equal(arm.commands[-1], np.zeros(7))


def test_velocity_mode_takes_drift_back():
    arm = Arm("velocity")
    arm.plan(READY)
    arm.run(0.5)
    arm.coming = [q + 0.004 for q in arm.coming]  # something moved the arm a little
    arm.run(5)
    np.testing.assert_allclose(arm.status.position, READY, atol=3e-4)


def reflex(arm):
    arm.status = replace(arm.status, robot_mode=REFLEX)


def user_stop(arm):
    arm.status = replace(arm.status, robot_mode=5)


def old_status(arm):
    arm.silent_status = True
    arm.now += 0.1


def old_images(arm):
    arm.silent_images = True
    arm.image_time = arm.now - 0.5


def force(arm):
    torque = np.zeros(7)
    torque[3] = 20.0
    arm.status = replace(arm.status, torque_external=torque)


def workspace(arm):
    arm.p_WE = np.array([0.5, 0.0, -0.01])


def joint_limit(arm):
    arm.stream._limiter.held_back = True


def interrupt(arm):
    arm.stream.end(Cause.INTERRUPT)


@pytest.mark.parametrize("mode", ["position", "velocity"])
@pytest.mark.parametrize(
    ("happens", "cause"),
    [
        (reflex, Cause.REFLEX),
        (user_stop, Cause.USER_STOP),
        (old_status, Cause.STATUS_OLD),
        (old_images, Cause.IMAGES_OLD),
        (force, Cause.FORCE),
        (workspace, Cause.WORKSPACE),
        (joint_limit, Cause.JOINT_LIMIT),
        (interrupt, Cause.INTERRUPT),
    ],
)
@pytest.mark.parametrize("name", ["panda", pytest.param("fr3", marks=pytest.mark.renders)])
def test_every_cause_brings_the_arm_to_rest_in_time_and_smoothly(happens, cause, mode, name):
    arm = in_motion(mode, robot=ROBOTS[name])
    happens(arm)
    assert stopping_time(arm) <= 0.3
    assert arm.stream.state.cause is cause
    if mode == "position":
        assert within_limits(arm.sent(), ROBOTS[name])
    else:
        change = np.abs(np.diff(arm.sent(), axis=0)) / PERIOD
        assert (change <= CommandLimits().stop_acceleration * ROBOTS[name].acceleration + 1e-6).all()


def test_a_status_that_comes_late_pauses_and_the_motion_goes_on_from_where_it_was():
    arm = in_motion()
    arm.silent_status = True
    arm.run(1)
    assert arm.stream.state.mode is Mode.PAUSED
    assert arm.commands[-1] is None
    arm.silent_status = False  # every one of them comes at last
    arm.run(6)
    np.testing.assert_allclose(arm.sent()[-1], READY + 0.6, atol=1e-6)
    assert within_limits(arm.sent())
    steps = np.diff(arm.sent(), axis=0)
    assert steps.min() > -1e-4  # never back


def test_after_a_reflex_it_is_silent_and_begins_anew_where_the_arm_is_at_the_operators_word():
    arm = in_motion()
    reflex(arm)
    arm.run(1)
    assert arm.commands[-1] is None
    arm.status = replace(arm.status, robot_mode=MOVE)
    arm.run(1)
    assert arm.commands[-1] is None  # recovered, but nobody has said so
    by_hand = arm.status.position + 0.02
    arm.coming = [by_hand] * 2
    arm.step()
    arm.stream.release()
    first = len(arm.commands)
    arm.run(0.05)
    fresh = [c for c in arm.commands[first:] if c is not None]
    np.testing.assert_array_equal(fresh[0], by_hand)
    arm.run(6)
    np.testing.assert_allclose(arm.sent()[-1], READY + 0.6, atol=1e-6)


@pytest.mark.parametrize("mode", ["position", "velocity"])
@pytest.mark.parametrize("happens", [reflex, user_stop])
def test_an_arm_that_is_ready_again_while_its_commands_still_brake_hears_none_once_they_are_at_rest(
    happens, mode
):
    arm = in_motion(mode)
    happens(arm)
    arm.run(0.01)
    arm.status = replace(arm.status, robot_mode=MOVE)
    arm.run(LONGEST_STOP)
    assert arm.stream.state.mode is Mode.STOPPED
    first = len(arm.commands)
    arm.run(0.5)
    assert arm.commands[first:] == [None] * 100


@pytest.mark.parametrize("mode", ["position", "velocity"])
def test_a_word_that_comes_while_the_arm_brakes_waits_until_it_is_at_rest(mode):
    arm = in_motion(mode)
    force(arm)
    arm.run(0.01)
    arm.status = replace(arm.status, torque_external=np.zeros(7))
    arm.stream.release()
    arm.run(6)
    np.testing.assert_allclose(arm.status.position, READY + 0.6, atol=1e-3)
    if mode == "position":
        assert within_limits(arm.sent())
    else:
        change = np.abs(np.diff(arm.sent(), axis=0)) / PERIOD
        assert (change <= CommandLimits().stop_acceleration * PANDA_LIMITS.acceleration + 1e-6).all()


def test_an_arm_that_was_carried_away_is_not_driven_back_unasked():
    arm = in_motion()
    reflex(arm)
    arm.run(1)
    arm.status = replace(arm.status, robot_mode=MOVE)
    arm.coming = [arm.status.position - 0.5] * 2
    arm.step()
    arm.stream.release()
    arm.run(0.5)
    assert arm.stream.state.cause is Cause.GAP


def test_a_plan_that_leads_out_of_a_joints_range_is_a_stop_before_its_end():
    arm = Arm()
    arm.step()
    beyond = READY.copy()
    beyond[3] = PANDA_LIMITS.position_upper[3] + 0.1
    arm.plan(beyond)
    arm.run(15)
    assert arm.stream.state.cause is Cause.JOINT_LIMIT
    assert PANDA_LIMITS.contains(arm.sent()[-1], margin=CommandLimits().position_margin - 1e-6)
    assert arm.sent()[-1][3] > beyond[3] - 0.2  # it got there
    assert within_limits(arm.sent())


def test_a_plan_that_leads_out_of_the_workspace_is_a_stop_within_it():
    kinematics = PandaKinematics()
    arm = Arm()
    lowest = arm.parameters.safety.workspace_lower[2] = 0.03
    arm.stream = CommandStream(
        arm.parameters, TipGeometry(lambda q: kinematics.X_WE(q)[:3, 3], kinematics.tip_jacobian), PANDA_LIMITS
    )
    arm.step()
    down = kinematics.solve_ik(tip_pointing_down([0.48, 0.0, 0.01], 0.0))
    arm.plan(down)
    arm.run(10)
    assert arm.stream.state.cause is Cause.WORKSPACE
    heights = [kinematics.X_WE(q)[2, 3] for q in arm.sent()[::5]]
    assert heights[0] > lowest + 0.02
    assert lowest - 1e-3 < min(heights) < lowest + 0.01
    assert within_limits(arm.sent())
    # A little outside now, where the stop has ended, it goes back at the operator's word, and no further out.
    assert kinematics.X_WE(arm.status.position)[2, 3] < lowest
    arm.stream.abandon_path()
    arm.stream.release()
    arm.stream.begin_path()
    arm.step()
    arm.plan(READY)
    arm.run(8)
    np.testing.assert_allclose(arm.status.position, READY, atol=1e-5)
    arm.plan(down)
    arm.run(10)
    assert arm.stream.state.cause is Cause.WORKSPACE
    assert lowest - 2e-3 < kinematics.X_WE(arm.status.position)[2, 3] < lowest


def test_contact_is_allowed_in_a_push_only():
    jacobian = np.eye(6, 7)
    arm = Arm(jacobian=jacobian)
    arm.step()
    arm.plan(READY + 0.6)
    arm.stream.expect_contact(arm.now, arm.now + 1.0)
    arm.run(1.0)
    torque = np.zeros(7)
    torque[4] = 20.0
    arm.status = replace(arm.status, torque_external=torque)
    arm.run(0.1)
    assert arm.stream.state.may_move
    arm.run(1.0)
    assert arm.stream.state.cause is Cause.FORCE


def test_speeds_from_which_the_arm_could_not_stop_in_time_are_refused():
    with pytest.raises(ValueError, match="lower velocity"):
        CommandParameters(limits=CommandLimits(velocity=1.0, stop_acceleration=0.5)).check(PANDA_LIMITS)
    assert CommandLimits().longest_stop(PANDA_LIMITS) < LONGEST_STOP


def random_trial(seed, robot):
    """Plans and disturbances at random; returns mode, and runs of commands and positions between silences."""
    rng = np.random.default_rng(seed)
    arm = Arm(["position", "velocity"][seed % 2], robot=robot)
    arm.parameters.playout.delay = rng.choice([0.1, 0.3])
    start = np.clip(
        robot.position_middle + rng.uniform(-0.6, 0.6, 7),
        *(robot.position_lower + 0.1, robot.position_upper - 0.1),
    )
    arm.status = replace(arm.status, position=start)
    arm.coming = [start] * 2
    arm.step()
    feed, positions = deque(random_plan(rng, arm, start)), [start]
    burst = rng.choice([0.01, 0.05, 0.3])
    next_burst = arm.now
    for tick in range(rng.integers(150, 450)):
        if arm.now >= next_burst:
            while feed and feed[0][0] <= arm.now:
                arm.stream.add_target(*feed.popleft())
            next_burst = arm.now + burst * rng.uniform(0.5, 1.5)
        chance = rng.random() if tick > 60 else 1.0  # under way by then
        if chance < 0.005:
            arm.silent_status = not arm.silent_status
            arm.gap = rng.choice([0.001, 0.5])
        elif chance < 0.01:
            arm.silent_images = not arm.silent_images
        elif chance < 0.013:
            reflex(arm)
        elif chance < 0.02:
            arm.status = replace(arm.status, robot_mode=MOVE, torque_external=np.zeros(7))
            if arm.stream.off_path > 0.02:
                arm.stream.abandon_path()
                arm.stream.begin_path()
                feed = deque(random_plan(rng, arm, arm.status.position))
            arm.stream.release()
        elif chance < 0.022:
            force(arm)
        elif chance < 0.024 and arm.commands[-1] is None:
            arm.coming = [q + rng.normal(scale=0.1, size=7) for q in arm.coming[:1]] * 2  # moved by hand
        elif chance < 0.0245:
            arm.stream.end(Cause.INTERRUPT)
        arm.now += rng.choice([0.0, 0.0, 0.002, 0.02])  # the process is late
        arm.step()
        limiter = arm.stream._limiter
        positions.append(positions[-1] if limiter is None else limiter.position)
    runs, current = [], []
    for command, position in zip([*arm.commands, None], [*positions, None], strict=True):
        if command is not None:
            current.append((command, position))
        elif current:
            runs.append(tuple(map(np.array, zip(*current, strict=True))))
            current = []
    return arm.stream.mode, runs


def random_plan(rng, arm, start):
    """Targets of a motion from `start` by their times, some too fast, broken, or out of the joints' ranges."""
    goal = start + rng.normal(scale=rng.choice([0.05, 0.3, 1.0]), size=7)
    shares = rng.uniform(0.05, 1.0)
    limits = SpeedLimits(shares, shares, shares)
    everywhere = replace(arm.robot, slowing_down=None)
    path = rest_to_rest(np.linspace(start, goal, 12), minimum_jerk, limits, everywhere)
    jump = rng.random() < 0.2
    for t in np.arange(0, path.end_time() + 1, rng.choice([0.005, 0.01, 0.02])):
        q = path.value(min(t, path.end_time()))[:, 0]
        yield arm.now + t, q + (jump and t > 0.5) * rng.normal(scale=0.03, size=7)


@pytest.mark.parametrize("name", ["panda", pytest.param("fr3", marks=pytest.mark.renders)])
@pytest.mark.parametrize("first", range(0, TRIALS, 20))
def test_random_plans_and_disturbances_never_lead_outside_the_limits(first, name):
    robot, motions = ROBOTS[name], 0
    for seed in range(first, min(first + 20, TRIALS)):
        mode, runs = random_trial(seed, robot)
        for commands, positions in runs:
            if mode == "position":
                assert within_limits(commands, robot), seed
            else:
                assert velocities_within_limits(commands, positions, robot), seed
            if robot.contains(positions[0]):
                assert (robot.room(positions) >= 0).all(), seed
            motions += np.ptp(positions, axis=0).max() > 0.01
    assert motions  # the test has seen some
