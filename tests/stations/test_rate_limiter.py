import numpy as np
import pytest

from riseg_drake.robot.limits import FR3_LIMITS, PANDA_LIMITS
from riseg_drake.stations.rate_limiter import RateLimiter, low_pass_gain

ROBOTS = pytest.mark.parametrize("limits", [PANDA_LIMITS, FR3_LIMITS], ids=["panda", "fr3"])


def ticks(limits, v, q, count):
    """What comes out, [count, 7] each of q, v, a, of a robot at rest at q that is asked for v all the time."""
    limiter, v_d, a_d, out = RateLimiter(limits), np.zeros(7), np.zeros(7), []
    for _ in range(count):
        v_next = limiter.limit(v, q, v_d, a_d)
        v_d, a_d = v_next, (v_next - v_d) / 1e-3
        q = q + 1e-3 * v_d
        out.append((q, v_d, a_d))
    return np.moveaxis(out, 1, 0)


def test_the_low_pass_goes_the_share_of_the_way_that_its_time_constant_says():
    # 1 / (2 pi 30 Hz) = 5.305 ms: 1 of 6.305.
    assert low_pass_gain(30.0) == pytest.approx(1 / 6.305, rel=1e-4)


@ROBOTS
def test_a_step_of_velocity_takes_two_ticks_to_the_full_acceleration_which_then_holds(limits):
    _, v, a = ticks(limits, np.full(7, 1.0), limits.position_middle, 20)
    expected = np.minimum(0.5 * np.arange(1, 21)[:, None], 1.0) * limits.acceleration
    np.testing.assert_allclose(a, expected, atol=2e-3)
    np.testing.assert_allclose(v, 1e-3 * np.cumsum(expected, axis=0), atol=4e-5)


def test_the_pandas_greatest_speed_is_neared_with_room_for_three_lost_packets():
    # By kMaxJointVelocity: 2.175 - 1e-3 - 3 * 1e-3 * (15 - 1e-3), and so on.
    greatest = [2.129003, 2.151503, 2.144003, 2.136503, 2.564003, 2.549003, 2.549003]
    for sign in (1, -1):
        _, v, _ = ticks(PANDA_LIMITS, np.full(7, 9.0 * sign), PANDA_LIMITS.position_middle, 1000)
        assert (np.abs(v) <= greatest).all()
        np.testing.assert_allclose(sign * v[-1], greatest, rtol=1e-3)


def test_the_fr3_is_let_through_with_its_speed_at_each_position():
    """A joint that is kept at its greatest speed slows down towards its end as libfranka lets it."""
    q, v, a = ticks(FR3_LIMITS, np.full(7, 9.0), FR3_LIMITS.position_middle, 3000)
    before = np.vstack([FR3_LIMITS.position_middle, q[:-1]])
    # computeUpperLimitsJointVelocity of joint 1: min(2.62, -0.30 + sqrt(12 (2.7501 - q))) - 1e-3.
    allowed = np.minimum(2.62, np.sqrt(np.maximum(12 * (2.7501 - before[:, 0]), 0)) - 0.30) - 1e-3
    in_range = allowed > 0
    assert in_range.sum() > 1000
    # One tick late: what is allowed is that of where the tick began.
    assert (v[in_range, 0] - allowed[in_range]).max() < 0.02
    assert np.abs(a).max() <= 10.0
    # Nothing brakes ahead of time: what is allowed to joints 5 and 7 falls with 17 rad/s^2, 10 are possible.
    leaves = (q > FR3_LIMITS.position_upper).any(axis=0)
    assert leaves.tolist() == [False, False, False, False, True, False, True]


@ROBOTS
def test_whatever_is_asked_for_acceleration_and_jerk_stay_within_their_limits(limits):
    rng = np.random.default_rng(0)
    limiter, v_d, a_d = RateLimiter(limits), np.zeros(7), np.zeros(7)
    q = limits.position_middle
    for k in range(2000):
        v = limiter.limit(rng.uniform(-4, 4, 7) * (k % 50 < 40), q, v_d, a_d)
        a = (v - v_d) / 1e-3
        assert (np.abs(a) <= limiter.acceleration + 1e-9).all()
        v_d, a_d = v, a
