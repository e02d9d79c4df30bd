from dataclasses import replace

import numpy as np
import pytest

from riseg_drake.pushing.time_law import SpeedLimits, minimum_jerk, rest_to_rest, steady_speed
from riseg_drake.robot.command_limiter import LONGEST_STOP, CommandLimiter, CommandLimits, Target
from riseg_drake.robot.kinematics import READY
from riseg_drake.robot.limits import FR3_LIMITS, PANDA_LIMITS

PERIOD = 0.005


def shares(positions):
    """Largest velocity, acceleration and jerk of a sequence of commands [N, 7], as shares of the limits."""
    return [
        float(np.max(np.abs(np.diff(positions, order, axis=0)) / PERIOD**order / limit))
        for order, limit in enumerate(
            (PANDA_LIMITS.velocity, PANDA_LIMITS.acceleration, PANDA_LIMITS.jerk), start=1
        )
    ]


def still(position):
    return Target(np.asarray(position, float), np.zeros(7), np.zeros(7))


def until_rest(limiter, target, most=3000):
    commands = [limiter.position.copy()]
    for _ in range(most):
        commands.append(limiter.follow(target).copy())
        if limiter.at_rest and np.abs(limiter.position - target.position).max() < 1e-6:
            return np.array(commands)
    raise AssertionError("never there")


def test_the_first_commands_are_where_the_arm_is():
    limiter = CommandLimiter(READY, PANDA_LIMITS)
    np.testing.assert_array_equal(limiter.follow(still(READY)), READY)
    np.testing.assert_array_equal(limiter.stop(), READY)


def test_a_planned_motion_comes_out_as_it_went_in():
    rng = np.random.default_rng(0)
    way = READY + np.cumsum(rng.normal(scale=0.08, size=(10, 7)), axis=0)
    path = rest_to_rest(way, minimum_jerk, SpeedLimits(0.3, 0.25, 0.1), PANDA_LIMITS)
    limiter = CommandLimiter(way[0], PANDA_LIMITS)
    for t in np.arange(PERIOD, path.end_time(), PERIOD):
        target = Target(*(path.EvalDerivative(t, order)[:, 0] for order in range(3)))
        np.testing.assert_allclose(limiter.follow(target), target.position, rtol=0, atol=2e-5)


def test_a_step_becomes_a_motion_within_limits_that_arrives():
    limits = CommandLimits()
    commands = until_rest(CommandLimiter(READY, PANDA_LIMITS, PERIOD, limits), still(READY + 0.5))
    velocity, acceleration, jerk = shares(np.vstack([READY, READY, commands, commands[-1], commands[-1]]))
    assert velocity <= limits.velocity + 1e-6
    assert acceleration <= limits.acceleration + 1e-6
    assert jerk <= limits.jerk + 1e-4


@pytest.mark.parametrize("robot", [PANDA_LIMITS, FR3_LIMITS], ids=["panda", "fr3"])
def test_a_target_beyond_a_joint_is_not_followed_out_of_its_range(robot):
    limiter = CommandLimiter(robot.position_upper - 0.3, robot)
    beyond = robot.position_upper + 1
    for _ in range(1500):
        limiter.follow(still(beyond))
        assert limiter.held_back
    room = robot.room(limiter.position)
    assert room.min() >= CommandLimits().position_margin - 1e-6
    assert limiter.at_rest


def test_an_arm_that_was_put_beyond_its_margin_by_hand_may_come_back():
    start = PANDA_LIMITS.position_upper - 0.01
    limiter = CommandLimiter(start, PANDA_LIMITS)
    for back in np.arange(0, 0.1, 0.0005):
        limiter.follow(still(start - back))
        assert not limiter.held_back
    assert PANDA_LIMITS.room(limiter.position).min() > CommandLimits().position_margin


