"""What the arm makes of its commands when the computer is busy: everything on a clock that the test turns."""

import numpy as np
import pytest

from riseg_drake.robot.command_stream import ArmStatus, CommandParameters, CommandStream, TipGeometry
from riseg_drake.robot.kinematics import READY
from riseg_drake.robot.limits import PANDA_LIMITS
from riseg_drake.robot.paced_commands import PacedCommands
from riseg_drake.stations.command_session import command_message
from riseg_drake.stations.panda_driver import MOVE, PandaDriver, PandaDriverConfig

WALL, STEADY = 1_700_000_000.0, 5000.0  # s, at the beginning
SWING = 0.25 * np.array([1, 0.7, -1, 0.7, 1, -1, 1])  # rad; up to 0.4 rad/s and 1.2 rad/s^2
SWING_TIME = 2.0  # s, there and back


class Session:
    """Driver and command path; each may be kept from running at any moment, the driver's world goes on."""

    def __init__(self, mode, seed=0, lost=0.0):
        self.rng = np.random.default_rng(seed)
        self.lost = lost
        parameters = CommandParameters(mode=mode)
        parameters.safety.image_age = np.inf
        tip = TipGeometry(lambda q: np.array([0.5, 0.0, 0.2]), lambda q: np.eye(6, 7))
        self.mode, self.stream = mode, CommandStream(parameters, tip, PANDA_LIMITS)
        self.driver = PandaDriver(PandaDriverConfig(control_mode=mode), READY)
        self.paced = PacedCommands(self.stream, STEADY)
        self.now, self.targets = 0.0, 0
        self.reached = 0.0
        self.stalls = {"asleep": 0.0, "at work": 0.0}

    def let(self, seconds):
        """Time passes: the arm goes on, and the planner, which has a computer of its own here."""
        end = self.now + seconds
        while self.now + 1e-3 <= end + 1e-9:
            self.now += 1e-3
            self.driver.tick(round(1e6 * (WALL + self.now)))
            assert self.driver.robot_mode == MOVE, (self.now, self.driver.reflex_reason)
        self.now = end

    def plan(self):
        while 0.01 * self.targets <= self.now:
            t = 0.01 * self.targets
            share = (1 - np.cos(2 * np.pi * t / SWING_TIME)) / 2
            self.stream.add_target(WALL + t, READY + SWING * share)
            self.targets += 1

    def cycle(self):
        """One round of the command process."""
        self.plan()
        status = ArmStatus(STEADY + self.now, self.driver.q_d, self.driver.v_d, np.zeros(7), MOVE, gap=0.001)
        command = self.paced.next(STEADY + self.now, WALL + self.now, status, STEADY)
        self.let(self.stalls["at work"])
        if command is not None and command.is_in_time(STEADY + self.now):
            self.paced.was_sent(command)
            if self.rng.random() >= self.lost:
                self.driver.receive(command_message(command.values, self.mode, command.stamp))
        self.let(self.paced.wait(STEADY + self.now) + self.stalls["asleep"])
        self.stalls = dict.fromkeys(self.stalls, 0.0)
        self.reached = max(self.reached, np.abs(self.driver.q_d - READY).max())

    def run(self, seconds):
        end = self.now + seconds
        while self.now < end:
            self.cycle()
        return self


@pytest.mark.parametrize(
    ("mode", "where"), [("position", "asleep"), ("position", "at work"), ("velocity", "asleep")]
)
@pytest.mark.parametrize("stall", [0.012, 0.048, 0.07, 0.13])
def test_a_stall_of_any_length_at_full_speed_is_no_reflex_and_the_motion_goes_on(stall, where, mode):
    session = Session(mode).run(1.3)
    assert np.abs(session.driver.v_d).max() > 0.3
    session.stalls[where] = stall
    session.run(1.5)
    assert session.reached > 0.24


@pytest.mark.parametrize("mode", ["position", "velocity"])
@pytest.mark.parametrize("seed", range(2))
def test_a_busy_computer_and_lost_commands_are_no_reflex(seed, mode):
    session = Session(mode, seed, lost=0.02)
    while session.now < 4:
        chance = session.rng.random()
        if chance < 0.02:
            where = "asleep" if chance < 0.01 else "at work"
            session.stalls[where] = session.rng.choice([0.003, 0.008, 0.02, 0.05, 0.15])
        session.cycle()
    assert session.reached > 0.15
