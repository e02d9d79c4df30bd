"""The process itself, on a network of its own within this machine."""

import time

import numpy as np
import pytest
from drake import lcmt_panda_command, lcmt_panda_status
from pydrake.lcm import DrakeLcm

from riseg_drake.robot.command_stream import CommandParameters
from riseg_drake.robot.description import PandaDescription
from riseg_drake.robot.kinematics import READY
from riseg_drake.robot.supervisor import Cause, Mode
from riseg_drake.stations.command_process import CommandProcess, command_message
from riseg_drake.stations.lcm_channels import LcmConfig


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


class StillArm:
    """An arm on LCM that stands still, and remembers what it is told."""

    def __init__(self, config):
        self.lcm = DrakeLcm(config.url)
        self.config = config
        self.commands = []
        self.lcm.Subscribe(config.command_channel, lambda data: self.commands.append(data))

    def speak(self, mode=lcmt_panda_status.kMove):
        message = lcmt_panda_status()
        message.num_joints = 7
        for name in message.__slots__:
            if name.startswith("joint_"):
                setattr(message, name, [0.0] * 7)
        message.joint_position = [float(q) for q in READY]
        message.utime = int(1e6 * time.time())
        message.robot_mode = mode
        self.lcm.Publish(self.config.status_channel, message.encode())
        self.lcm.HandleSubscriptions(2)

    def until(self, condition, mode=lcmt_panda_status.kMove, patience=30):
        deadline = time.monotonic() + patience
        while not condition():
            assert time.monotonic() < deadline
            self.speak(mode)


@pytest.mark.renders
def test_it_holds_the_arm_stops_for_a_reflex_and_ends_when_told():
    config = LcmConfig(url="udpm://239.255.76.67:7671?ttl=0")
    arm = StillArm(config)
    with CommandProcess(config, CommandParameters(), PandaDescription()) as commands:
        arm.lcm.HandleSubscriptions(50)
        assert not arm.commands  # nothing before the arm has spoken
        arm.until(lambda: len(arm.commands) > 20)
        first = lcmt_panda_command.decode(arm.commands[0])
        np.testing.assert_array_equal(first.joint_position, READY)
        arm.until(lambda: commands.report.state.mode is Mode.STOPPED, lcmt_panda_status.kReflex)
        assert commands.report.state.cause is Cause.REFLEX
        arm.until(lambda: commands.report.position is None, lcmt_panda_status.kReflex)
        commands.release()
        arm.until(lambda: commands.report.state.may_move)
    assert len(commands.send_times) > 20