def test_a_target_that_races_towards_the_end_of_a_range_is_given_up_in_time():
    limiter = CommandLimiter(READY, PANDA_LIMITS)
    racing = np.zeros(7)
    racing[5] = CommandLimits().velocity * PANDA_LIMITS.velocity[5]
    held_back = False
    for k in range(1000):
        position = READY + racing * k * PERIOD
        limiter.follow(Target(position, racing, np.zeros(7)))
        held_back |= limiter.held_back
        assert PANDA_LIMITS.contains(limiter.position)
    assert held_back


@pytest.mark.parametrize("robot", [PANDA_LIMITS, FR3_LIMITS], ids=["panda", "fr3"])
def test_the_longest_stop_is_no_longer_than_said(robot):
    limits = CommandLimits()
    longest = 0
    for seed in range(40):
        rng = np.random.default_rng(seed)
        limiter = CommandLimiter(READY, robot, PERIOD, limits)
        goal = READY + rng.choice([-0.5, 0.5], 7)
        for _ in range(rng.integers(1, 120)):
            limiter.follow(still(goal))
        periods = 0
        while not limiter.at_rest:
            limiter.stop()
            periods += 1
        longest = max(longest, periods)
    assert longest * PERIOD <= limits.longest_stop(robot) + PERIOD
    assert longest * PERIOD > 0.05  # the test has seen real stops


@pytest.mark.parametrize("robot", [PANDA_LIMITS, FR3_LIMITS], ids=["panda", "fr3"])
def test_the_longest_stop_is_ruckigs_from_full_speed_and_full_acceleration_the_wrong_way(robot):
    limits, limiter = CommandLimits(), CommandLimiter(READY, robot)
    stop = limiter._stop_from(
        READY, limits.velocity * robot.velocity, limits.acceleration * robot.acceleration, limiter._braking
    )
    assert limits.longest_stop(robot) == pytest.approx(stop.duration, abs=1e-9)


@pytest.mark.parametrize("sign", [-1, 1])
@pytest.mark.parametrize(("spare", "followed"), [(1e-5, True), (-1e-5, False)])
def test_an_acceleration_is_not_gone_on_with_where_taking_it_back_would_gather_too_much_speed(
    sign, spare, followed
):
    limits, joint = CommandLimits(), 3
    limiter = CommandLimiter(PANDA_LIMITS.position_middle, PANDA_LIMITS)
    a = 0.9 * limits.acceleration * PANDA_LIMITS.acceleration[joint]
    # Taken back with the greatest jerk j it gathers a^2 / 2j.
    gathered = a**2 / (2 * limits.jerk * PANDA_LIMITS.jerk[joint])
    v = limits.velocity * PANDA_LIMITS.velocity[joint] - gathered - spare - PERIOD * a
    limiter.velocity[joint], limiter.acceleration[joint] = sign * v, sign * a
    free = Target(
        limiter.position + PERIOD * limiter.velocity + PERIOD**2 / 2 * limiter.acceleration,
        limiter.velocity + PERIOD * limiter.acceleration,
        limiter.acceleration,
    )
    assert (limiter._follow_linearly(free) is not None) is followed


def in_fast_motion(robot):
    limiter = CommandLimiter(READY, robot, PERIOD)
    goal = READY + np.array([0.5, -0.4, 0.3, 0.2, 0.5, 0.4, -0.5])
    while np.abs(limiter.velocity / robot.velocity).max() < 0.25:
        limiter.follow(still(goal))
    return limiter


def until_at_rest(limiter, step):
    before, commands = limiter.velocity, [limiter.position]
    while not limiter.at_rest:
        commands.append(step())
    velocity = np.diff(commands, axis=0) / PERIOD
    return np.abs(np.diff(np.vstack([before, velocity, 0 * before]), axis=0)) / PERIOD


