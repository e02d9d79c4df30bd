"""Streams that are just good enough, and streams that just are not; how much that is, is worked out by hand."""

import numpy as np
import pytest

from riseg_drake.robot.limits import FR3_LIMITS, PANDA_LIMITS
from riseg_drake.stations.stream_judge import StreamJudge

START = 1_700_000_000_000_000  # us
MIDDLE = PANDA_LIMITS.position_middle
FAR = MIDDLE + 1.0
SHOULDER, WRIST = np.eye(7)[1], np.eye(7)[6]
LITTLE = 1e-6
"""By which a target is within or beyond what is forgiven."""
VELOCITY, POSITION = "velocity_discontinuity", "position_limits_violation"
SPEED, ACCELERATION = "velocity_limits_violation", "acceleration_discontinuity"


class Stream:
    """A judge, and who sends it commands at times of t in s."""

    def __init__(self, mode="position", limits=PANDA_LIMITS, jitter=0.0, step=0.0):
        self.judge = StreamJudge(limits, mode == "velocity", jitter, step)

    def says(self, t, target, held=FAR, longest_gap=0.1, q=MIDDLE):
        return self.judge.judge(np.asarray(target, float), START + round(1e6 * t), held, longest_gap, q)

    def after(self, motion, times=None):
        """What a motion(t) did at times up to 0, after nobody had listened."""
        self.judge.miss()
        for t in np.arange(-60, 1) * 0.005 if times is None else times:
            assert self.says(t, motion(t)) == ""
        return self


def steady(velocity):
    return lambda t: MIDDLE + t * velocity


def uneven(seed):
    """Times of the last 0.3 s, up to 0, 1 to 20 ms apart."""
    gaps = np.random.default_rng(seed).integers(1, 21, 60) * 1e-3
    times = -np.cumsum(gaps)[::-1]
    return [*times[times > -0.3], 0.0]


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(("gap", "counted"), [(0.002, 0.002), (0.02, 0.02), (0.045, 0.045), (0.09, 0.05)])
@pytest.mark.parametrize("way", [1, -1])
def test_a_position_may_be_off_the_straight_line_by_what_acceleration_and_jitter_explain(
    seed, gap, counted, way
):
    velocity, jitter, step = np.linspace(-0.3, 0.4, 7), 0.0015, 1e-4
    forgiven = PANDA_LIMITS.acceleration * counted**2 + 2 * jitter * np.abs(velocity) + step
    expected = steady(velocity)(gap)
    for joint in range(7):
        for more, verdict in ((-LITTLE, ""), (LITTLE, VELOCITY)):
            stream = Stream(jitter=jitter, step=step).after(steady(velocity), uneven(seed))
            assert stream.says(gap, expected + way * (forgiven[joint] + more) * np.eye(7)[joint]) == verdict


def test_while_speed_grows_the_lag_of_its_mean_is_forgiven():
    # The mean of the last 25 ms lags 12.5 ms behind; at 4 rad/s^2 it is 0.1 rad/s more than that before it.
    acceleration = 4.0 * SHOULDER
    stream = Stream().after(lambda t: MIDDLE + 0.5 * acceleration * (max(0.0, t + 0.3)) ** 2)
    gap, speed = 0.01, 4.0 * (0.3 - 0.0125)
    line = MIDDLE + 0.5 * acceleration * 0.3**2 + gap * speed * SHOULDER
    forgiven = 7.5 * gap**2 + 0.1 * gap
    assert stream.says(gap, line + (forgiven + LITTLE) * SHOULDER) == VELOCITY
    assert stream.says(gap, line + (forgiven - LITTLE) * SHOULDER) == ""


@pytest.mark.parametrize("joint", range(7))
@pytest.mark.parametrize("way", [1, -1])
def test_a_stream_begins_three_milliradians_from_where_the_arm_is_held_at_most(joint, way):
    # And from there with what it may gather in 5 ms.
    forgiven = 0.003 + PANDA_LIMITS.acceleration[joint] * 0.005**2 + 1e-4
    for more, verdict in ((-LITTLE, ""), (LITTLE, VELOCITY)):
        stream = Stream(step=1e-4)
        stream.judge.begin()
        assert stream.says(0.0, MIDDLE + way * (forgiven + more) * np.eye(7)[joint], held=MIDDLE) == verdict


