"""Joint angles carry noise: a motion arrives all the same, and nothing trembles afterwards."""

import numpy as np
import pytest

from riseg_drake.robot.kinematics import READY, PandaKinematics
from tests.robot.lab import PERIOD, Lab

THERE = READY + 0.3 * np.array([1, -1, 1, 1, -1, 1, 1])


def arrival(lab, planned_end):
    """When the commands came to rest, the arm being where it should be, s after the planned end."""
    lab.run(planned_end)
    for k in range(round(3 / PERIOD)):
        if lab.stream.at_rest and lab.stream.behind == 0 and np.abs(lab.q - THERE).max() < 0.01:
            return k * PERIOD
        lab.step()
    raise AssertionError("it never arrived")


@pytest.mark.parametrize("noise", [*(pytest.param(n, marks=pytest.mark.renders) for n in (1e-5, 1e-4)), 3e-4])
@pytest.mark.parametrize("mode", ["velocity", "position"])
def test_a_motion_arrives_at_most_a_second_after_its_planned_end_however_the_angles_tremble(mode, noise):
    lab = Lab(mode, noise=noise)
    planned_end = lab.go(THERE) + lab.stream._parameters.playout.delay
    assert arrival(lab, planned_end) <= 1.0
    lab.run(0.5)
    lab.forget()
    lab.run(5.0)
    # Hardly anything is corrected that is no drift.
    still = np.ptp(lab.commands, axis=0) < 1e-9 if mode == "position" else np.abs(lab.commands) < 1e-9
    assert np.mean(still) > 0.95
    assert np.max(lab.speeds) < 2e-3
    assert np.abs(lab.q - THERE).max() < 4e-4


@pytest.mark.parametrize("drift", [0.0005, 0.004, 0.02])
def test_velocity_mode_takes_drift_back_to_within_a_millimetre_at_the_tip(drift, panda):
    lab = Lab("velocity", noise=1e-4)
    lab.go(READY)
    lab.run(0.5)
    lab.q = lab.q + drift * np.array([1, -1, 1, 1, -1, 1, -1])  # something moved the arm a little
    lab.run(4.0)
    assert np.linalg.norm(tip(panda, lab.q) - tip(panda, READY)) < 1e-3
    assert lab.stream.at_rest


def test_lag_in_a_slow_motion_is_not_taken_for_drift():
    lab = Lab("velocity")
    slow = np.full(7, 0.1)
    lab.path, lab.path_start = SteadyMotion(READY, slow, 3.0), lab.now
    lab.run(2.5)
    assert np.abs(lab.stream._limiter.velocity).max() == pytest.approx(0.1 - 0.005, abs=0.006)
    np.testing.assert_array_equal(lab.stream._drift.value, np.zeros(7))


class SteadyMotion:
    """At one speed, rad/s, after a ramp of a second."""

    def __init__(self, start, speed, seconds):
        self.start, self.speed, self.seconds = start, 0.95 * speed, seconds

    def end_time(self):
        return self.seconds

    def value(self, t):
        ramp = min(t, 1.0)
        way = ramp**3 - ramp**4 / 2 + max(t - 1.0, 0.0)
        return (self.start + self.speed * way)[:, None]


def tip(panda: PandaKinematics, q):
    return panda.X_WE(q)[:3, 3]
