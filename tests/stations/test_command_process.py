"""The process itself, on a network of its own within this machine."""

import multiprocessing
import os
import signal
import time

import numpy as np
import pytest
from drake import lcmt_panda_command, lcmt_panda_status

from riseg_drake.robot.command_stream import CommandParameters
from riseg_drake.robot.description import PandaDescription
from riseg_drake.robot.kinematics import READY
from riseg_drake.robot.supervisor import Cause, Mode
from riseg_drake.stations import command_process
from riseg_drake.stations.command_process import CommandError, CommandProcess, stream_commands
from riseg_drake.stations.command_session import FINAL_COMMANDS, command_message
from riseg_drake.stations.ideal_arm import IdealArm
from riseg_drake.stations.lcm_channels import LcmConfig, open_lcm


@pytest.mark.parametrize("mode", ["position", "velocity"])
def test_a_command_fills_the_fields_of_its_mode_and_no_others(mode):
    message = command_message(np.arange(7.0), mode, 12.5)
    sizes = {
        "position": message.num_joint_position,
        "velocity": message.num_joint_velocity,
        "torque": message.num_joint_torque,
    }
    assert sizes == {"position": 0, "velocity": 0, "torque": 0, mode: 7}
    assert message.control_mode_expected == {"position": 1, "velocity": 2}[mode]
    assert message.utime == 12_500_000
    assert lcmt_panda_command.decode(message.encode()).control_mode_expected


def speak_until(arm, condition, patience=30):
    deadline = time.monotonic() + patience
    while not condition():
        assert time.monotonic() < deadline
        arm.speak()
        time.sleep(0.002)


@pytest.mark.renders
def test_it_holds_the_arm_stops_for_a_reflex_and_ends_when_told():
    config = LcmConfig(url="udpm://239.255.76.67:7671?ttl=0")
    arm = IdealArm(config)
    with CommandProcess(config, CommandParameters(mode="position"), PandaDescription()) as commands:
        time.sleep(0.05)
        arm.listen()
        assert not arm.commands  # nothing before the arm has spoken
        speak_until(arm, lambda: len(arm.commands) > 20)
        np.testing.assert_array_equal(arm.commands[0][1], READY)
        arm.mode = lcmt_panda_status.kReflex
        speak_until(arm, lambda: commands.report.state.mode is Mode.STOPPED)
        assert commands.report.state.cause is Cause.REFLEX
        speak_until(arm, lambda: commands.report.position is None)
        arm.mode = lcmt_panda_status.kMove
        speak_until(arm, lambda: commands.report.status.robot_mode == lcmt_panda_status.kMove)
        commands.release()
        speak_until(arm, lambda: commands.report.state.may_move)
    assert len(commands.send_times) > 20


class Swinging:
    """A process that moves an arm, with camera and status, and every command that it sends."""

    def __init__(self, mode="position"):
        self.config = LcmConfig(url=f"udpm://239.255.76.67:{30000 + os.getpid() % 20000}?ttl=0")
        self.arm, self.sent = IdealArm(self.config), []
        self.ears = open_lcm(self.config)
        self.ears.Subscribe("PANDA_COMMAND", lambda raw: self.sent.append(lcmt_panda_command.decode(raw)))
        self.commands = CommandProcess(self.config, CommandParameters(mode=mode), PandaDescription())
        self.start, self.targets = time.time(), 0

    def until(self, condition, plans=True):
        deadline = time.monotonic() + 30
        while not condition():
            assert time.monotonic() < deadline
            while plans and self.targets * 0.01 <= time.time() - self.start:
                t = self.targets * 0.01
                self.commands.send_target(self.start + t, READY + 0.2 * (1 - np.cos(2 * t)))
                self.targets += 1
            report = self.commands.report if plans else None
            if report and report.state.mode is Mode.STOPPED and report.words == self.commands.words:
                self.commands.release()  # a busy computer may keep the arm from speaking for too long
            self.arm.speak()
            self.arm.show()
            self.ears.HandleSubscriptions(0)
            time.sleep(0.002)

    def speed(self):
        """Of the newest command, rad/s."""
        if len(self.sent) < 2:
            return 0.0
        a, b = self.sent[-2:]
        if b.num_joint_velocity:
            return np.abs(b.joint_velocity).max()
        return np.abs(np.subtract(b.joint_position, a.joint_position)).max() / (
            1e-6 * max(b.utime - a.utime, 1)
        )


def ctrl_c(session):
    os.kill(session.commands._process.pid, signal.SIGINT)


def die(session):
    session.commands._connection.close()


@pytest.mark.renders
def test_a_process_that_is_alone_before_it_is_ready_ends_as_one_that_is_left_alone():
    here, there = multiprocessing.Pipe()
    here.close()
    arguments = there, LcmConfig(url="memq://"), CommandParameters(), PandaDescription()
    process = multiprocessing.get_context("spawn").Process(target=stream_commands, args=arguments)
    process.start()
    process.join(60)
    assert process.exitcode == 0


@pytest.mark.renders
@pytest.mark.parametrize(("happens", "mode"), [(ctrl_c, "position"), (ctrl_c, "velocity"), (die, "position")])
def test_at_ctrl_c_or_left_alone_the_process_brings_the_arm_to_rest_and_ends(happens, mode):
    session = Swinging(mode)
    session.until(lambda: session.speed() > 0.1)
    moving = len(session.sent)
    happens(session)
    session.until(lambda: not session.commands._process.is_alive(), plans=False)
    session.ears.HandleSubscriptions(0)
    last = session.sent[-FINAL_COMMANDS // 2 :]
    assert moving < len(session.sent) - len(last)
    if mode == "velocity":
        assert {v for command in last for v in command.joint_velocity} == {0.0}
    else:
        assert {tuple(command.joint_position) for command in last} == {tuple(last[0].joint_position)}
    if happens is ctrl_c:
        assert session.commands.report.state.cause is Cause.INTERRUPT


def die_at_once(*_):
    os._exit(3)


@pytest.mark.renders
def test_a_process_that_dies_before_it_is_ready_is_told_in_one_line(monkeypatch):
    monkeypatch.setattr(command_process, "stream_commands", die_at_once)
    with pytest.raises(CommandError, match="did not start: it ended with exit code 3"):
        CommandProcess(LcmConfig(url="memq://"), CommandParameters(), PandaDescription())


@pytest.mark.renders
def test_a_process_that_cannot_begin_says_why():
    nowhere = PandaDescription(arm_url="package://riseg_drake_models/no_such.urdf")
    with pytest.raises(CommandError, match=r"did not start: \w+: .*no_such\.urdf") as error:
        CommandProcess(LcmConfig(url="memq://"), CommandParameters(), nowhere)
    assert "\n" not in str(error.value)


@pytest.mark.renders
@pytest.mark.parametrize("mode", ["position", "velocity"])
def test_garbage_in_the_pipe_brakes_the_arm_and_ends_the_process_with_the_reason(mode):
    session = Swinging(mode)
    session.until(lambda: session.speed() > 0.1)
    session.commands._connection.send_bytes(b"garbage")
    session.until(lambda: not session.commands._process.is_alive(), plans=False)
    session.ears.HandleSubscriptions(0)
    assert session.speed() == 0
    assert session.commands._process.exitcode == 1
    with pytest.raises(CommandError, match="brought the arm to rest: UnpicklingError"):
        _ = session.commands.report
