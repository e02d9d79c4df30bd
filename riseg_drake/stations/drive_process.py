"""The process that drives a real arm: the robot's clock is its only one, LCM and libfranka its two sides.

One thread: each of the robot's milliseconds it asks the network what has come, does an ArmDrive's step, answers
the robot and publishes. Nothing in here decides anything; that is ArmDrive's.
"""

import time
from collections.abc import Callable
from contextlib import suppress
from functools import partial

import numpy as np
from drake import lcmt_panda_command
from numpy.typing import NDArray
from pydrake.lcm import DrakeLcmInterface

from riseg_drake.robot.supervisor import REFLEX
from riseg_drake.stations.arm_drive import ArmDrive, Drive, DriveOutput, RobotReading
from riseg_drake.stations.cycle_times import CycleTimes
from riseg_drake.stations.driver_reasons import reasons_message
from riseg_drake.stations.franka_link import Link, RobotStopped
from riseg_drake.stations.lcm_channels import LcmConfig

PRIORITY = 80
"""Among real-time processes, where the system allows that: before the one that sends commands."""

_STOPPED_BY = {3: "somebody guides the arm by hand", 5: "the stop button is pressed"}
_IDLE = 1
_TELL_ERRORS = 0.1  # s; between two messages with the names of errors, while there are any


class DriveProcess:
    """An arm's driver between a network and a robot; `run` returns when it was told to `end`.

    `cycles` tells how long the work of a controlled cycle took, s of this thread's processor time.
    """

    def __init__(
        self,
        link: Link,
        network: DrakeLcmInterface,
        config: LcmConfig,
        drive: ArmDrive,
        tell: Callable[[str], None],
        wall: Callable[[], float] = time.time,
    ):
        self._link, self._network, self._config, self._drive = link, network, config, drive
        self._tell, self._wall = tell, wall
        self._commands, self._words = list[lcmt_panda_command](), list[lcmt_panda_command]()
        self._is_ending = False
        self._recovers = False
        self._told_errors = -np.inf
        self.cycles = CycleTimes()
        # Not by `self`, whom the network then kept alive, beyond what Python's end can clear away.
        network.Subscribe(config.command_channel, partial(_decode, self._commands))
        network.Subscribe(config.recovery_channel, partial(_decode, self._words))

    def end(self) -> None:
        """Bring the arm to rest, and return from `run`."""
        self._is_ending = True
        self._drive.end()

    def run(self) -> None:
        """Drive the arm. Raises LinkError where there is no robot any more."""
        self._recovers = self._begin()
        while not self._is_ending:
            if self._recovers:
                self._control()
            else:
                self._watch(self._link.read())

    def _begin(self) -> bool:
        """Wait until the robot is ready; that somebody has started the driver is the operator's first word."""
        while not self._is_ending:
            reading = self._link.read()
            if reading.mode == _IDLE:
                return True
            self._say(self._drive.lose(self._wall(), self._reason(reading.mode, ", ".join(reading.errors))))
            self._step(reading)
            if reading.mode == REFLEX:
                with suppress(RobotStopped):
                    self._link.recover()
        return False

    def _control(self) -> None:
        """Until the robot stops, or the arm is at rest for good."""
        self._recovers = False
        begun = False

        def cycle(reading: RobotReading) -> tuple[NDArray[np.float64], bool]:
            nonlocal begun
            started = time.thread_time()
            if not begun:
                self._drive.begin(reading)
                begun = True
            output = self._step(reading)
            self.cycles.add(time.thread_time() - started)
            assert output.command is not None
            return output.command, output.finished

        try:
            self._link.control(self._drive.is_velocity, cycle)
        except RobotStopped as stopped:
            reading = self._link.read()
            self._say(self._drive.lose(self._wall(), self._reason(reading.mode, str(stopped))))

    def _watch(self, reading: RobotReading) -> None:
        """The robot takes no commands: tell how it is, and recover it at the operator's word."""
        output = self._step(reading)
        if not output.recover:
            return
        try:
            if reading.mode != _IDLE:
                self._link.recover()
            self._recovers = True
        except RobotStopped as refused:
            self._say(self._drive.lose(self._wall(), f"it does not recover: {refused}"))

    def _step(self, reading: RobotReading) -> DriveOutput:
        self._network.HandleSubscriptions(0)
        commands, self._commands[:] = self._commands.copy(), []
        words, self._words[:] = self._words.copy(), []
        output = self._drive.step(self._wall(), reading, commands, words)
        self._network.Publish(self._config.status_channel, output.status.encode())
        self._say(output.said)
        if self._drive.state is not Drive.FOLLOWING and self._drive.reason:
            self._publish_reason()
        return output

    def _publish_reason(self) -> None:
        now = self._wall()
        if abs(now - self._told_errors) < _TELL_ERRORS:
            return
        self._told_errors = now
        message = reasons_message(self._drive.state.value, self._drive.reason.split(", "), now)
        self._network.Publish(self._config.errors_channel, message.encode())

    def _reason(self, mode: int, errors: str) -> str:
        if mode in _STOPPED_BY:
            return _STOPPED_BY[mode]
        return errors or f"its mode is {mode}, not idle"

    def _say(self, lines: list[str]) -> None:
        for line in lines:
            self._tell(line)


def _decode(into: list[lcmt_panda_command], data: bytes) -> None:
    """LCM calls this from C, where nothing may be raised; what cannot be decoded is no command."""
    try:
        into.append(lcmt_panda_command.decode(data))
    except Exception:
        return
