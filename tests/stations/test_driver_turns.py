"""The turns of the arm's driver with a robot that plays a script: no libfranka, a millisecond at a time."""

import gc
import itertools
import weakref
from dataclasses import replace

import numpy as np
import pytest
from drake import lcmt_drake_signal, lcmt_panda_status
from pydrake.lcm import DrakeLcm

from riseg_drake.robot.kinematics import READY
from riseg_drake.robot.limits import FR3_LIMITS
from riseg_drake.robot.supervisor import MOVE, REFLEX, USER_STOPPED
from riseg_drake.stations import drive_process
from riseg_drake.stations.arm_drive import HELD, ArmDrive, Drive
from riseg_drake.stations.drive_process import DriveProcess
from riseg_drake.stations.franka_link import RobotStopped
from riseg_drake.stations.lcm_channels import LcmConfig
from tests.stations.driven_robot import DrivenRobot, command, word

IDLE, GUIDING = 1, 3


class Played:
    """A driver, the network and a robot in one; `turns` are functions by the tick in which they are called."""

    system = "a script"

    def __init__(self, turns, mode="position", robot_mode=IDLE):
        self.robot, self.turns = DrivenRobot(mode), turns
        self.robot.robot_mode, self.errors, self.done = robot_mode, (), []
        self.stops, self.refuses = "", 0
        self.network, config = DrakeLcm("memq://"), LcmConfig()
        self.statuses, self.reasons, self.said = [], [], []
        self.network.Subscribe(
            config.status_channel, lambda data: self.statuses.append(lcmt_panda_status.decode(data))
        )
        self.network.Subscribe(
            config.errors_channel,
            lambda data: self.reasons.append((self.robot.now, lcmt_drake_signal.decode(data))),
        )
        self.drive = ArmDrive(mode == "velocity", FR3_LIMITS)
        self.process = DriveProcess(
            self, self.network, config, self.drive, self.said.append, lambda: self.robot.now
        )
        self.process.run()
        self.network.HandleSubscriptions(0)

    def tick(self):
        self.network.HandleSubscriptions(0)
        self.robot.ticks += 1
        self.turns.get(self.robot.ticks, lambda played: None)(self)
        assert self.robot.ticks < 5000
        return replace(self.robot.reading(), errors=self.errors)

    def send(self, channel, message):
        self.network.Publish(channel, message if isinstance(message, bytes) else message.encode())

    def stop(self, robot_mode, errors=()):
        self.stops, self.robot.robot_mode, self.errors = ", ".join(errors) or "ended", robot_mode, errors

    # the link
    def read(self):
        return self.tick()

    def control(self, is_velocity, cycle):
        self.done.append("control")
        self.robot.robot_mode, finished = MOVE, False
        while not finished:
            reading = self.tick()
            if self.stops:
                stops, self.stops = self.stops, ""
                raise RobotStopped(stops)
            values, finished = cycle(reading)
            self.robot.follow(values)
        self.robot.robot_mode = IDLE

    def recover(self):
        self.done.append("recover")
        if self.refuses:
            self.refuses -= 1
            raise RobotStopped("Command rejected")
        self.robot.robot_mode, self.errors = IDLE, ()


def end(played):
    played.process.end()


def say_word(played):
    played.send("PANDA_COMMAND_RECOVERY", word(played.robot.now))