@pytest.mark.parametrize("robot", [PANDA_LIMITS, FR3_LIMITS], ids=["panda", "fr3"])
def test_a_pause_brakes_no_harder_than_motions_do_and_a_stop_sooner(robot):
    limits = CommandLimits()
    paused, stopped = in_fast_motion(robot), in_fast_motion(robot)
    calm = until_at_rest(paused, paused.pause) / robot.acceleration
    hard = until_at_rest(stopped, stopped.stop) / robot.acceleration
    assert calm.max() == pytest.approx(limits.acceleration, rel=0.05)
    assert limits.stop_acceleration * 1.001 > hard.max() > 1.3 * limits.acceleration
    assert len(hard) < len(calm) <= LONGEST_STOP / PERIOD


@pytest.mark.parametrize("robot", [PANDA_LIMITS, FR3_LIMITS], ids=["panda", "fr3"])
def test_a_pause_in_which_calm_braking_would_take_too_long_is_a_stop(robot):
    limiter, joint = CommandLimiter(READY, robot), int(np.argmax(robot.velocity / robot.acceleration))
    goal = READY.copy()
    goal[joint] += 1.2
    fastest = CommandLimits().velocity * robot.velocity[joint]
    assert fastest > LONGEST_STOP * CommandLimits().acceleration * robot.acceleration[joint]
    while limiter.velocity[joint] < 0.999 * fastest:
        limiter.follow(still(goal))
    assert len(until_at_rest(limiter, limiter.pause)) <= LONGEST_STOP / PERIOD


@pytest.mark.parametrize(("margin", "room", "share"), [(0.005, 0.038, 0.99), (0.03, 0.04, 0.5)])
def test_a_pause_whose_calm_braking_would_not_keep_speed_or_range_near_an_end_is_a_stop(margin, room, share):
    limits, robot = CommandLimits(position_margin=margin), FR3_LIMITS
    limiter = CommandLimiter(robot.position_middle, robot, limits=limits)
    limiter.position[4] = robot.position_upper[4] - room
    limiter.velocity[4] = share * limits.velocity * robot.velocity_range(limiter.position)[1][4]
    limiter.velocity[6] = 0.95 * limits.acceleration * robot.acceleration[6] * LONGEST_STOP
    limiter._stop = limiter._stop_from_here(limiter._braking)
    assert limiter._ends_in_ranges(limiter._stop)
    assert limiter._is_slow_enough(limiter._stop)
    while not limiter.at_rest:
        limiter.pause()
        assert limiter.position[4] <= robot.position_upper[4] - limits.position_margin + 1e-9
        assert limiter.velocity[4] <= limits.velocity * robot.velocity_range(limiter.position)[1][4]


def test_a_stop_in_a_pause_is_as_hard_as_any_from_there_on():
    limiter = in_fast_motion(PANDA_LIMITS)
    limiter.pause()
    limiter.pause()
    other = CommandLimiter(limiter.position, PANDA_LIMITS, PERIOD)
    other.position, other.velocity, other.acceleration = (
        limiter.position,
        limiter.velocity,
        limiter.acceleration,
    )
    other._is_calm = True
    np.testing.assert_array_equal(until_at_rest(limiter, limiter.stop), until_at_rest(other, other.stop))
    assert np.ptp(limiter.position - limiter.rest_position) == 0


def speed_towards_an_end(robot, end):
    """Largest share of what an FR3 may have, where all joints are to go to one end at full speed."""
    start = FR3_LIMITS.position_middle
    goal = start + end * ((FR3_LIMITS.position_upper - FR3_LIMITS.position_lower) / 2 - 0.04)
    seconds = np.abs(goal - start).max() / (0.34 * 0.8 * FR3_LIMITS.velocity.min())
    limiter, positions = CommandLimiter(start, robot), [start]
    for t in np.arange(0, 1.5, PERIOD / seconds):
        s, ds, dds = (rate * (goal - start) for rate in steady_speed(0.2)(np.array(min(t, 1.0)))[:3])
        limiter.follow(Target(start + s, ds / seconds, dds / seconds**2))
        assert not limiter.held_back
        assert limiter._stopped_for == 0  # nothing that it meant to do was given up
        positions.append(limiter.position)
    lowest, highest = FR3_LIMITS.velocity_range(np.array(positions)[:-1])
    return (end * np.diff(positions, axis=0) / PERIOD / np.where(end > 0, highest, -lowest)).max(), limiter


