"""`riseg hardware`: the same diagram on a real robot, at wall time, with an operator."""

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import numpy as np
from pydrake.geometry import Meshcat, StartMeshcat
from pydrake.systems.framework import Context
from rich.console import Console

from riseg_drake.app.arm_travel import ARRIVED, straight_motion, travel
from riseg_drake.app.arm_watch import ArmWatch
from riseg_drake.app.diagram import Drivers, WiredDiagram, make_diagram
from riseg_drake.app.dry_run import DryRun
from riseg_drake.app.interactions import Listener, Progress, TruthSource, WallClock, interactions
from riseg_drake.app.output import RECORDING, RunFolder, Step
from riseg_drake.app.run import Narrator, report, state_of
from riseg_drake.app.run_recording import recording_of
from riseg_drake.app.scenario import HARDWARE, Scenario, load_scenario, scenario_name
from riseg_drake.app.scenario_file import ScenarioError
from riseg_drake.app.terminal_operator import TerminalOperator
from riseg_drake.app.truth_reception import TruthReception
from riseg_drake.robot.kinematics import PandaKinematics, observation_posture
from riseg_drake.stations.command_process import CommandProcess
from riseg_drake.stations.hardware import HardwareStationConfig
from riseg_drake.stations.lcm_channels import open_lcm, receive_buffer_warning
from riseg_drake.stations.lcm_images import decode_images
from riseg_drake.stations.lcm_reception import Reception
from riseg_drake.systems.arm_motion import Permission
from riseg_drake.systems.stage_clock import StageClock

PATIENCE = 20.0
"""Arm and camera must have been heard after this time, s."""
SILENCE = 5.0
"""A replayed log is over when nothing has come for this long, s."""


class HardwareError(RuntimeError):
    """Arm or camera are not there; says in one line what is missing."""


def hardware_command(
    scenario_file: Path | None,
    seed: int,
    output: Path | None,
    record: bool,
    meshcat: bool,
    dry_run: bool,
    yes: bool,
    truth: bool,
    replayed: bool,
    console: Console,
) -> None:
    """Run the diagram against arm and camera until it is done, and say how it went."""
    scenario = load_scenario(scenario_file, HARDWARE)
    config = scenario.hardware
    check_limits(scenario)
    warning = receive_buffer_warning(config.lcm.url)
    if warning:
        console.print(f"[yellow]{warning}")
    name = scenario_name(scenario_file, HARDWARE)
    dry_run = dry_run or replayed
    folder = RunFolder(
        output or Path("out") / f"{name}_{time.strftime('%Y%m%d_%H%M%S')}",
        {"scenario": name, "seed": seed, "dry_run": dry_run},
        command="hardware",
    )
    console.print(f"{name}, results in {folder.path}")
    browser = StartMeshcat() if meshcat or dry_run else None
    operator = TerminalOperator(console, yes)
    with listening(config, replayed, truth) as (reception, truth_source):
        with console.status("waiting for arm and camera"):
            wait_for_drivers(reception, config)
        session = _Session(scenario, seed, folder, reception, truth_source, operator, console, browser)
        steps = session.run_dry(yes, replayed) if dry_run else session.run(record)
    report(steps, console)


def check_limits(scenario: Scenario) -> None:
    """Raise ScenarioError unless the arm can stop in time, and paths are slower than what it may be sent."""
    command = scenario.hardware.command
    try:
        command.check()
    except ValueError as error:
        raise ScenarioError(f"station.command: {error}") from None
    for name in ("velocity", "acceleration", "jerk"):
        planned, allowed = getattr(scenario.push.path.limits, name), getattr(command.limits, name)
        if planned > allowed:
            raise ScenarioError(
                f"push.path.limits.{name} is {planned}, more than the {allowed} that "
                f"station.command.limits.{name} lets through"
            )


@contextmanager
def listening(
    config: HardwareStationConfig, replayed: bool, truth: bool
) -> Iterator[tuple[Reception, TruthSource]]:
    """Hear arm and camera, and the emulator's truth if asked, for the time of a `with`."""
    lcm = open_lcm(config.lcm)
    reception = Reception(lcm, config.lcm, replayed)
    source: TruthSource = lambda frame, context: None  # noqa: E731
    if truth:
        source = TruthReception(lcm, config.camera.first_column, lambda: reception.offset)
    reception.start()
    try:
        yield reception, source
    finally:
        reception.stop()


def wait_for_drivers(reception: Reception, config: HardwareStationConfig, patience: float = PATIENCE) -> None:
    """Return when both have been heard.

    Raises HardwareError after `patience`, s, and ImageError for pictures of a wrong kind.
    """
    deadline = time.monotonic() + patience
    while time.monotonic() < deadline:
        if reception.status is not None and reception.pictures:
            message = reception.newest_picture(after=-np.inf)
            assert message is not None
            decode_images(message)
            return
        time.sleep(0.02)
    missing = []
    if reception.status is None:
        missing.append(f"{config.lcm.status_channel} (is drake-franka-driver running?)")
    if not reception.pictures:
        missing.append(f"{config.lcm.image_channel} (is realsense_rgbd_publisher running, with that serial?)")
    raise HardwareError(f"nothing came on {' nor on '.join(missing)} within {patience:g} s at {config.lcm.url}")


