"""Whatever comes in and whatever goes wrong, on a clock that the test turns: the arm goes on or brakes."""

import os
from collections import Counter

import numpy as np
import pytest
from drake import lcmt_panda_status

from riseg_drake.robot.command_stream import CommandParameters, CommandStream
from riseg_drake.robot.kinematics import READY
from riseg_drake.robot.limits import PANDA_LIMITS
from riseg_drake.robot.supervisor import Cause, Mode, SafetyParameters
from riseg_drake.robot.tip_geometry import TipGeometry
from riseg_drake.stations.command_session import LONGEST_DEAF, CommandSession
from riseg_drake.stations.ideal_arm import status_message
from tests.stations.mutated_messages import (
    NEVER_NOW,
    WRONG_STAMPS,
    mutated_picture,
    mutated_status,
    picture_message,
)

TRIALS = int(os.environ.get("RISEG_MESSAGE_TRIALS", "6"))
"""Sessions in the trial of messages, of 1700 mutated ones each, or 24,000 in a flood; 60 make 100,000."""
WALL, STEADY, PERIOD = 1_700_000_000.0, 5000.0, 0.005
NOTICED = 0.1 + 2 * PERIOD
"""A danger is noticed within `status_age`, and two periods."""
SWING = 0.25 * np.array([1, 0.7, -1, 0.7, 1, -1, 1])  # rad; up to 0.4 rad/s


def slow(case):
    """One more of the same kind, which the fast tests leave out."""
    return pytest.param(case, marks=pytest.mark.renders)


class Arm:
    """An arm that follows commands two periods later, with driver, camera, and a session that moves it."""

    def __init__(self, mode="velocity"):
        tip = TipGeometry(lambda q: np.array([0.5, 0.0, 0.2]), lambda q: np.eye(6, 7, 1))
        self.parameters = CommandParameters(mode=mode)
        self.stream = CommandStream(self.parameters, tip, PANDA_LIMITS)
        self.session = CommandSession(self.stream, STEADY, "PANDA_STATUS", "IMAGES")
        self.now, self.set_by = 0.0, 0.0
        self.targets = 0
        self.position, self.coming = READY.copy(), [np.zeros(7)] * 2
        self.robot_mode, self.torque = lcmt_panda_status.kMove, np.zeros(7)
        self.speaks = self.shows = True
        self.commands = []

    @property
    def wall(self):
        return WALL + self.now + self.set_by

    @property
    def speed(self):
        """That it is told to have, of the fastest joint, rad/s; 0 where it is told nothing."""
        return np.abs(self.coming[-1]).max()

    def status(self, before=0.0):
        """What the driver says of a moment ago, s."""
        message = status_message(self.wall - before, self.position, self.robot_mode)
        message.joint_torque_external = self.torque.tolist()
        message.robot_utime = round(1e6 * (self.now - before))
        return message

    def round(self):
        """One period: targets, news, and a command."""
        while 0.01 * self.targets <= self.now:
            t = 0.01 * self.targets
            self.session.obey("target", t, READY + SWING * (1 - np.cos(2 * np.pi * t / 4)))
            self.targets += 1
        if self.speaks:
            self.session.hear_status(self.status().encode())
        if self.shows:
            self.session.hear_picture(picture_message(self.wall).encode())
        command = self.session.next(STEADY + self.now, self.wall)
        if command is not None:
            self.session.was_sent(command)
            self.commands.append(command.values)
            self.coming.append(self.velocities()[-1])
        else:
            self.coming.append(np.zeros(7))
        self.position = self.position + PERIOD * self.coming.pop(0)
        self.now += PERIOD

    def run(self, seconds):
        for _ in range(round(seconds / PERIOD)):
            self.round()
        return self

    def velocities(self):
        """Of all commands so far, [N, 7], rad/s; the arm was at rest before them."""
        commands = np.array(self.commands)
        if self.parameters.mode == "velocity":
            return commands
        return np.diff(commands, axis=0, prepend=commands[:1]) / PERIOD

    def keeps_limits(self):
        """Whether no command was beyond the velocity of motions, and the acceleration and jerk of stops."""
        limits, v = self.parameters.limits, self.velocities()
        v = np.vstack([np.zeros((2, 7)), v])
        a, j = np.diff(v, axis=0) / PERIOD, np.diff(v, 2, axis=0) / PERIOD**2
        return (
            (np.abs(v) <= limits.velocity * PANDA_LIMITS.velocity * (1 + 1e-6) + 1e-9).all()
            and (np.abs(a) <= limits.stop_acceleration * PANDA_LIMITS.acceleration * (1 + 1e-6) + 1e-6).all()
            and (np.abs(j) <= limits.stop_jerk * PANDA_LIMITS.jerk * (1 + 1e-6) + 1e-3).all()
        )