def test_what_began_goes_on_as_from_rest():
    # The target was within the 3 mrad: 5 ms before it the arm was there, and so it was for long.
    stream = Stream()
    assert stream.says(0.0, MIDDLE + 0.002 * SHOULDER, held=MIDDLE) == ""
    edge = 0.002 + 7.5 * 0.01**2
    assert stream.says(0.01, MIDDLE + (edge + LITTLE) * SHOULDER) == VELOCITY
    assert stream.says(0.01, MIDDLE + (edge - LITTLE) * SHOULDER) == ""


@pytest.mark.parametrize(("gap", "verdict"), [(0.0399, VELOCITY), (0.0401, "")])
def test_after_four_hundredths_of_a_second_a_stream_may_begin_at_rest_where_the_arm_is_held(gap, verdict):
    stream = Stream().after(steady(WRIST))
    assert stream.says(gap, MIDDLE, held=MIDDLE) == verdict


def test_after_the_longest_gap_a_stream_does_not_go_on():
    for longest, verdict in ((0.0801, ""), (0.0799, VELOCITY)):
        stream = Stream().after(steady(WRIST))
        assert stream.says(0.08, steady(WRIST)(0.08), longest_gap=longest) == verdict
        assert Stream().says(0.08, MIDDLE, longest_gap=longest) == VELOCITY  # there was none


@pytest.mark.parametrize("way", [1, -1])
def test_the_arm_may_go_to_the_ends_of_its_range_and_no_further(way):
    end = PANDA_LIMITS.position_upper if way > 0 else PANDA_LIMITS.position_lower
    stream = Stream().after(lambda t: end)
    assert stream.says(0.005, end + way * 1e-9 * WRIST) == POSITION
    assert stream.says(0.005, end) == ""


@pytest.mark.parametrize("way", [1, -1])
@pytest.mark.parametrize("jitter", [0.0, 0.001])
@pytest.mark.parametrize("joint", [1, 6])
def test_mean_speeds_of_25_milliseconds_may_differ_by_what_acceleration_explains(joint, jitter, way):
    axis, slow = way * np.eye(7)[joint], 0.1
    share = 2 * jitter / 0.025  # of the speed that it has come to, by which stamps may change it
    most = (PANDA_LIMITS.acceleration[joint] * (0.025 + jitter) + 0.02 + share * slow) / (1 - share)
    for change, verdict in ((0.999 * most, ""), (1.001 * most, ACCELERATION)):
        stream = Stream(jitter=jitter, step=0.5).after(steady(slow * axis))
        for t in np.arange(1, 6) * 0.005:
            assert stream.says(t, MIDDLE + t * (slow + change) * axis) == ""
        assert stream.says(0.03, MIDDLE + 0.03 * (slow + change) * axis) == verdict


def recent(gap=0.005):
    """The tenth of a second in which nothing is judged after nobody had listened."""
    return np.arange(-round(0.1 / gap), 1) * gap


@pytest.mark.parametrize("way", [1, -1])
@pytest.mark.parametrize("jitter", [0.0, 0.002])
@pytest.mark.parametrize(("joint", "fastest"), [(0, 2.175), (6, 2.61)])
def test_a_tenth_of_a_second_has_a_mean_speed_within_the_limit(joint, fastest, jitter, way):
    axis = way * np.eye(7)[joint]
    stamped = fastest * (0.1 + 2 * jitter) / 0.1  # the stamps of both ends may be off
    for share, verdict in ((0.999, ""), (1.001, SPEED)):
        motion = steady(share * stamped * axis)
        assert Stream(jitter=jitter).after(motion, recent()).says(0.005, motion(0.005)) == verdict


@pytest.mark.parametrize("way", [1, -1])
def test_an_fr3_is_judged_by_the_speed_it_may_have_where_it_was_a_tenth_of_a_second_ago(way):
    end = FR3_LIMITS.position_upper[0] if way > 0 else FR3_LIMITS.position_lower[0]
    distance = (1.0 + 0.30) ** 2 / (2 * 6.0)  # from the end, at which it may do 1 rad/s towards it
    for share, verdict in ((1.001, ""), (0.999, SPEED)):

        def motion(t, share=share):
            q = FR3_LIMITS.position_middle.copy()
            q[0] = end - way * share * distance + way * (t + 0.1)
            return q

        assert Stream(limits=FR3_LIMITS).after(motion, recent()).says(0.002, motion(0.002)) == verdict


