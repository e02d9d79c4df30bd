"""`riseg hardware`: the same diagram on a real robot, at wall time, with an operator."""

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import numpy as np
from drake import lcmt_panda_status
from pydrake.geometry import Meshcat, StartMeshcat
from pydrake.systems.framework import Context
from pydrake.trajectories import PiecewisePolynomial
from rich.console import Console

from riseg_drake.app.diagram import Drivers, WiredDiagram, make_diagram
from riseg_drake.app.hardware.arm_travel import ARRIVED, WayBack, straight_motion, travel
from riseg_drake.app.hardware.arm_watch import ArmWatch
from riseg_drake.app.hardware.dry_run import DryRun
from riseg_drake.app.hardware.terminal_operator import TerminalOperator
from riseg_drake.app.output import RECORDING, RunFolder, Step
from riseg_drake.app.planned_speed import check_limits, planned_limits
from riseg_drake.app.run.command import Narrator, report, state_of
from riseg_drake.app.run.interactions import Listener, Progress, TruthSource, WallClock, interactions
from riseg_drake.app.run.recording import recording_of
from riseg_drake.app.run.truth_reception import TruthReception
from riseg_drake.app.scenario import HARDWARE, Scenario, load_scenario, scenario_name
from riseg_drake.app.scenario_file import ScenarioError
from riseg_drake.app.work_state import RunStoppedError
from riseg_drake.pushing.push import Push
from riseg_drake.robot.kinematics import PandaKinematics, observation_posture
from riseg_drake.robot.supervisor import MOVE
from riseg_drake.stations.command_process import CommandProcess
from riseg_drake.stations.hardware import HardwareStationConfig
from riseg_drake.stations.lcm_channels import open_lcm, receive_buffer_warning
from riseg_drake.stations.lcm_images import ImageError, decode_images
from riseg_drake.stations.lcm_reception import Reception
from riseg_drake.systems.arm_motion import Permission
from riseg_drake.systems.stage_clock import StageClock

PATIENCE = 20.0
"""Arm and camera must have been heard after this time, s."""
ENDED = 1.0
"""The arm's status has ended when the newest is older than this, s."""
SILENCE = 5.0
"""A replayed log is over when nothing has come for this long, s."""


class HardwareError(RuntimeError):
    """Arm or camera are not there; says in one line what is missing."""


_MODES = {
    lcmt_panda_status.kOther: "other",
    lcmt_panda_status.kIdle: "idle: is the driver started with --control_mode=position or velocity?",
    lcmt_panda_status.kGuiding: "guided by hand: let go of the guiding buttons",
    lcmt_panda_status.kReflex: "reflex: unlock the robot in Desk and start the driver again",
    lcmt_panda_status.kUserStopped: "user stopped: release the user stop and start the driver again",
    lcmt_panda_status.kAutomaticErrorRecovery: "recovering from an error",
}
"""What a person does about each `robot_mode` in which the arm takes no commands."""


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
        console.print(warning, style="yellow")
    name = scenario_name(scenario_file, HARDWARE)
    dry_run = dry_run or replayed
    folder = RunFolder(
        output or Path("out") / f"{name}_{time.strftime('%Y%m%d_%H%M%S')}",
        {"scenario": name, "seed": seed, "dry_run": dry_run},
        command="hardware",
    )
    progress = Progress()
    steps: list[Step] = []
    with folder:
        try:
            with (
                state_of(folder, progress, steps),
                listening(config, replayed, truth) as (reception, truth_source),
            ):
                console.print(f"{name}, results in {folder.path}")
                browser = StartMeshcat() if meshcat or dry_run else None
                with console.status("waiting for arm and camera") as status:
                    wait_for_drivers(reception, config, ready=not dry_run, say=status.update)
                operator = TerminalOperator(console, yes)
                session = _Session(
                    scenario, seed, folder, progress, steps, reception, truth_source, operator, console, browser
                )
                if dry_run:
                    session.run_dry(yes, replayed)
                else:
                    session.run(record)
        except RunStoppedError:
            report(steps, console)
            raise
    report(steps, console)


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


def wait_for_drivers(
    reception: Reception,
    config: HardwareStationConfig,
    patience: float = PATIENCE,
    *,
    ready: bool = False,
    say: Callable[[str], None] = lambda text: None,
) -> None:
    """Return when both have been heard, and, where it must be `ready`, the arm takes commands.

    `say` is told what is waited for. Raises HardwareError after `patience`, s, and ImageError where no picture
    is of the right kind.
    """
    deadline = time.monotonic() + patience
    while problem := _what_is_missing(reception, config, ready):
        say(f"waiting: {problem}")
        if time.monotonic() >= deadline:
            left_out = "".join(f"; {line}" for line in reception.untold())
            raise HardwareError(f"{problem} within {patience:g} s at {config.lcm.url}{left_out}")
        time.sleep(0.02)