def test_the_time_that_a_process_takes_to_get_ready_is_not_taken_for_the_end_of_a_driver():
    arm = Arm()
    arm.session.hear_status(arm.status().encode())  # LCM keeps the first that comes, and only that
    arm.now, arm.speaks = 0.6, False
    arm.session.set_out(STEADY + arm.now)
    arm.round()
    arm.speaks = True
    arm.run(0.1)
    assert arm.stream.state.mode is Mode.FOLLOWING


def swinging(mode="velocity"):
    """In the middle of a fast motion."""
    arm = Arm(mode).run(1.6)
    assert arm.speed > 0.3
    assert arm.stream.state.may_move
    return arm


@pytest.mark.parametrize("mode", ["velocity", "position"])
def test_without_trouble_the_arm_follows_its_targets_within_limits(mode):
    arm = swinging(mode).run(4)
    assert arm.stream.state.may_move
    assert not arm.session.report().left_out
    assert arm.keeps_limits()


def reflex(arm):
    arm.robot_mode = lcmt_panda_status.kReflex


def user_stop(arm):
    arm.robot_mode = lcmt_panda_status.kUserStopped


def force(arm):
    arm.torque = np.array([0, 0, 0, 0, 40.0, 0, 0])


def silence(arm):
    arm.speaks = False


DANGERS = [reflex, user_stop, force, silence]


@pytest.mark.parametrize("danger", DANGERS)
@pytest.mark.parametrize("ahead", [slow(3600.0), 0.05, slow(0.019), -3600.0])
def test_a_status_stamped_at_another_time_hides_no_danger(ahead, danger):
    arm = swinging()
    arm.session.hear_status(arm.status(before=-ahead).encode())
    arm.round()
    danger(arm)
    arm.run(NOTICED)
    assert not arm.stream.state.may_move
    arm.run(0.3)
    assert arm.speed == 0
    assert arm.keeps_limits()


@pytest.mark.parametrize("field", ["joint_position", "joint_velocity", "joint_torque_external"])
@pytest.mark.parametrize("number", [np.nan, slow(np.inf), slow(-np.inf)])
def test_a_status_with_what_is_no_number_is_no_news(field, number):
    arm = swinging()
    arm.speaks = False
    for _ in range(round(NOTICED / PERIOD)):
        message = arm.status()
        getattr(message, field)[3] = number
        arm.session.hear_status(message.encode())
        arm.round()
    assert not arm.stream.state.may_move
    assert sum(arm.session.report().left_out.values()) > 20
    assert arm.run(0.3).keeps_limits()


@pytest.mark.parametrize("field", ["joint_position", "joint_velocity", "joint_torque_external"])
def test_among_good_ones_it_is_left_out_and_the_arm_goes_on(field):
    arm = swinging()
    for _ in range(100):
        message = arm.status()
        getattr(message, field)[3] = np.nan
        arm.session.hear_status(message.encode())
        arm.round()
    assert arm.stream.state.may_move
    assert arm.keeps_limits()


@pytest.mark.parametrize("step", [-1.0, -0.05, 0.05, 1.0])
def test_a_clock_that_is_set_stops_nothing_and_hides_nothing(step):
    arm = swinging()
    arm.session.hear_status(arm.status().encode())  # stamped before, heard after
    arm.set_by += step
    arm.run(0.5)
    assert arm.stream.state.may_move
    force(arm)
    arm.run(NOTICED)
    assert arm.stream.state.cause is Cause.FORCE
    assert arm.keeps_limits()


def test_pictures_that_are_stamped_ahead_do_not_hide_that_others_are_missing():
    arm = swinging()
    arm.session.hear_picture(picture_message(arm.wall + 3600).encode())
    arm.round()
    arm.shows = False
    arm.run(0.5 + 2 * PERIOD)
    assert arm.stream.state.cause is Cause.IMAGES_OLD
    arm.shows = True
    arm.run(0.4)
    assert arm.stream.state.may_move


def elsewhere(arm, message):
    message.joint_position = (np.array(message.joint_position) + 0.05).tolist()


def of_another_robot(arm, message):
    message.robot_utime += 7_000_000_000


@pytest.mark.parametrize("mode", ["velocity", "position"])
@pytest.mark.parametrize("different", [elsewhere, of_another_robot])
@pytest.mark.parametrize("share", [0.3, 1.0])
def test_two_drivers_that_contradict_each_other_stop_the_arm_with_that_cause(share, different, mode):
    arm = swinging(mode)
    rng = np.random.default_rng(0)
    for _ in range(40):
        other = arm.status(before=0.5e-3)
        different(arm, other)
        if rng.random() < share:
            arm.session.hear_status(other.encode())
        arm.round()
    assert arm.stream.state.cause is Cause.CONTRADICTION
    arm.run(0.3)
    assert arm.speed == 0
    assert arm.keeps_limits()


