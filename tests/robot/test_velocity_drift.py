"""How far commands are ahead of the arm, by hand."""

import numpy as np
import pytest

from riseg_drake.robot.velocity_drift import STANDING, VelocityDrift

PERIOD = 0.005
NONE, ONE = np.zeros(7), np.eye(7)[3]


def after(drift, ahead, seconds, speed=NONE, behind=0.0):
    """Steps in which the commands are `ahead` [7] of an arm that does not answer; the values."""
    values = []
    for _ in range(round(seconds / PERIOD)):
        drift.take_back(behind, ahead, speed, np.zeros(7))
        values.append(drift.value)
    return np.array(values)


def test_of_a_small_drift_all_is_taken_back_at_three_a_second():
    # An arm that never answers: the filter of 0.2 s sees what is left of it, the value goes after it at 3/s.
    drift, seen, value, share = VelocityDrift(PERIOD), 0.0, 0.0, PERIOD / (PERIOD + 0.2)
    noticed = False
    for measured in after(drift, 0.002 * ONE, 1.0)[:, 3]:
        seen += share * (0.002 - value - seen)
        noticed = noticed or seen > 3e-4
        value += PERIOD * 3 * seen if noticed else 0.0
        assert measured == pytest.approx(value)


@pytest.mark.parametrize("sign", [1, -1])
def test_a_large_one_is_taken_back_no_faster_than_a_hundredth_of_a_radian_a_second(sign):
    values = after(VelocityDrift(PERIOD), sign * 0.5 * ONE, 1.0)
    np.testing.assert_allclose(np.diff(values[:, 3]), sign * 0.01 * PERIOD)
    np.testing.assert_array_equal(values[:, :3], 0)


@pytest.mark.parametrize(("ahead", "is_drift"), [(0.00029, False), (0.00031, True)])
def test_less_than_three_tenths_of_a_milliradian_is_noise(ahead, is_drift):
    # After 5 s the filter has seen all but e^-25 of it.
    for sign in (1, -1):
        assert (after(VelocityDrift(PERIOD), sign * ahead * ONE, 5.0)[-1, 3] != 0) == is_drift


def test_once_noticed_it_is_taken_back_to_a_twentieth_of_a_milliradian():
    drift = VelocityDrift(PERIOD)
    after(drift, 0.01 * ONE, 0.1)
    for left, goes_on in ((6e-5, True), (4e-5, False)):
        drift._seen = left * ONE  # what the filter holds, and what it goes on to see
        before = drift.value
        drift.take_back(0.0, before + left * ONE, NONE, np.zeros(7))
        assert (drift.value[3] != before[3]) == goes_on
        np.testing.assert_array_equal(drift.value[:3], 0)
    drift._seen = 6e-5 * ONE  # which is less than counts anew
    before = drift.value
    drift.take_back(0.0, before + 6e-5 * ONE, NONE, np.zeros(7))
    np.testing.assert_array_equal(drift.value, before)


@pytest.mark.parametrize("sign", [1, -1])
def test_an_arm_that_lags_as_its_filter_does_has_no_drift(sign):
    # A steady speed is held for a period, so that the arm is half of one further than what it adds up to.
    speed, behind = sign * 0.09 * ONE, 0.012
    drift, start = VelocityDrift(PERIOD), np.linspace(-1, 1, 7)
    for k in range(400):
        told = start + k * PERIOD * speed
        measured = start + (k * PERIOD - behind - 0.0053 + PERIOD / 2) * speed
        drift.take_back(behind, told, speed, measured)
        np.testing.assert_allclose(drift._seen, 0, atol=1e-12)


def test_in_fast_motion_nothing_is_seen_and_what_was_is_forgotten():
    slow, fast = np.array([0, 0, 0, 0.0999, 0, 0, 0]), np.array([0, 0, 0, 0, 0, -0.1001, 0])
    drift = VelocityDrift(PERIOD)
    after(drift, 0.1 * ONE, 0.1, slow)
    assert drift._seen[3] > 0
    value = drift.value
    drift.take_back(0.0, 0.1 * ONE, fast, np.zeros(7))
    np.testing.assert_array_equal(drift._seen, np.zeros(7))
    np.testing.assert_array_equal(drift.value, value)


def test_where_commands_begin_anew_there_is_no_drift():
    drift = VelocityDrift(PERIOD)
    after(drift, 0.1 * ONE, 1.0)
    drift.restart()
    np.testing.assert_array_equal(drift.value, 0)
    # Nor is any left in the filter: of drift too small to count none is taken back.
    drift._taken_back[:] = False
    np.testing.assert_array_equal(after(drift, 2e-4 * ONE, 0.1), 0)


def test_an_arm_has_stood_once_when_its_commands_have_for_a_tenth_of_a_second():
    drift = VelocityDrift(period=0.03)
    assert STANDING == 0.1
    said = [drift.has_stood(stands) for stands in [True] * 3 + [False] + [True] * 7]
    assert said == [False] * 3 + [False] + [False] * 3 + [True] + [False] * 3


def test_a_time_that_is_just_reached_counts():
    drift = VelocityDrift(period=0.05)
    assert [drift.has_stood(True) for _ in range(3)] == [False, True, False]


SPEED = np.array([0.5, -0.5, 0, 0, 0, 0, 0])


def heard(*rounds, drifted=0.0):
    """Of rounds (now, speed, heard)."""
    drift = VelocityDrift(PERIOD)
    for now, speed, status in rounds:
        drift.listen(now, speed, status)
    drift.value = drifted * np.eye(7)[5]
    return drift


def may_be(drift, off, joint=0):
    """Whether an arm may be so far, rad, from where commands add up to; a millimetre of an arc is allowed."""
    told = np.linspace(-1, 1, 7)
    return drift.explains(told, told - off * np.eye(7)[joint], displacement=0.001)


@pytest.mark.parametrize("joint", [0, 1])
@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize(
    ("rounds", "unheard"),
    [
        ([(10.0, SPEED, 9.9)], 0.05),  # the status is 0.1 s old
        ([(10.0, SPEED, 9.9), (10.2, -0.4 * SPEED, None)], 0.05 + 0.04),
        ([(10.0, SPEED, 9.9), (10.2, SPEED, None), (10.3, SPEED, 10.28)], 0.01),
        ([(10.0, SPEED, None)], 0.0),  # nothing was told before
        ([(10.0, SPEED, None), (10.2, SPEED, None)], 0.1),
    ],
)
def test_an_arm_may_have_followed_or_not_what_was_told_since_it_was_heard_of(rounds, unheard, joint, side):
    for more, expected in ((0.0009, True), (0.0011, False)):
        assert may_be(heard(*rounds), side * (unheard + more), joint) == expected


def test_a_joint_that_was_told_nothing_is_where_it_was_less_the_drift():
    for off, expected in ((0.0209, True), (0.0211, False), (0.0191, True), (0.0189, False)):
        assert may_be(heard((10.0, SPEED, 9.0), drifted=0.02), off, joint=5) == expected
