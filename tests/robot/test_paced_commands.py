import numpy as np
import pytest

from riseg_drake.robot.command_stream import ArmStatus, CommandParameters, CommandStream
from riseg_drake.robot.kinematics import READY
from riseg_drake.robot.limits import PANDA_LIMITS
from riseg_drake.robot.paced_commands import LONGEST_PAUSE, PacedCommands
from riseg_drake.robot.supervisor import MOVE
from riseg_drake.robot.tip_geometry import TipGeometry

WALL, STEADY, PERIOD = 1_700_000_000.0, 5000.0, 0.005
FAST = 0.25 * np.sin(np.arange(7))  # rad/s


class Client:
    """Sends the commands of a motion that goes on and on, at times of its own choice."""

    def __init__(self, mode="position"):
        parameters = CommandParameters(mode=mode)
        tip = TipGeometry(lambda q: np.array([0.5, 0.0, 0.2]), lambda q: np.eye(6, 7))
        self.stream = CommandStream(parameters, tip, PANDA_LIMITS)
        for t in np.arange(0, 5, 0.01):
            self.stream.add_target(WALL + t, READY + FAST * t)
        self.paced = PacedCommands(self.stream, STEADY)
        self.measured = READY

    def next(self, t):
        status = ArmStatus(STEADY + t, self.measured, np.zeros(7), np.zeros(7), MOVE, gap=0.001)
        return self.paced.next(STEADY + t, WALL + t, status, STEADY + t)

    def send(self, t):
        command = self.next(t)
        self.paced.was_sent(command)
        self.measured = self.stream.position
        return command

    def under_way(self):
        """For a second, always in time."""
        for k in range(200):
            self.send(k * PERIOD)
        assert np.abs(self.stream._limiter.velocity).max() > 0.2
        return self


def test_a_stamp_is_the_time_that_was_planned_however_late_the_process_is():
    rng = np.random.default_rng(0)
    client, t, stamps = Client(), 0.0, []
    for _ in range(300):
        stamps.append(client.send(t).stamp - WALL)
        t += client.paced.wait(STEADY + t) + rng.choice([0.0, 0.002, 0.013, 0.04])
        assert 0 <= t - stamps[-1] < LONGEST_PAUSE + PERIOD
    periods = np.diff(stamps) / PERIOD
    np.testing.assert_allclose(periods, np.rint(periods), atol=1e-3)
    assert set(np.rint(periods)) >= {1, 3, 9}


@pytest.mark.parametrize("pause", [0.012, 0.032, 0.049])
def test_a_short_pause_is_made_up_for_in_one_step(pause):
    late, prompt = Client().under_way(), Client().under_way()
    command = late.send(0.995 + pause)
    for k in range(200, 200 + int(pause / PERIOD)):
        expected = prompt.send(k * PERIOD)
    np.testing.assert_allclose(command.values, expected.values, atol=1e-9)
    assert command.stamp == pytest.approx(expected.stamp, abs=1e-6)


@pytest.mark.parametrize("mode", ["position", "velocity"])
def test_after_a_long_pause_the_arm_begins_where_it_has_come_to_rest(mode):
    client = Client(mode).under_way()
    held = client.stream.position
    client.measured = held + 0.03  # it went on for a while
    client.send(1.5)
    at_rest = held if mode == "position" else client.measured
    np.testing.assert_allclose(client.stream.position, at_rest, atol=1e-4)
    assert np.abs(client.stream._limiter.velocity).max() < 0.05


def test_a_command_that_took_too_long_is_not_to_be_sent_and_counts_as_a_pause():
    client = Client().under_way()
    held = client.stream.position
    command = client.next(1.0)
    assert command.is_in_time(STEADY + 1.04)
    assert not command.is_in_time(STEADY + 1.06)
    client.send(1.06)
    np.testing.assert_allclose(client.stream.position, held, atol=1e-4)