def test_what_nobody_listened_to_is_not_held_against_what_comes_in_the_next_tenth_of_a_second():
    stream = Stream().after(steady(WRIST))
    stream.judge.miss()
    for t in (1.0, 1.05, 1.1):  # jumps of a radian
        assert stream.says(t, MIDDLE + np.cos(1e3 * t)) == ""
    assert stream.says(1.100001, MIDDLE + 1.0) == VELOCITY


def test_a_stamp_that_goes_back_is_one_tick_later_and_the_stream_goes_on_from_it():
    stream = Stream().after(steady(0.3 * WRIST))
    edge = 0.3 * 0.001 + 20 * 0.001**2
    assert stream.says(-0.02, MIDDLE + (edge + LITTLE) * WRIST) == VELOCITY
    assert stream.says(-0.02, MIDDLE + (edge - LITTLE) * WRIST) == ""
    # What had been said for later is forgotten: 25 and 50 ms before it the arm was on the old line.
    q1, q2, q3 = edge - LITTLE, -0.045 * 0.3, -0.07 * 0.3
    speed, before = (q1 - q2) / 0.025, (q2 - q3) / 0.025
    edge = q1 + speed * 0.005 + 20 * 0.005**2 + (speed - before) * 0.005
    assert stream.says(-0.015, MIDDLE + (edge + LITTLE) * WRIST) == VELOCITY
    assert stream.says(-0.015, MIDDLE + (edge - LITTLE) * WRIST) == ""


@pytest.mark.parametrize("way", [1, -1])
@pytest.mark.parametrize("limits", [PANDA_LIMITS, FR3_LIMITS])
def test_a_velocity_is_within_the_limits_where_the_robot_is(limits, way):
    end = limits.position_upper if way > 0 else limits.position_lower
    q = end - way * 0.1
    fastest = limits.velocity_range(q)[1 if way > 0 else 0]
    for joint in range(7):
        stream = Stream("velocity", limits, step=1.0)
        assert stream.says(0.0, np.zeros(7), q=q) == ""
        assert stream.says(0.005, (fastest + way * 1e-9) * np.eye(7)[joint], q=q) == SPEED
        assert stream.says(0.005, fastest * np.eye(7)[joint], q=q) == ""


@pytest.mark.parametrize(("gap", "counted"), [(0.005, 0.005), (0.03, 0.03), (0.045, 0.045), (0.09, 0.05)])
@pytest.mark.parametrize("way", [1, -1])
def test_a_velocity_may_change_by_what_acceleration_jitter_and_a_step_explain(gap, counted, way):
    before = -way * np.linspace(1.6, 2.0, 7)
    change = PANDA_LIMITS.acceleration * (counted + 0.001) + 20 * 1e-3
    for joint in range(7):
        for more, verdict in ((-LITTLE, ""), (LITTLE, ACCELERATION)):
            stream = Stream("velocity", jitter=0.001, step=1e-3).after(lambda t: before, recent())
            target = before + way * (change[joint] + more) * np.eye(7)[joint]
            assert stream.says(gap, target) == verdict


def test_velocities_begin_at_rest_with_what_may_be_gathered_in_5_milliseconds():
    edge = 20 * (0.005 + 0.001) + 20 * 1e-3
    for more, verdict in ((-LITTLE, ""), (LITTLE, ACCELERATION)):
        stream = Stream("velocity", jitter=0.001, step=1e-3)
        assert stream.says(0.0, -(edge + more) * WRIST) == verdict


@pytest.mark.parametrize(("gap", "verdict"), [(0.0399, ACCELERATION), (0.0401, "")])
def test_velocities_that_paused_for_four_hundredths_of_a_second_may_begin_at_rest(gap, verdict):
    stream = Stream("velocity").after(lambda t: 2 * WRIST, recent())
    assert stream.says(gap, 0.099 * WRIST) == verdict
    assert Stream("velocity").after(lambda t: 2 * WRIST, recent()).says(0.05, 0.101 * WRIST) == ACCELERATION
