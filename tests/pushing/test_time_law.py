from itertools import pairwise

import numpy as np
import pytest

from riseg_drake.pushing.time_law import SpeedLimits, minimum_jerk, rest_to_rest, steady_speed
from riseg_drake.robot.limits import FR3_LIMITS, PANDA_LIMITS

FROM = np.array([0.0, -0.5, 0.0, -2.5, 0.0, 2.0, 0.0])
TO = np.array([0.8, 0.2, -0.3, -1.9, 0.4, 2.2, 2.1])
PROFILES = [minimum_jerk, steady_speed(0.1), steady_speed(0.5)]


@pytest.mark.parametrize("profile", PROFILES)
def test_profile_goes_from_0_to_1_and_its_derivatives_are_derivatives(profile):
    tau = np.linspace(0, 1, 2001)
    derivatives = profile(tau)
    assert derivatives[:3, 0] == pytest.approx([0, 0, 0])
    assert derivatives[:3, -1] == pytest.approx([1, 0, 0])
    assert (np.diff(derivatives[0]) >= 0).all()
    for lower, higher in pairwise(derivatives):
        slope = np.gradient(lower, tau)
        # But for the instants where a ramp begins or ends, and the slope jumps.
        wrong = np.abs(slope - higher) > 2e-3 * np.abs(higher).max()
        assert np.count_nonzero(wrong[1:-1]) <= 8


def test_steady_profile_holds_one_speed_between_its_ramps():
    _, speed, _, _ = steady_speed(0.1)(np.linspace(0.1, 0.9, 50))
    assert speed == pytest.approx(1 / 0.9)


@pytest.mark.parametrize("profile", PROFILES)
def test_motion_stays_within_its_share_of_the_limits_and_uses_one_of_them(profile):
    limits = SpeedLimits(velocity=0.5, acceleration=0.4, jerk=0.02)
    bend = (FROM + TO) / 2 + [0, 0.1, 0.1, 0, 0, -0.1, 0]
    motion = rest_to_rest(np.array([FROM, bend, TO]), profile, limits, PANDA_LIMITS)
    time = np.linspace(0, motion.end_time(), 2000)
    allowed = [
        limits.velocity * PANDA_LIMITS.velocity,
        limits.acceleration * PANDA_LIMITS.acceleration,
        limits.jerk * PANDA_LIMITS.jerk,
    ]
    use = [
        np.max(np.abs(motion.MakeDerivative(order).vector_values(time)) / bound[:, None])
        for order, bound in enumerate(allowed, 1)
    ]
    # The spline between the knots rounds the jerk's corners by a little.
    assert max(use) <= 1.03
    assert max(use) > 0.95


def test_motion_begins_and_ends_at_rest_at_its_waypoints():
    motion = rest_to_rest(np.array([FROM, TO]), minimum_jerk, SpeedLimits(), PANDA_LIMITS)
    velocity = motion.MakeDerivative(1)
    assert motion.value(0)[:, 0] == pytest.approx(FROM)
    assert motion.value(motion.end_time())[:, 0] == pytest.approx(TO)
    for time in (0, motion.end_time()):
        assert velocity.value(time)[:, 0] == pytest.approx(np.zeros(7), abs=1e-9)


def test_motion_takes_at_least_the_time_asked_for():
    assert rest_to_rest(
        np.array([FROM, TO]), minimum_jerk, SpeedLimits(), PANDA_LIMITS, shortest=9.0
    ).end_time() == pytest.approx(9.0)


def test_towards_the_end_of_an_fr3s_range_a_motion_keeps_to_the_speed_that_it_may_have_there():
    near = FR3_LIMITS.position_upper - np.array([1.5, 0.05, 1.5, 1.5, 1.5, 1.5, 1.5])
    far = near - np.array([0, 0.8, 0, 0, 0, 0, 0])
    limits = SpeedLimits(velocity=0.3, acceleration=0.5, jerk=0.5)
    way = np.linspace(far, near, 20)
    there, back = (rest_to_rest(way[::step], minimum_jerk, limits, FR3_LIMITS) for step in (1, -1))
    time = np.linspace(0, there.end_time(), 2000)
    highest = FR3_LIMITS.velocity_range(there.vector_values(time).T)[1]
    use = (there.MakeDerivative().vector_values(time).T / highest)[:, 1].max()
    assert 0.28 < use <= 0.3 * 1.01
    assert back.end_time() < 0.9 * there.end_time()  # away from the end all of the speed may be had
