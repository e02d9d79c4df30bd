"""What the least of arms says and does, over LCM within this process."""

import numpy as np
import pytest
from drake import lcmt_image_array, lcmt_panda_command, lcmt_panda_status
from pydrake.lcm import DrakeLcm

from riseg_drake.robot.kinematics import READY
from riseg_drake.stations import ideal_arm
from riseg_drake.stations.ideal_arm import IdealArm, status_message
from riseg_drake.stations.lcm_channels import LcmConfig

NOW = 1_700_000_000.25


@pytest.fixture
def network(monkeypatch):
    """A network that begins and ends in this process."""
    lcm = DrakeLcm("memq://")
    monkeypatch.setattr(ideal_arm, "open_lcm", lambda config: lcm)
    monkeypatch.setattr(ideal_arm.time, "time", lambda: NOW)
    return lcm


def heard(network, channel, kind):
    said = []
    network.Subscribe(channel, lambda data: said.append(kind.decode(data)))
    return said


def command(network, utime, position=(), velocity=()):
    message = lcmt_panda_command()
    message.utime = utime
    message.num_joint_position, message.joint_position = len(position), list(position)
    message.num_joint_velocity, message.joint_velocity = len(velocity), list(velocity)
    network.Publish(LcmConfig().command_channel, message.encode())


def test_a_status_has_its_time_in_microseconds_and_nothing_but_positions():
    q = np.linspace(-1, 1, 7)
    said = lcmt_panda_status.decode(status_message(12.345678, q).encode())
    assert said.utime == 12_345_678
    np.testing.assert_array_equal(said.joint_position, q)
    assert said.robot_mode == lcmt_panda_status.kMove
    others = [name for name in said.__slots__ if name.startswith("joint_") and name != "joint_position"]
    assert len(others) >= 6
    for name in others:
        assert list(getattr(said, name)) == [0.0] * 7
    assert status_message(1.0, q, lcmt_panda_status.kReflex).robot_mode == lcmt_panda_status.kReflex


def test_it_goes_where_positions_say_and_remembers_when(network):
    arm = IdealArm(LcmConfig())
    np.testing.assert_array_equal(arm.position, READY)
    q = np.arange(7.0)
    command(network, 2_500_000, position=q)
    arm.listen()
    np.testing.assert_array_equal(arm.position, q)
    ((stamp, said),) = arm.commands
    assert stamp == pytest.approx(2.5)
    np.testing.assert_array_equal(said, q)


def test_a_velocity_holds_until_the_next_one(network):
    arm = IdealArm(LcmConfig())
    for utime, speed in ((1_000_000, 0.5), (1_020_000, -1.0), (1_050_000, 0.0)):
        command(network, utime, velocity=[speed] * 7)
        arm.listen()
    np.testing.assert_allclose(arm.position, np.array(READY) + 0.02 * 0.5 - 0.03 * 1.0, rtol=0, atol=1e-12)
    assert [stamp for stamp, _ in arm.commands] == pytest.approx([1.0, 1.02, 1.05])
    assert [said[0] for _, said in arm.commands] == [0.5, -1.0, 0.0]


def test_it_speaks_of_its_position_mode_and_torque_now(network):
    arm, said = IdealArm(LcmConfig()), heard(network, LcmConfig().status_channel, lcmt_panda_status)
    arm.mode, arm.torque_external = lcmt_panda_status.kIdle, np.arange(7.0)
    arm.speak()
    (status,) = said
    assert status.utime == round(1e6 * NOW)
    assert status.robot_mode == lcmt_panda_status.kIdle
    np.testing.assert_array_equal(status.joint_torque_external, np.arange(7.0))
    np.testing.assert_array_equal(status.joint_position, READY)


def test_its_camera_shows_an_empty_message_of_now(network):
    arm, said = IdealArm(LcmConfig()), heard(network, LcmConfig().image_channel, lcmt_image_array)
    arm.show()
    arm.listen()
    (message,) = said
    assert (message.header.utime, message.num_images) == (round(1e6 * NOW), 0)
