"""`riseg drive-arm`: the driver of a real Franka Research 3 or Panda, between LCM and libfranka."""

import signal
import threading
import time
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from riseg_drake.app.hardware.command import HARDWARE
from riseg_drake.app.scenario import load_scenario
from riseg_drake.host.processes import ended_at_once
from riseg_drake.robot.command_stream import VELOCITY
from riseg_drake.robot.description import PandaDescription
from riseg_drake.robot.kinematics import PandaKinematics
from riseg_drake.robot.limits import RobotLimits
from riseg_drake.stations.arm_drive import ArmDrive
from riseg_drake.stations.drive_process import PRIORITY, DriveProcess
from riseg_drake.stations.franka_link import FrankaLink, Link, LinkError, RobotStopped
from riseg_drake.stations.lcm_channels import open_lcm
from riseg_drake.stations.promptness import be_prompt

CHECKED_FOR = 5.0
"""`--check` reads for so long, s."""
LOAD, LOAD_CENTER = 0.05, 0.02
"""By how much the load that is set in Desk may differ from the scenario's tool, kg and m."""
SLOWEST_RATE = 990.0
"""Fewer states a second than these are too few to be controlled by, 1/s."""


@dataclass(frozen=True)
class DriveRequest:
    """What was asked for."""

    ip: str
    scenario: Path | None = None
    mode: str | None = None
    check: bool = False


def drive_arm_command(request: DriveRequest, console: Console) -> None:
    """Drive the arm until Ctrl-C, or only look at it. Raises LinkError, LcmError, ScenarioError."""
    config = load_scenario(request.scenario, HARDWARE).hardware
    robot, mode = config.panda.robot, request.mode or config.command.mode
    network = open_lcm(config.lcm)
    tell = partial(console.print, highlight=False, soft_wrap=True)
    tell(
        f"drive-arm: connecting to {request.ip}; where nobody answers, that takes a minute, and where another "
        "program drives the robot, as long as it does"
    )
    with ended_at_once():
        link = FrankaLink(robot, request.ip)
    if request.check:
        checks = Checks(link, config.panda, X_WC=config.camera.fixed_pose)
        for line in checks.lines():
            tell(line)
        if checks.problems:
            raise LinkError("; ".join(checks.problems))
        return
    try:
        link.configure()
    except RobotStopped as stopped:
        tell(f"forces of its reflexes were not set: {stopped}")
    drive = ArmDrive(mode == VELOCITY, config.panda.limits)
    process = DriveProcess(link, network, config.lcm, drive, lambda line: tell(f"drive-arm: {line}"))
    tell(
        f"drive-arm: {robot} at {request.ip}, commands of {mode} from {config.lcm.command_channel}; "
        "Ctrl-C brings the arm to rest and ends"
    )
    with _ended_by_signals(process):
        be_prompt(PRIORITY)
        process.run()
    if process.cycles.count:
        tell(f"drive-arm: work of a cycle {process.cycles.told()}")


class _ended_by_signals:  # noqa: N801 - is read as a context manager
    """Ctrl-C and `kill` bring the arm to rest first."""

    def __init__(self, process: DriveProcess):
        self._process = process
        self._before: dict[int, Any] = {}

    def __enter__(self) -> None:
        if threading.current_thread() is threading.main_thread():
            for end in (signal.SIGINT, signal.SIGTERM):
                self._before[end] = signal.signal(end, lambda *_: self._process.end())

    def __exit__(self, *_: object) -> None:
        for end, handler in self._before.items():
            signal.signal(end, handler)


class Checks:
    """Reads a robot for a while, and moves nothing; `problems` are what keeps it from being driven."""

    def __init__(
        self,
        link: Link,
        panda: PandaDescription,
        seconds: float = CHECKED_FOR,
        X_WC: np.ndarray | None = None,
    ):
        """`seconds` is for how long it reads, s; with X_WC [4, 4] the camera is there, and not on the tool."""
        self._link, self._panda, self._X_WC, self._seconds = link, panda, X_WC, seconds
        self.problems: list[str] = []

    def lines(self) -> list[str]:
        """What was found, a line for each; takes `seconds` by the robot's clock. Raises LinkError."""
        first = last = self._link.read()
        started, count = time.monotonic(), 0
        while last.time - first.time < self._seconds:
            last = self._link.read()
            count += 1
        rate = count / (time.monotonic() - started)
        if rate < SLOWEST_RATE:
            self.problems.append(
                f"{rate:.0f} states a second came; expected 1000: wire the control box directly, and let this "
                "computer do nothing else"
            )
        modes = ("other", "idle", "move", "guiding", "reflex", "user stopped", "recovering")
        errors = f", errors: {', '.join(last.errors)}" if last.errors else ""
        return [
            f"robot: {self._panda.robot}; {self._link.system}",
            f"mode: {modes[last.mode]}{errors}",
            f"rate: {rate:.1f} states a second over {self._seconds:g} s",
            self._joints(last.position, self._panda.limits),
            self._load(),
        ]

    def _joints(self, q: np.ndarray, limits: RobotLimits) -> str:
        room = limits.room(q)
        if not (room >= 0).all():
            joint = int(np.argmin(room)) + 1
            self.problems.append(
                f"joint {joint} is {-room.min():.3f} rad out of the range of station.panda.robot: "
                f"{self._panda.robot}; is it the other robot?"
            )
        return f"limits: every joint keeps {room.min():.2f} rad to the ends of its range"

    def _load(self) -> str:
        mass, center = self._link.load()
        tool_mass, tool_center = tool_load(self._panda, self._X_WC)
        words = (
            f"load set in Desk: {mass:.2f} kg at {_listed(center)} m from the flange; the scenario's tool: "
            f"{tool_mass:.2f} kg at {_listed(tool_center)} m"
        )
        if abs(mass - tool_mass) > LOAD or np.abs(center - tool_center).max() > LOAD_CENTER:
            self.problems.append(
                f"the load set in Desk is {mass:.2f} kg at {_listed(center)} m; the scenario's tool is "
                f"{tool_mass:.2f} kg at {_listed(tool_center)} m: set that in Desk (Settings, End-effector)"
            )
        return words


def tool_load(panda: PandaDescription, X_WC: np.ndarray | None = None) -> tuple[float, np.ndarray]:
    """Mass of a scenario's tool, kg, and its centre from the flange (panda_link8), m [3].

    With X_WC [4, 4] the camera is there, and not on the tool.
    """
    kinematics = PandaKinematics(panda, X_WC)
    plant = kinematics.plant
    context = plant.CreateDefaultContext()
    tool = [kinematics.parts.tool]
    p_WTool = plant.CalcCenterOfMassPositionInWorld(context, tool)
    X_WF = plant.GetFrameByName("panda_link8", kinematics.parts.arm).CalcPoseInWorld(context)
    return float(plant.CalcTotalMass(context, tool)), np.array(X_WF.inverse().multiply(p_WTool))


def _listed(vector: np.ndarray) -> str:
    return f"({', '.join(f'{value:.3f}' for value in vector)})"
