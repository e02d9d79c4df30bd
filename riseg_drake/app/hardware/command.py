"""`riseg hardware`: the same diagram on a real robot, at wall time, with an operator."""

import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydrake.geometry import Meshcat, StartMeshcat
from pydrake.systems.framework import Context
from pydrake.trajectories import PiecewisePolynomial
from rich.console import Console

from riseg_drake.app.diagram import Drivers, WiredDiagram, make_diagram
from riseg_drake.app.exports import Exports, exporting
from riseg_drake.app.hardware.arm_travel import ARRIVED, WayBack, straight_motion, travel
from riseg_drake.app.hardware.arm_watch import ArmWatch
from riseg_drake.app.hardware.drivers import PATIENCE, listening, wait_for_drivers
from riseg_drake.app.hardware.dry_run import DryRun
from riseg_drake.app.hardware.planned_motion import PlannedMotion
from riseg_drake.app.hardware.terminal_operator import TerminalOperator
from riseg_drake.app.loop_request import LoopRequest
from riseg_drake.app.meshcat_replay import replay, stay
from riseg_drake.app.output import RECORDING, REPLAY, RunFolder, Step
from riseg_drake.app.planned_speed import check_limits, planned_limits
from riseg_drake.app.report_page import REPORT
from riseg_drake.app.run.command import Narrator, export_listener, report, state_of, timeline_listener
from riseg_drake.app.run.interactions import Listener, Progress, TruthSource, WallClock, interactions
from riseg_drake.app.run.recording import recording_of
from riseg_drake.app.scenario import HARDWARE, Scenario, load_scenario, scenario_name
from riseg_drake.app.scenario_file import ScenarioError
from riseg_drake.app.timelines import Timeline, percent
from riseg_drake.app.work_state import RunStoppedError
from riseg_drake.pushing.push import Push
from riseg_drake.robot.kinematics import PandaKinematics, observation_posture
from riseg_drake.stations.command_process import CommandProcess
from riseg_drake.stations.lcm_channels import receive_buffer_warning
from riseg_drake.stations.lcm_reception import Reception
from riseg_drake.systems.arm_motion import Permission
from riseg_drake.systems.stage_clock import StageClock

SILENCE = 5.0
"""A replayed log is over when nothing has come for this long, s."""


@dataclass(frozen=True)
class HardwareRequest(LoopRequest):
    """What is to be done with the real arm, or shown of what it would do."""

    dry_run: bool = False
    """Whether nothing moves."""
    yes: bool = False
    """Whether nobody is asked before a motion."""
    truth: bool = False
    """Whether the emulator's true labels are heard."""
    replayed: bool = False
    """Whether a log is heard in place of drivers; then nothing moves."""


def hardware_command(request: HardwareRequest, console: Console) -> None:
    """Run the diagram against arm and camera until it is done, and say how it went."""
    scenario = load_scenario(request.scenario, HARDWARE)
    config = scenario.hardware
    check_limits(scenario)
    warning = receive_buffer_warning(config.lcm.url)
    if warning:
        console.print(warning, style="yellow")
    name = scenario_name(request.scenario, HARDWARE)
    seed, dry_run = request.seed, request.dry_run or request.replayed
    output = request.output or Path("out") / f"{name}_{time.strftime('%Y%m%d_%H%M%S')}"
    exports, timeline = Exports(output, request.export, request.export_frames), Timeline(request.rerun, output)
    folder = RunFolder(
        output,
        {"scenario": name, "seed": seed, "dry_run": dry_run},
        command="hardware",
    )
    progress = Progress()
    steps: list[Step] = []
    browser = StartMeshcat() if request.meshcat or dry_run else None
    operator = TerminalOperator(console, request.yes)
    with folder:
        try:
            with (
                state_of(folder, progress, steps),
                exporting(exports, folder.note),
                listening(config, request.replayed, request.truth) as (reception, truth_source),
            ):
                console.print(f"{name}, results in {folder.path}")
                with console.status("waiting for arm and camera") as status:
                    wait_for_drivers(reception, config, ready=not dry_run, say=status.update)
                session = _Session(
                    scenario=scenario,
                    seed=seed,
                    folder=folder,
                    progress=progress,
                    steps=steps,
                    reception=reception,
                    truth=truth_source,
                    operator=operator,
                    console=console,
                    meshcat=browser,
                    exports=exports,
                    timeline=timeline,
                )
                if dry_run:
                    session.run_dry(request.yes, request.replayed)
                else:
                    session.run(request.record)
        except RunStoppedError:
            report(steps, console)
            exports.tell(console)
            raise
    report(steps, console)
    exports.tell(console)
    timeline.tell(console)
    console.print(f"to look at: {folder.path / REPORT}", highlight=False, soft_wrap=True)
    if browser is not None:
        stay(browser, folder.path / REPLAY, console, request.wait, operator.wait_for_enter)