class _Session:
    """One run with everything that it needs."""

    def __init__(
        self,
        scenario: Scenario,
        seed: int,
        folder: RunFolder,
        reception: Reception,
        truth: TruthSource,
        operator: TerminalOperator,
        console: Console,
        meshcat: Meshcat | None,
    ):
        self._scenario, self._seed, self._folder = scenario, seed, folder
        self._reception, self._truth, self._operator = reception, truth, operator
        self._console, self._meshcat = console, meshcat
        self._config = scenario.hardware
        self._progress = Progress()
        self._steps: list[Step] = []
        self._heard = (0, time.monotonic())

    def run(self, record: bool) -> list[Step]:
        """Move the arm."""
        kinematics = PandaKinematics(self._config.panda)
        q_observe = self._observation_posture(kinematics)
        with ExitStack() as stack:
            stack.enter_context(state_of(self._folder, self._progress, self._steps))
            commands = stack.enter_context(
                CommandProcess(self._config.lcm, self._config.command, self._config.panda)
            )
            self._go_to(q_observe, kinematics, commands)
            wired = make_diagram(
                self._scenario,
                self._seed,
                self._meshcat,
                drivers=Drivers(self._reception, commands),
                permit=self._operator.permit,
            )
            listeners: list[Listener] = []
            if record:
                recording = recording_of(
                    wired, self._scenario, self._seed, self._truth, self._folder.path / RECORDING
                )
                listeners.append(stack.enter_context(recording))
            watch = ArmWatch(wired, commands, self._operator, self._progress)
            self._interact(wired, watch, listeners)
            self._folder.note(pauses=watch.pauses)
        if len(commands.send_times) > 1:
            gaps = np.diff(commands.send_times)
            self._folder.note(
                commands=len(commands.send_times),
                command_gap_ms={
                    "median": round(1e3 * float(np.median(gaps)), 3),
                    "p99.9": round(1e3 * float(np.percentile(gaps, 99.9)), 3),
                    "longest": round(1e3 * float(gaps.max()), 3),
                },
            )
        return self._steps

    def run_dry(self, unasked: bool, replayed: bool) -> list[Step]:
        """Show what would be done from where the arm is, and move nothing."""
        assert self._reception.status is not None
        # Where the arm stands it looks from.
        self._config.start_position = [float(q) for q in self._reception.status.position]
        showing = DryRun(self._scenario, self._meshcat, None if unasked else self._operator, self._console)
        with state_of(self._folder, self._progress, self._steps):
            wired = make_diagram(
                self._scenario,
                self._seed,
                self._meshcat,
                drivers=Drivers(self._reception),
                permit=(lambda push: Permission.WAIT) if replayed else showing.permit,
            )
            self._interact(wired, lambda _: replayed and self._is_over(), [])
        return self._steps

    def _interact(
        self, wired: WiredDiagram, look: Callable[[Context], bool], listeners: list[Listener]
    ) -> None:
        with self._console.status("looking") as status:
            narrator = Narrator(self._console, status)
            listeners = [lambda *_: narrator.follow(self._progress), *listeners]
            wall = WallClock(time.time(), look)
            for step in interactions(
                wired,
                StageClock(),
                self._progress,
                self._scenario.longest,
                tuple(listeners),
                truth=self._truth,
                wall=wall,
            ):
                self._folder.write_step(step)
                self._steps.append(step)
                narrator.tell_step(step)
        narrator.tell_end(self._progress)

    def _observation_posture(self, kinematics: PandaKinematics) -> np.ndarray:
        config = self._config
        try:
            return observation_posture(
                kinematics, config.centre_W, config.observe_height, config.start_position
            )
        except ValueError as error:
            raise ScenarioError(str(error)) from None

    def _go_to(self, q: np.ndarray, kinematics: PandaKinematics, commands: CommandProcess) -> None:
        assert self._reception.status is not None
        here = self._reception.status.position
        if np.abs(here - q).max() < ARRIVED / 2:
            return
        motion = straight_motion(kinematics, here, q, self._scenario.push.path.limits)
        turn = np.degrees(np.abs(q - here).max())
        self._operator.confirm(
            f"the arm goes to where it looks from, {turn:.0f} degrees in {motion.end_time():.1f} s"
        )
        travel(commands, motion)

    def _is_over(self) -> bool:
        """Whether a replayed log has nothing more to say."""
        pictures, since = self._heard
        if self._reception.pictures != pictures:
            self._heard = (self._reception.pictures, time.monotonic())
        elif time.monotonic() - since > SILENCE:
            self._progress.end = "the log is over"
        return bool(self._progress.end)