def modes(played, first, last):
    """robot_mode in the statuses of some ticks, the last one too."""
    ticks = {message.robot_utime // 1000 - 4_000_000: message.robot_mode for message in played.statuses}
    return [ticks[tick] for tick in range(first, last + 1)]


def test_an_idle_robot_is_controlled_at_once_and_every_cycle_tells_one_status_stamped_by_its_clock():
    played = Played({100: end})
    assert played.done == ["control"]
    assert played.said == []
    assert len(played.statuses) == played.process.cycles.count == 99  # the first reading found it idle
    assert modes(played, 2, 100) == [MOVE] * 99
    assert [message.robot_utime for message in played.statuses[-2:]] == [4000_099_000, 4000_100_000]
    assert not played.reasons


def test_the_work_of_a_cycle_is_what_this_threads_processor_time_gained_in_it(monkeypatch):
    looks = itertools.count()
    monkeypatch.setattr(drive_process.time, "thread_time", lambda: 100.0 + 2.55e-4 * next(looks))
    cycles = Played({100: end}).process.cycles
    assert cycles.percentile(1) == pytest.approx(2.55e-4, abs=1e-9)
    assert cycles.longest == pytest.approx(2.55e-4, abs=1e-9)


@pytest.mark.parametrize("mode", ["position", "velocity"])
def test_commands_on_the_network_move_the_arm_and_what_is_none_is_left_out(mode):
    rate = 0.2 * np.sin(1 + np.arange(7))

    def sender(played):
        t = played.robot.ticks * 1e-3
        way = 0.05 * (1 - np.cos(2 * np.pi * t)), 0.1 * np.pi * np.sin(2 * np.pi * t)
        values = READY + rate * way[0] if mode == "position" else rate * way[1]
        played.send("PANDA_COMMAND", command(mode, values, played.robot.now))
        if played.robot.ticks % 7 == 0:
            played.send("PANDA_COMMAND_RECOVERY", b"no command")

    turns = dict.fromkeys(range(5, 501, 5), sender)
    played = Played({**turns, 520: end}, mode)
    # Half a period of that swing, to 0.1 of the rates.
    np.testing.assert_allclose(played.robot.q, READY + 0.1 * rate, atol=2e-4)
    assert played.said == []


def test_after_a_reflex_the_names_are_told_ten_times_a_second_until_the_word_which_recovers_the_robot_once():
    played = Played(
        {
            50: lambda p: p.stop(REFLEX, ("joint_reflex", "power_limit_violation")),
            1000: say_word,
            1200: end,
        }
    )
    assert played.done == ["control", "recover", "control"]
    assert played.said == [
        "the robot takes no commands: joint_reflex, power_limit_violation; waits for the operator's word",
        "the operator says that the arm may move: recovering the robot",
    ]
    coord = ["the robot takes no commands", "joint_reflex", "power_limit_violation"]
    assert all(message.coord == coord and message.val == (1.0, 1.0, 1.0) for _, message in played.reasons)
    stamps = [1e-3 * message.timestamp for _, message in played.reasons]
    assert len(stamps) == 10
    np.testing.assert_allclose(np.diff(stamps), 0.1, atol=0.0021)
    assert modes(played, 60, 990) == [REFLEX] * 931
    assert modes(played, 1010, 1190) == [MOVE] * 181
    assert played.drive.state is Drive.WAITING


def test_a_robot_that_refuses_to_recover_is_told_with_why_and_asked_again_at_the_next_word():
    def refuse(played):
        played.refuses = 1

    played = Played(
        {
            50: lambda p: p.stop(REFLEX, ("joint_reflex",)),
            60: refuse,
            100: say_word,
            200: say_word,
            300: end,
        }
    )
    assert played.done == ["control", "recover", "recover", "control"]
    assert played.said[2] == (
        "the robot takes no commands: it does not recover: Command rejected; waits for the operator's word"
    )


def test_after_the_stop_button_was_let_go_the_word_begins_anew_and_there_is_nothing_to_recover():
    def let_go(played):
        played.robot.robot_mode = IDLE

    played = Played({50: lambda p: p.stop(USER_STOPPED), 100: let_go, 200: say_word, 300: end})
    assert played.done == ["control", "control"]
    assert played.said[0] == (
        "the robot takes no commands: the stop button is pressed; waits for the operator's word"
    )
    assert modes(played, 55, 99) == [USER_STOPPED] * 45
    assert modes(played, 110, 190) == [IDLE] * 81


@pytest.mark.parametrize(
    ("robot_mode", "errors", "reason"),
    [
        (GUIDING, (), "somebody guides the arm by hand"),
        (USER_STOPPED, (), "the stop button is pressed"),
        (0, (), "its mode is 0, not idle"),
        (0, ("joint_reflex",), "joint_reflex"),
    ],
)
def test_a_robot_that_is_not_ready_at_the_start_is_waited_for_without_a_word(robot_mode, errors, reason):
    def let_go(played):
        played.robot.robot_mode = IDLE

    def fail(played):
        played.errors = errors

    played = Played({1: fail, 100: let_go, 200: end}, robot_mode=robot_mode)
    assert played.said == [f"the robot takes no commands: {reason}; waits for the operator's word"]
    assert played.done == ["control"]
    assert modes(played, 1, 99) == [robot_mode] * 99


def test_a_reflex_from_before_the_start_is_recovered_until_that_is_granted():
    def refuse(played):
        played.refuses, played.errors = 3, ("joint_reflex",)

    played = Played({1: refuse, 100: end}, robot_mode=REFLEX)
    assert played.done == ["recover"] * 4 + ["control"]


def test_told_to_end_while_it_waits_for_a_robot_it_ends_without_control():
    assert Played({100: end}, robot_mode=GUIDING).done == []


def test_a_refused_command_is_told_with_mode_0_and_its_reason_on_the_channel_of_errors():
    def bad(played):
        played.send("PANDA_COMMAND", command("position", READY + 0.3, played.robot.now))

    played = Played({50: bad, 100: end})
    assert modes(played, 55, 99) == [HELD] * 45
    assert played.reasons[0][1].coord == [
        "holds: a command was refused",
        "it is 0.30 rad from where the arm is",
    ]


def test_a_driver_that_has_ended_is_not_kept_by_the_network_it_listened_to():
    """What C++ keeps alive Python cannot clear away at its end: Ruckig then tells of leaks in thirty lines."""
    network, robot = DrakeLcm("memq://"), DrivenRobot("position")
    drive = ArmDrive(False, FR3_LIMITS)
    process = DriveProcess(robot, network, LcmConfig(), drive, print)
    kept = [weakref.ref(process), weakref.ref(drive)]
    gc.disable()
    try:
        del process, drive
        assert [reference() for reference in kept] == [None, None]
    finally:
        gc.enable()
    network.HandleSubscriptions(0)