@dataclass(kw_only=True)
class _Session:
    """One run with everything that it needs."""

    scenario: Scenario
    seed: int
    folder: RunFolder
    progress: Progress
    steps: list[Step]
    reception: Reception
    truth: TruthSource
    operator: TerminalOperator
    console: Console
    meshcat: Meshcat | None
    exports: Exports
    timeline: Timeline

    def __post_init__(self) -> None:
        self._config = self.scenario.hardware
        clock = self.reception.clock
        self._planned = None if self.meshcat is None else PlannedMotion(self.scenario, self.meshcat, clock)
        self._heard = (0, time.monotonic())
        self._stopped = False

    def run(self, record: bool) -> None:
        """Move the arm. Raises RunStoppedError if it was stopped for good."""
        kinematics = PandaKinematics(self._config.panda, self._config.camera.fixed_pose)
        q_observe = self._observation_posture(kinematics)
        with ExitStack() as stack:
            commands = stack.enter_context(
                CommandProcess(self._config.lcm, self._config.command, self._config.panda)
            )
            self._go_to(q_observe, kinematics, commands)
            way_back = WayBack(kinematics, q_observe, planned_limits(self.scenario), commands)
            wired = make_diagram(
                self.scenario,
                self.seed,
                self.meshcat,
                drivers=Drivers(self.reception, commands, way_back.take),
                permit=self._permit,
            )
            listeners: list[Listener] = []
            if record:
                recording = recording_of(
                    wired, self.scenario, self.seed, self.truth, self.folder.path / RECORDING
                )
                listeners.append(stack.enter_context(recording))
            off_path = self._config.command.safety.off_path
            watch = ArmWatch(wired, commands, self.reception, self.operator, self.progress, way_back, off_path)
            try:
                self._interact(wired, lambda context: watch(context) or self._is_silent(PATIENCE), listeners)
            finally:
                self.folder.note(
                    pauses=watch.pauses,
                    messages_left_out={"seen": self.reception.left_out, "commanding": commands.left_out},
                )
            if self._stopped:
                raise RunStoppedError(self.progress.end)
        self._note_gaps(commands)

    def _note_gaps(self, commands: CommandProcess) -> None:
        """How evenly commands were sent; known once they have ended."""
        if len(commands.send_times) > 1:
            gaps = np.diff(commands.send_times)
            self.folder.note(
                commands=len(commands.send_times),
                command_gap_ms={
                    "median": round(1e3 * float(np.median(gaps)), 3),
                    "p99.9": round(1e3 * float(np.percentile(gaps, 99.9)), 3),
                    "longest": round(1e3 * float(gaps.max()), 3),
                },
            )

    def run_dry(self, unasked: bool, replayed: bool) -> None:
        """Show what would be done from where the arm is, and move nothing."""
        assert self.reception.status is not None
        # Where the arm stands it looks from.
        self._config.start_position = [float(q) for q in self.reception.status.position]
        operator = None if unasked else self.operator
        showing = DryRun(self.scenario, self._planned, operator, self.console, self.progress)
        wired = make_diagram(
            self.scenario,
            self.seed,
            self.meshcat,
            drivers=Drivers(self.reception),
            permit=(lambda push: Permission.WAIT) if replayed else showing.permit,
        )
        self._interact(wired, lambda _: self._is_silent(SILENCE if replayed else PATIENCE), [])
        if self._stopped and not replayed:
            raise RunStoppedError(self.progress.end)

    def _interact(
        self, wired: WiredDiagram, look: Callable[[Context], bool], listeners: list[Listener]
    ) -> None:
        with ExitStack() as stack:
            status = stack.enter_context(self.console.status("looking"))
            narrator, clock = Narrator(self.console, status), StageClock()
            robot = PandaKinematics(self._config.panda, self._config.camera.fixed_pose)
            log = stack.enter_context(self.timeline.opened(self.folder.path.name, robot))
            listeners = [
                lambda *_: narrator.follow(self.progress),
                *listeners,
                export_listener(wired, self.exports),
                timeline_listener(wired, log, clock),
            ]
            wall = WallClock(self.reception.clock(), lambda context: self._look(look, context))
            if self.meshcat is not None:
                kept = stack.enter_context(replay(self.meshcat, self.folder.path / REPLAY, wall.start))
                listeners.append(lambda frame, _: kept.mark(self.progress.interaction_step, frame.time))
            for step in interactions(
                wired,
                clock,
                self.progress,
                self.scenario.longest,
                tuple(listeners),
                truth=self.truth,
                wall=wall,
            ):
                self.folder.write_step(step)
                self.steps.append(step)
                narrator.tell_step(step)
                if log is not None:
                    log.take_scores(step.time, percent(step.scores))
        narrator.tell_end(self.progress)

    def _observation_posture(self, kinematics: PandaKinematics) -> np.ndarray:
        config = self._config
        try:
            return observation_posture(
                kinematics, config.centre_W, config.observe_height, config.start_position, config.observe_pitch
            )
        except ValueError as error:
            raise ScenarioError(str(error)) from None

    def _go_to(self, q: np.ndarray, kinematics: PandaKinematics, commands: CommandProcess) -> None:
        assert self.reception.status is not None
        here = self.reception.status.position
        if np.abs(here - q).max() < ARRIVED / 2:
            return

        def plan(q_from: np.ndarray) -> PiecewisePolynomial:
            return straight_motion(kinematics, q_from, q, planned_limits(self.scenario))

        turn = np.degrees(np.abs(q - here).max())
        self.operator.confirm(
            f"the arm goes to where it looks from, {turn:.0f} degrees in {plan(here).end_time():.1f} s"
        )
        travel(plan, commands, self.reception, self.operator)

    def _permit(self, push: Push) -> Permission:
        said = self.operator.permit(push)
        if self._planned is not None:
            self._planned.show(push) if said is Permission.WAIT else self._planned.hide()
        if said is Permission.END:
            self.progress.end = self.operator.why_quit
        return said

    def _look(self, look: Callable[[Context], bool], context: Context) -> bool:
        """Whether something from outside has brought the run to its end."""
        for line in self.reception.untold():
            self.operator.tell(line)
        was_over = bool(self.progress.end)  # by the operator's word, say
        self._stopped = look(context) and not was_over
        return self._stopped or was_over

    def _is_silent(self, patience: float) -> bool:
        """Whether the camera has said nothing for `patience`, s."""
        pictures, since = self._heard
        if self.reception.pictures != pictures:
            self._heard = (self.reception.pictures, time.monotonic())
        elif time.monotonic() - since > patience:
            self.progress.end = f"no picture has come for {patience:g} s"
            return True
        return False