def test_an_arm_that_contradicts_itself_is_not_set_in_motion_by_a_word():
    arm = Arm()
    for k in range(200):
        other = arm.status(before=0.5e-3)
        elsewhere(arm, other)
        arm.session.hear_status(other.encode())
        if k % 20 == 19:
            arm.session.obey("release")
        arm.round()
    assert arm.stream.state.cause is Cause.CONTRADICTION
    assert arm.speed == 0


def test_the_same_status_twice_or_late_is_no_contradiction():
    arm = swinging()
    rng = np.random.default_rng(1)
    for _ in range(200):
        arm.session.hear_status(arm.status(before=rng.choice([0.0, 0.03, 1.0])).encode())
        arm.round()
    assert arm.stream.state.may_move


def raising(*_):
    raise FloatingPointError("something that nobody thought of")


def breaks_in_the_stream(arm):
    arm.stream._look = raising


def breaks_in_the_limiter(arm):
    arm.stream._limiter.follow = raising


def breaks_at_the_door(arm):
    arm.session._status_door.admit = raising


def an_unknown_word(arm):
    arm.session.obey("dance", 1, 2)


def a_target_that_is_no_posture(arm):
    arm.session.obey("target", arm.now, np.full(7, np.nan))


def a_target_of_two_numbers(arm):
    arm.session.obey("target", arm.now, np.zeros(2))


def nothing_to_unpack(arm):
    arm.session.obey("contact")


@pytest.mark.parametrize("mode", ["velocity", slow("position")])
@pytest.mark.parametrize(
    "fault",
    [
        breaks_in_the_stream,
        breaks_in_the_limiter,
        breaks_at_the_door,
        an_unknown_word,
        a_target_that_is_no_posture,
        a_target_of_two_numbers,
        nothing_to_unpack,
    ],
)
def test_any_exception_brakes_the_arm_within_limits_and_is_the_end(fault, mode):
    arm = swinging(mode)
    moving = len(arm.commands)
    fault(arm)
    arm.run(0.5)
    assert arm.session.is_over
    assert arm.stream.state.mode is Mode.ENDED
    assert arm.stream.state.cause is Cause.FAULT
    assert arm.session.report().failed
    assert arm.speed == 0
    assert arm.velocities()[moving:].any()  # it did not just fall silent
    assert arm.keeps_limits()


def trial(seed):
    """A motion among mutated messages, then a danger; how many, and whether the arm still moved then."""
    rng = np.random.default_rng(seed)
    arm = Arm(mode=rng.choice(["velocity", "position"]))
    flood, danger, sent = rng.random() < 0.05, DANGERS[seed % len(DANGERS)], 0
    happens, moved = rng.uniform(1.2, 1.9), False
    since, stamps, last = 0.0, WRONG_STAMPS, None
    while arm.now < 2.4:
        for _ in range(50 if flood else rng.integers(8)):
            sent += 1
            if rng.random() < 0.8:
                message = last or arm.status(before=rng.uniform(0, 1e-3))
                arm.session.hear_status(mutated_status(rng, message, stamps))
            else:
                arm.session.hear_picture(mutated_picture(rng, picture_message(arm.wall)))
        if not since and arm.now >= happens:
            moved, since = arm.stream.state.may_move, arm.now
            danger(arm)
            if danger is silence:  # what is told from now on must not be news
                last, stamps = arm.status(before=PERIOD), NEVER_NOW
        arm.round()
        assert not arm.session.failed, (seed, arm.session.failed)
        if since and arm.now - since > NOTICED:
            assert not arm.stream.state.may_move, (seed, danger, arm.now - since)
    assert arm.speed == 0, seed
    assert arm.keeps_limits(), seed
    return sent, moved, arm.session.report()


@pytest.mark.renders
@pytest.mark.parametrize("first", range(0, TRIALS, 20))
def test_mutated_messages_are_never_the_death_of_it_and_hide_no_danger(first):
    sent, moved, causes, left_out = 0, 0, Counter(), Counter()
    for seed in range(first, min(first + 20, TRIALS)):
        messages, moving, report = trial(seed)
        sent, moved = sent + messages, moved + moving
        causes[report.state.cause] += 1
        left_out.update(report.left_out)
    print(f"{sent} mutated messages, {sum(left_out.values())} left out; {moved} arms moved to the last", causes)
    print(dict(left_out))
    assert moved > 0


def test_a_driver_that_was_started_anew_while_nobody_listened_is_never_taken_for_a_late_one():
    largest_gap = SafetyParameters.__dataclass_fields__["status_gap"].metadata["most"]
    assert LONGEST_DEAF + largest_gap < 0.5  # s that a driver takes at least
