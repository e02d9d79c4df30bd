"""An arm on LCM that is always where it is told to be: the least that commands can be tried on."""

import time

import numpy as np
from drake import lcmt_image_array, lcmt_panda_command, lcmt_panda_status
from numpy.typing import NDArray

from riseg_drake.robot.kinematics import READY
from riseg_drake.stations.lcm_channels import LcmConfig, open_lcm


def status_message(
    now: float, position: NDArray[np.float64], mode: int = lcmt_panda_status.kMove
) -> lcmt_panda_status:
    """What a Panda's driver says at a time, s, of joints at rest, rad [7], without any torque."""
    message = lcmt_panda_status()
    message.utime = round(1e6 * now)
    message.num_joints = 7
    for name in message.__slots__:
        if name.startswith("joint_"):
            setattr(message, name, [0.0] * 7)
    message.joint_position = position.tolist()
    message.robot_mode = mode
    return message


class IdealArm:
    """Says what a Panda's driver says, and remembers what it is told. Nothing is checked, late or expires."""

    def __init__(self, config: LcmConfig):
        self._config = config
        self._lcm = open_lcm(config)
        self._lcm.Subscribe(config.command_channel, self._take)
        self.position: NDArray[np.float64] = np.array(READY)
        """Joint angles, rad [7]: where the commands have brought it."""
        self.mode: int = lcmt_panda_status.kMove
        self.torque_external: NDArray[np.float64] = np.zeros(7)
        """N m [7]"""
        self.commands: list[tuple[float, NDArray[np.float64]]] = []
        """Stamps, s, of all commands so far, and what they said, rad or rad/s [7]."""

    def speak(self) -> None:
        """Publish a status of now, and take in what has come."""
        message = status_message(time.time(), self.position, self.mode)
        message.joint_torque_external = self.torque_external.tolist()
        self._lcm.Publish(self._config.status_channel, message.encode())
        self.listen()

    def show(self) -> None:
        """Publish a message of the camera of now, without any picture in it."""
        message = lcmt_image_array()
        message.header.utime = int(1e6 * time.time())
        self._lcm.Publish(self._config.image_channel, message.encode())

    def listen(self) -> None:
        """Take in the commands that have come."""
        self._lcm.HandleSubscriptions(0)

    def _take(self, data: bytes) -> None:
        command = lcmt_panda_command.decode(data)
        stamp = 1e-6 * command.utime
        if command.num_joint_velocity:
            if self.commands:
                before, velocity = self.commands[-1]
                self.position = self.position + (stamp - before) * velocity
            self.commands.append((stamp, np.array(command.joint_velocity)))
        else:
            self.position = np.array(command.joint_position)
            self.commands.append((stamp, self.position))
