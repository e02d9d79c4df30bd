"""`riseg bench --driver`: what a cycle of `riseg drive-arm` costs on this machine, without a robot.

The driver follows a swing that is commanded 200 times a second, for a robot that does what it is told, as fast
as it goes. The same swing is gone through several times: a cycle does the same work each time, so the least
time that it took is the driver's, and what it took more is what the machine did meanwhile.
"""

import time

import numpy as np
from numpy.typing import NDArray
from pydrake.lcm import DrakeLcm
from rich.console import Console
from rich.table import Table

from riseg_drake.robot.command_stream import POSITION, VELOCITY
from riseg_drake.robot.kinematics import READY
from riseg_drake.robot.limits import FR3_LIMITS
from riseg_drake.robot.supervisor import MOVE
from riseg_drake.stations.arm_drive import ArmDrive, Drive, RobotReading
from riseg_drake.stations.command_session import command_message
from riseg_drake.stations.drive_process import PRIORITY, DriveProcess
from riseg_drake.stations.franka_link import Cycle
from riseg_drake.stations.lcm_channels import LcmConfig
from riseg_drake.stations.promptness import be_prompt
from riseg_drake.stations.rate_limiter import TICK

CYCLES = 5000
REPETITIONS = 5
SENT_EVERY = 5
"""Cycles between two commands."""
SWING, SWING_RATE = 0.3, np.pi
"""Between its ends, rad, and how fast its phase goes, rad/s: at 0.47 rad/s at most."""


def bench_driver(console: Console) -> None:
    """Print what cycles take, in both modes, measured and at the least."""
    be_prompt(PRIORITY)
    table = Table(title=f"work of a cycle, ms of processor time; {CYCLES} cycles, {REPETITIONS} times")
    for column in ("", "median", "99.9 % take no longer", "longest"):
        table.add_column(column)
    for mode in (POSITION, VELOCITY):
        seconds = np.array([swing_times(mode, CYCLES) for _ in range(REPETITIONS)])
        for name, times in ((f"{mode}, measured", seconds), (f"{mode}, the driver's own", seconds.min(axis=0))):
            figures = (*np.percentile(times, [50, 99.9]), times.max())
            table.add_row(name, *(f"{1e3 * figure:.2f}" for figure in figures))
    console.print(table)


def swing_times(mode: str, cycles: int) -> NDArray[np.float64]:
    """What each cycle of a swing took, s [cycles]. Raises RuntimeError where the driver did not follow it."""
    network, said = DrakeLcm("memq://"), list[str]()
    robot = _SwingingRobot(mode, cycles, network)
    drive = ArmDrive(mode == VELOCITY, FR3_LIMITS)
    process = DriveProcess(robot, network, LcmConfig(), drive, said.append, lambda: robot.now)
    robot.done = process.end
    process.run()
    if said or drive.state is not Drive.FOLLOWING:
        raise RuntimeError(f"the driver did not follow: {said or drive.state}")
    return np.array(robot.seconds)


class _SwingingRobot:
    """Does what it is told, and is its own sender of commands; `seconds` are what each cycle took, s."""

    system = "none"

    def __init__(self, mode: str, cycles: int, network: DrakeLcm):
        self._mode, self._cycles, self._network = mode, cycles, network
        self._q, self._v, self._a = np.array(READY), np.zeros(7), np.zeros(7)
        self._robot_mode = 1
        self.now = time.time()
        """Wall time, by the robot's clock, s."""
        self.seconds: list[float] = []
        self.done = lambda: None

    def read(self) -> RobotReading:
        """See Link."""
        still = np.zeros(7)
        return RobotReading(
            self.now,
            self._robot_mode,
            self._q,
            self._v,
            still,
            still,
            self._q,
            self._v,
            self._a,
            still,
            success_rate=1.0,
        )

    def control(self, is_velocity: bool, cycle: Cycle) -> None:
        """See Link."""
        self._robot_mode = MOVE
        start = self.now
        for k in range(self._cycles):
            self.now += TICK
            if k % SENT_EVERY == 0:
                phase = SWING_RATE * (self.now - start)
                values = READY + SWING / 2 * (1 - np.cos(phase))
                if is_velocity:
                    values = np.full(7, SWING / 2 * SWING_RATE * np.sin(phase))
                message = command_message(values, self._mode, self.now)
                self._network.Publish(LcmConfig.command_channel, message.encode())
            reading, started = self.read(), time.thread_time()
            values, _ = cycle(reading)
            self.seconds.append(time.thread_time() - started)
            v = values if is_velocity else (values - self._q) / TICK
            self._a = (v - self._v) / TICK
            self._q, self._v = self._q + TICK * v, v
        self.done()

    def recover(self) -> None:
        """See Link."""

    def load(self) -> tuple[float, NDArray[np.float64]]:
        """See Link."""
        return 0.0, np.zeros(3)
