"""What the arm makes of its commands when the computer is busy: everything on a clock that the test turns."""

import numpy as np
import pytest

from riseg_drake.robot.command_stream import CommandParameters
from riseg_drake.robot.kinematics import READY
from tests.stations.driver_and_stream import WALL, DriverAndStream

SWING = 0.25 * np.array([1, 0.7, -1, 0.7, 1, -1, 1])  # rad; up to 0.4 rad/s and 1.2 rad/s^2
SWING_TIME = 2.0  # s, there and back


class Session(DriverAndStream):
    """Swings and swings; the planner has a computer of its own."""

    def __init__(self, mode, seed=0, lost=0.0):
        parameters = CommandParameters()
        parameters.safety.image_age = np.inf
        super().__init__(mode, parameters=parameters, seed=seed, lost=lost)
        self.targets, self.reached = 0, 0.0

    def cycle(self):
        while 0.01 * self.targets <= self.now:
            t = 0.01 * self.targets
            share = (1 - np.cos(2 * np.pi * t / SWING_TIME)) / 2
            self.session.obey("target", WALL + t, READY + SWING * share)
            self.targets += 1
        super().cycle()
        assert self.driver.end is None, (self.now, self.driver.end)
        self.reached = max(self.reached, np.abs(self.robot.q_d - READY).max())


@pytest.mark.parametrize(
    ("mode", "where"), [("position", "asleep"), ("position", "at work"), ("velocity", "asleep")]
)
@pytest.mark.parametrize(
    "stall", [*(pytest.param(s, marks=pytest.mark.renders) for s in (0.012, 0.07)), 0.048, 0.13]
)
def test_a_stall_of_any_length_at_full_speed_is_no_reflex_and_the_motion_goes_on(stall, where, mode):
    session = Session(mode).run(1.3)
    assert np.abs(session.robot.v_d).max() > 0.3
    session.stalls[where] = stall
    session.run(1.5)
    assert session.reached > 0.24


@pytest.mark.parametrize("mode", ["position", "velocity"])
@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.renders)])
def test_a_busy_computer_and_lost_commands_are_no_reflex(seed, mode):
    session = Session(mode, seed, lost=0.02)
    while session.now < 4:
        chance = session.rng.random()
        if chance < 0.02:
            where = "asleep" if chance < 0.01 else "at work"
            session.stalls[where] = session.rng.choice([0.003, 0.008, 0.02, 0.05, 0.15])
        session.cycle()
    assert session.reached > 0.15
