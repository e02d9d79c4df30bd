import numpy as np
import pytest

from riseg_drake.robot.limits import FR3_LIMITS, PANDA_LIMITS
from riseg_drake.stations.motion_judge import MotionJudge, MotionVerdict
from riseg_drake.stations.rate_limiter import RateLimiter

MIDDLE, RESTING = PANDA_LIMITS.position_middle, np.zeros(7)
ELBOW = np.eye(7)[3]
WRIST = np.eye(7)[6]


def judged(motion, limits=PANDA_LIMITS):
    """The verdict on ticks of (q, v, a, jerk)."""
    judge = MotionJudge(RateLimiter(limits))
    for tick in motion:
        judge.take(*tick)
    return judge.verdict()


def test_a_swinging_joint_has_the_rms_of_a_sine():
    share, limiter = 0.2, RateLimiter(PANDA_LIMITS)
    phase = 2 * np.pi * np.arange(1000) / 1000  # 1 Hz
    a = share * limiter.acceleration[3] * np.sin(phase)
    # A little speed of another joint, so that no tick counts as standing.
    motion = [(MIDDLE, 0.01 * WRIST, value * ELBOW, RESTING) for value in a]
    verdict = judged(motion)
    assert verdict.seconds == pytest.approx(1.0)
    assert verdict.acceleration_rms == pytest.approx(share / np.sqrt(2))
    assert verdict.acceleration_largest == pytest.approx(share)
    assert (verdict.jerk_rms, verdict.jerk_largest, verdict.at_limit) == (0, 0, 0)


def test_the_joint_that_is_worst_counts_and_not_the_mean():
    limiter = RateLimiter(PANDA_LIMITS)
    jerk = 0.1 * limiter.jerk * ELBOW + 0.4 * limiter.jerk * WRIST
    verdict = judged([(MIDDLE, ELBOW, RESTING, sign * jerk) for sign in (1, -1) * 50])
    assert (verdict.jerk_rms, verdict.jerk_largest) == pytest.approx((0.4, 0.4))


def test_ticks_in_which_the_arm_stands_still_dilute_nothing():
    limiter = RateLimiter(PANDA_LIMITS)
    moving = (MIDDLE, ELBOW, 0.5 * limiter.acceleration, RESTING)
    standing = (MIDDLE, 1e-4 * ELBOW, RESTING, RESTING)
    assert judged([moving] * 10 + [standing] * 90) == judged([moving] * 10)
    assert judged([standing] * 10) == MotionVerdict()


@pytest.mark.parametrize("what", ["acceleration", "jerk", "velocity"])
@pytest.mark.parametrize("sign", [1, -1])
def test_a_tick_is_at_a_limit_where_one_joint_is(what, sign):
    limiter = RateLimiter(FR3_LIMITS)
    q = FR3_LIMITS.position_upper - 0.2
    if sign < 0:
        q = FR3_LIMITS.position_lower + 0.2
    lower, upper = limiter.velocity_range(q)  # less than amid the range

    def tick(share):
        rates = {"velocity": 0.01 * ELBOW, "acceleration": RESTING, "jerk": RESTING}
        most = {
            "velocity": upper if sign > 0 else -lower,
            "acceleration": limiter.acceleration,
            "jerk": limiter.jerk,
        }
        rates[what] = sign * share * most[what] * ELBOW
        return (q, *rates.values())

    verdict = judged([tick(1.0)] * 3 + [tick(0.99)] * 7, FR3_LIMITS)
    assert verdict.at_limit == pytest.approx(0.3)
