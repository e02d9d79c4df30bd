"""The commands of `riseg hardware`, LCM, the arm's driver, libfranka and franka-sim, a millisecond at a time.

All clocks are the robot's, and the robot waits for its client: so the machine's own speed decides nothing.
"""

import gc
import os
import subprocess
import tempfile
from pathlib import Path

import numpy as np
import pytest
from pydrake.lcm import DrakeLcm

from riseg_drake.robot.command_stream import CommandParameters, CommandStream
from riseg_drake.robot.description import PandaDescription
from riseg_drake.robot.kinematics import PandaKinematics
from riseg_drake.robot.limits import FR3_LIMITS
from riseg_drake.robot.tip_geometry import TipGeometry
from riseg_drake.stations.arm_drive import ArmDrive
from riseg_drake.stations.command_session import CommandSession, command_message, word_message
from riseg_drake.stations.drive_process import DriveProcess
from riseg_drake.stations.franka_link import FrankaLink
from riseg_drake.stations.lcm_channels import LcmConfig

SERVER = Path(__file__).with_name("franka_server.py")
PYTHON = "RISEG_FRANKA_SIM_PYTHON"
WALL = 1_700_000_000.0


def franka_python():
    """A Python that has franka-sim, while this one has pylibfranka; else the test is skipped."""
    pytest.importorskip("pylibfranka", reason="no pylibfranka: pip install 'riseg-drake[fr3]'")
    python = os.environ.get(PYTHON)
    if not python:
        pytest.skip(f"no franka-sim: {PYTHON} names the Python of an environment that has it")
    return python


class FrankaServer:
    """franka_server.py in a process of its own; as a context."""

    def __init__(self, address, q, *options):
        self.address = address
        self.file = Path(tempfile.mkdtemp()) / "rows.npy"
        self.process = subprocess.Popen(
            [
                franka_python(),
                str(SERVER),
                str(self.file),
                address,
                ",".join(map(repr, map(float, q))),
                *options,
            ],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )
        assert self.process.stdout.readline() == "ready\n"

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.wait()

    def say(self, words):
        self.process.stdin.write(words + "\n")
        self.process.stdin.flush()
        while not self.process.stdout.readline().startswith("done"):
            assert self.process.poll() is None

    def rows(self):
        """robot_mode [N], q_d [N, 7] and q [N, 7] of all cycles so far."""
        self.say("save")
        rows = np.load(self.file)
        return rows[:, 0].astype(int), rows[:, 1:8], rows[:, 8:15]


class SteppedLink:
    """The real link; before each of the robot's cycles others have their turn."""

    def __init__(self, link, turn):
        self.link, self.turn, self.time = link, turn, 0.0

    def read(self):
        reading = self.link.read()
        self._pass(reading)
        return reading

    def control(self, is_velocity, cycle):
        def stepped(reading):
            self._pass(reading)
            return cycle(reading)

        self.link.control(is_velocity, stepped)

    def recover(self):
        self.link.recover()

    def _pass(self, reading):
        self.time = reading.time
        self.turn()


class Rig:
    """All of it; `targets` [N, 7] of a motion, one each 10 ms, begin after half a second.

    `events` are functions by the tick at which they are called, in `run`.
    """

    def __init__(self, server, mode, targets):
        self.server, self.targets, self.mode = server, targets, mode
        self.network = DrakeLcm("memq://")
        self.config = LcmConfig()
        kinematics = PandaKinematics(PandaDescription(robot="fr3"))
        tip = TipGeometry(lambda q: kinematics.X_WE(q)[:3, 3], kinematics.tip_jacobian)
        self.stream = CommandStream(CommandParameters(mode=mode), tip, FR3_LIMITS)
        self.session = CommandSession(self.stream, WALL, "PANDA_STATUS", "camera")
        self.network.Subscribe("PANDA_STATUS", self.session.hear_status)
        self.link = SteppedLink(FrankaLink("fr3", server.address), self._turn)
        self.link.link.configure()
        self.said, self.ticks, self.sent = [], 0, 0
        self.events, self.sends = {}, True
        self.drive = ArmDrive(mode == "velocity", FR3_LIMITS)
        self.process = DriveProcess(
            self.link, self.network, self.config, self.drive, self.said.append, lambda: self.now
        )
        self.kinematics = kinematics

    @property
    def now(self):
        return WALL + self.link.time

    def run(self, ticks):
        self.last = self.ticks + ticks
        gc.collect()
        gc.freeze()
        gc.disable()  # as `riseg drive-arm` does
        try:
            self.process.run()
        finally:
            gc.enable()
        return self

    def publish(self, values):
        """A command that nobody has looked at."""
        self.network.Publish("PANDA_COMMAND", command_message(values, self.mode, self.now).encode())

    def _turn(self):
        self.ticks += 1
        if self.ticks in self.events:
            self.events[self.ticks]()
        if self.ticks % 10 == 0 and self.ticks >= 500 and self.sent < len(self.targets):
            self.session.obey("target", self.now, self.targets[self.sent])
            self.sent += 1
        if self.ticks % 5 == 0 and self.sends:
            # The camera sees as well as it can: pictures are not what is tried here.
            self.session._image_time = self.now
            command = self.session.next(self.now, self.now)
            if command is not None:
                message = command_message(command.values, self.mode, command.stamp)
                self.network.Publish("PANDA_COMMAND", message.encode())
                self.session.was_sent(command)
            if self.session.word_said is not None:
                message = word_message(self.session.word_said)
                self.network.Publish(self.config.recovery_channel, message.encode())
        if self.ticks == self.last:
            self.process.end()
