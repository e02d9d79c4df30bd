"""The process itself, on a network of its own within this machine."""

import time

import numpy as np
import pytest
from drake import lcmt_panda_command, lcmt_panda_status

from riseg_drake.robot.command_stream import CommandParameters
from riseg_drake.robot.description import PandaDescription
from riseg_drake.robot.kinematics import READY
from riseg_drake.robot.supervisor import Cause, Mode
from riseg_drake.stations.command_process import CommandProcess, command_message
from riseg_drake.stations.ideal_arm import IdealArm
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
    with CommandProcess(config, CommandParameters(), PandaDescription()) as commands:
        time.sleep(0.05)
        arm.listen()
        assert not arm.commands  # nothing before the arm has spoken
        speak_until(arm, lambda: len(arm.commands) > 20)
        np.testing.assert_array_equal(arm.commands[0][1], READY)
        arm.mode = lcmt_panda_status.kReflex
        speak_until(arm, lambda: commands.report.state.mode is Mode.STOPPED)
        assert commands.report.state.cause is Cause.REFLEX
        speak_until(arm, lambda: commands.report.position is None)
        commands.release()
        arm.mode = lcmt_panda_status.kMove
        speak_until(arm, lambda: commands.report.state.may_move)
    assert len(commands.send_times) > 20