def test_a_stop_that_a_fast_joint_makes_long_may_not_leave_a_slow_one_too_fast_near_its_end():
    position = FR3_LIMITS.position_middle.copy()
    limiter = CommandLimiter(position, FR3_LIMITS)
    position[4] = FR3_LIMITS.position_upper[4] - 0.04
    slow = np.zeros(7)
    slow[4] = 0.97 * CommandLimits().velocity * FR3_LIMITS.velocity_range(position)[1][4]
    fast = slow.copy()
    fast[6] = CommandLimits().velocity * FR3_LIMITS.velocity[6]
    for velocity, expected in ((slow, True), (fast, False)):
        stop = limiter._stop_from(position, velocity, np.zeros(7), limiter._braking)
        states = np.array([stop.at_time(t)[:2] for t in np.linspace(0, stop.duration, 100)])
        bounds = CommandLimits().velocity * FR3_LIMITS.velocity_range(states[:, 0])[1]
        assert (states[:, 1] <= bounds).all() == expected
        assert limiter._is_slow_enough(stop) == expected


@pytest.mark.parametrize("end", [-1, 1])
def test_towards_the_end_of_an_fr3s_range_joints_are_no_faster_than_they_may_be_there(end):
    share, limiter = speed_towards_an_end(FR3_LIMITS, end)
    assert share <= CommandLimits().velocity * (1 + 1e-6)
    assert FR3_LIMITS.room(limiter.position).min() < 0.15  # it went there
    heedless, _ = speed_towards_an_end(replace(FR3_LIMITS, slowing_down=None), end)
    assert heedless > 1.2 * CommandLimits().velocity


@pytest.mark.parametrize("end", [-1, 1])
def test_on_the_way_to_the_end_of_a_range_a_joint_is_as_slow_as_at_the_slower_of_both_places_but_not_still(end):
    limiter, share = CommandLimiter(FR3_LIMITS.position_middle, FR3_LIMITS), CommandLimits().velocity
    goal = FR3_LIMITS.position_middle.copy()
    goal[0] += end * (FR3_LIMITS.position_upper[0] - goal[0] - 0.2)
    goal[4] += end * (FR3_LIMITS.position_upper[4] - goal[4] - 0.002)
    assert limiter._approach(still(goal)) is not None
    # 0.2 rad from its end joint 1 may do sqrt(2 * 6 * 0.2) - 0.3 rad/s, joint 5 so near to it nothing.
    towards = share * FR3_LIMITS.velocity
    towards[[0, 4]] = share * (np.sqrt(2.4) - 0.3), 1e-3
    away = share * FR3_LIMITS.velocity
    lowest, highest = (-away, towards) if end > 0 else (-towards, away)
    np.testing.assert_allclose(limiter._way.min_velocity, lowest)
    np.testing.assert_allclose(limiter._way.max_velocity, highest)


def test_where_no_way_to_a_target_is_found_the_stop_is_gone_on_with_and_that_is_told(monkeypatch):
    limiter = in_fast_motion(PANDA_LIMITS)
    expected = limiter._stop.at_time(PERIOD)[0]
    monkeypatch.setattr(limiter, "_approach", lambda target: None)
    np.testing.assert_array_equal(limiter.follow(still(READY + 0.5)), expected)
    assert limiter.held_back


@pytest.mark.parametrize(
    "wrong", [{"velocity": 0.0}, {"jerk": 1.5}, {"acceleration": 0.9, "stop_acceleration": 0.5}]
)
def test_shares_that_cannot_be_are_refused(wrong):
    with pytest.raises(ValueError, match=r"share|stop"):
        CommandLimits(**wrong)