def _what_is_missing(reception: Reception, config: HardwareStationConfig, ready: bool) -> str:
    """What keeps a run from beginning; empty if nothing does. Raises ImageError."""
    silent = []
    if reception.status is None:
        silent.append(f"{config.lcm.status_channel} (is drake-franka-driver running?)")
    if not reception.pictures:
        silent.append(f"{config.lcm.image_channel} (is realsense_rgbd_publisher running, with that serial?)")
    if silent:
        return f"nothing came on {' nor on '.join(silent)}"
    status = reception.status
    assert status is not None
    if ready and reception.clock() - status.time > ENDED:
        return f"{config.lcm.status_channel} has ended (start drake-franka-driver again), and nothing more came"
    if ready and status.robot_mode != MOVE:
        return f"robot_mode is {status.robot_mode} ({_MODES[status.robot_mode]}), and did not change"
    newest = reception.newest_picture(after=-np.inf)
    if newest is None:
        return "no picture came that can be used"
    sent, message = newest
    try:
        decode_images(message, (config.camera.full_width, config.camera.full_height))
    except ImageError as error:
        reception.skip(sent, error)
        return "no picture came that can be used"
    reception.used()
    return ""


class _Session:
    """One run with everything that it needs."""

    def __init__(
        self,
        scenario: Scenario,
        seed: int,
        folder: RunFolder,
        progress: Progress,
        steps: list[Step],
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
        self._progress, self._steps = progress, steps
        self._heard = (0, time.monotonic())
        self._stopped = False

    def run(self, record: bool) -> None:
        """Move the arm. Raises RunStoppedError if it was stopped for good."""
        kinematics = PandaKinematics(self._config.panda)
        q_observe = self._observation_posture(kinematics)
        with ExitStack() as stack:
            commands = stack.enter_context(
                CommandProcess(self._config.lcm, self._config.command, self._config.panda)
            )
            self._go_to(q_observe, kinematics, commands)
            way_back = WayBack(kinematics, q_observe, planned_limits(self._scenario), commands)
            wired = make_diagram(
                self._scenario,
                self._seed,
                self._meshcat,
                drivers=Drivers(self._reception, commands, way_back.take),
                permit=self._permit,
            )
            listeners: list[Listener] = []
            if record:
                recording = recording_of(
                    wired, self._scenario, self._seed, self._truth, self._folder.path / RECORDING
                )
                listeners.append(stack.enter_context(recording))
            off_path = self._config.command.safety.off_path
            watch = ArmWatch(wired, commands, self._operator, self._progress, way_back, off_path)
            try:
                self._interact(wired, lambda context: watch(context) or self._is_silent(PATIENCE), listeners)
            finally:
                self._folder.note(
                    pauses=watch.pauses,
                    messages_left_out={"seen": self._reception.left_out, "commanding": commands.left_out},
                )
            if self._stopped:
                raise RunStoppedError(self._progress.end)
        self._note_gaps(commands)

    def _note_gaps(self, commands: CommandProcess) -> None:
        """How evenly commands were sent; known once they have ended."""
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

    def run_dry(self, unasked: bool, replayed: bool) -> None:
        """Show what would be done from where the arm is, and move nothing."""
        assert self._reception.status is not None
        # Where the arm stands it looks from.
        self._config.start_position = [float(q) for q in self._reception.status.position]
        operator = None if unasked else self._operator
        showing = DryRun(self._scenario, self._meshcat, operator, self._console, self._progress)
        wired = make_diagram(
            self._scenario,
            self._seed,
            self._meshcat,
            drivers=Drivers(self._reception),
            permit=(lambda push: Permission.WAIT) if replayed else showing.permit,
        )
        self._interact(wired, lambda _: self._is_silent(SILENCE if replayed else PATIENCE), [])
        if self._stopped and not replayed:
            raise RunStoppedError(self._progress.end)

    def _interact(
        self, wired: WiredDiagram, look: Callable[[Context], bool], listeners: list[Listener]
    ) -> None:
        with self._console.status("looking") as status:
            narrator = Narrator(self._console, status)
            listeners = [lambda *_: narrator.follow(self._progress), *listeners]
            wall = WallClock(self._reception.clock(), lambda context: self._look(look, context))
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
                kinematics, config.centre_W, config.observe_height, config.start_position, config.observe_pitch
            )
        except ValueError as error:
            raise ScenarioError(str(error)) from None

    def _go_to(self, q: np.ndarray, kinematics: PandaKinematics, commands: CommandProcess) -> None:
        assert self._reception.status is not None
        here = self._reception.status.position
        if np.abs(here - q).max() < ARRIVED / 2:
            return

        def plan(q_from: np.ndarray) -> PiecewisePolynomial:
            return straight_motion(kinematics, q_from, q, planned_limits(self._scenario))

        turn = np.degrees(np.abs(q - here).max())
        self._operator.confirm(
            f"the arm goes to where it looks from, {turn:.0f} degrees in {plan(here).end_time():.1f} s"
        )
        travel(plan, commands, self._reception, self._operator)

    def _permit(self, push: Push) -> Permission:
        said = self._operator.permit(push)
        if said is Permission.END:
            self._progress.end = self._operator.why_quit
        return said

    def _look(self, look: Callable[[Context], bool], context: Context) -> bool:
        """Whether something from outside has brought the run to its end."""
        for line in self._reception.untold():
            self._operator.tell(line)
        was_over = bool(self._progress.end)  # by the operator's word, say
        self._stopped = look(context) and not was_over
        return self._stopped or was_over

    def _is_silent(self, patience: float) -> bool:
        """Whether the camera has said nothing for `patience`, s."""
        pictures, since = self._heard
        if self._reception.pictures != pictures:
            self._heard = (self._reception.pictures, time.monotonic())
        elif time.monotonic() - since > patience:
            self._progress.end = f"no picture has come for {patience:g} s"
            return True
        return False
