"""`riseg run`: one scene from the first look to the last push."""

import resource
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import Any

from pydrake.geometry import Meshcat, StartMeshcat
from pydrake.systems.framework import Context
from rich.console import Console
from rich.status import Status

from riseg_drake.app.diagram import WiredDiagram, make_diagram
from riseg_drake.app.exports import Exports, exporting
from riseg_drake.app.graphics import require_graphics
from riseg_drake.app.loop_request import LoopRequest
from riseg_drake.app.meshcat_replay import replay, stay
from riseg_drake.app.output import RECORDING, REPLAY, RunFolder, Step
from riseg_drake.app.report_page import REPORT
from riseg_drake.app.run.interactions import Listener, Progress, interactions, simulated_truth
from riseg_drake.app.run.recording import recording_of
from riseg_drake.app.run.report import pooled_stages, run_report
from riseg_drake.app.scenario import Scenario, load_scenario, scenario_name
from riseg_drake.app.tables import score_table, stage_table
from riseg_drake.app.timelines import Timeline, moment_of, percent
from riseg_drake.app.work_state import end_noted
from riseg_drake.evaluation.in_motion import pooled
from riseg_drake.evaluation.scores import score
from riseg_drake.geometry.rgbd import Frame
from riseg_drake.robot.kinematics import PandaKinematics
from riseg_drake.systems.mask_refiner import NO_REFINED_MASK, RefinedMask
from riseg_drake.systems.stage_clock import StageClock
from riseg_drake.timeline.log import TimelineLog


@dataclass(frozen=True)
class RunRequest(LoopRequest):
    """Which scene is to be run, and what is to be seen of it."""

    overwrite: bool = False
    """Whether an earlier run there is removed first."""


def run_command(request: RunRequest, console: Console) -> None:
    """Run one scene, tell how it goes, and show the scores of every interaction."""
    scenario, seed = load_scenario(request.scenario), request.seed
    _ = scenario.simulated  # says so where it is not
    require_graphics()
    name = scenario_name(request.scenario)
    path, about = request.output or Path("out") / f"{name}_seed_{seed}", {"scenario": name, "seed": seed}
    exports, timeline = Exports(path, request.export, request.export_frames), Timeline(request.rerun, path)
    with RunFolder(path, about, overwrite=request.overwrite) as folder:
        console.print(f"{name}, seed {seed}, results in {folder.path}", soft_wrap=True)
        browser = StartMeshcat() if request.meshcat else None
        with console.status("placing the objects") as status:
            narrator = Narrator(console, status)
            steps = run(scenario, seed, folder, request.record, browser, narrator, exports, timeline)
    report(steps, console)
    exports.tell(console)
    timeline.tell(console)
    console.print(f"to look at: {path / REPORT}", highlight=False, soft_wrap=True)
    if browser is not None:
        stay(browser, folder.path / REPLAY, console, request.wait)


def run(
    scenario: Scenario,
    seed: int,
    folder: RunFolder,
    record: bool = False,
    meshcat: Meshcat | None = None,
    narrator: "Narrator | None" = None,
    exports: Exports | None = None,
    timeline: Timeline | None = None,
) -> list[Step]:
    """Run one scene into a folder; returns its steps. However it stops, what it leaves is whole."""
    narrator = narrator or Narrator()
    progress, clock = Progress(), StageClock()
    steps: list[Step] = []
    log: TimelineLog | None = None
    with ExitStack() as stack:
        stack.enter_context(state_of(folder, progress, steps))
        wired = make_diagram(scenario, seed, meshcat)
        folder.note(objects={str(object_id): name for object_id, name in wired.object_names.items()})
        refined = RefinedSteps(wired, folder, steps)
        listeners: list[Listener] = [lambda *_: narrator.follow(progress), refined.look]
        if record:
            recording = recording_of(wired, scenario, seed, simulated_truth(wired), folder.path / RECORDING)
            listeners.append(stack.enter_context(recording))
        if exports is not None:
            listeners.append(export_listener(wired, stack.enter_context(exporting(exports, folder.note))))
        if timeline is not None:
            log = stack.enter_context(
                timeline.opened(
                    folder.path.name,
                    PandaKinematics(scenario.station.panda, scenario.station.camera.fixed_pose),
                )
            )
            listeners.append(timeline_listener(wired, log, clock))
        if meshcat is not None:
            kept = stack.enter_context(replay(meshcat, folder.path / REPLAY))
            listeners.append(lambda frame, _: kept.mark(progress.interaction_step, frame.time))
        for step in interactions(wired, clock, progress, scenario.longest, tuple(listeners)):
            folder.write_step(step)
            steps.append(step)
            narrator.tell_step(step)
            if log is not None:
                log.take_scores(step.time, percent(step.scores))
        if progress.end:
            refined.finish()
    narrator.tell_end(progress)
    return steps


def export_listener(wired: WiredDiagram, exports: Exports) -> Listener:
    """What exports the mask of every frame."""
    return lambda _, context: exports.take(wired.segmentation(context))


def timeline_listener(wired: WiredDiagram, log: TimelineLog | None, clock: StageClock) -> Listener:
    """What logs every frame with the push that is under way; without a log it does nothing."""

    def take(_: Frame, context: Context) -> None:
        if log is not None:
            moment = moment_of(lambda port: wired.read(port, context), wired.position(context), clock.seconds)
            log.take(replace(moment, push=wired.read("active_push", context)))

    return take


def ending_figures(progress: Progress) -> dict[str, Any]:
    """How a run ended and what was left, as the summary has it; `ended` is null where somebody ended it."""
    decision = progress.decision
    figures: dict[str, Any] = {
        "ended": decision.ending.value if decision.ending else None,
        "unsettled_area_m2": round(progress.unsettled_area, 6),
    }
    if decision.failed:
        figures["candidates"] = decision.candidates
        figures["candidates_failed"] = {what.name.lower(): number for what, number in decision.failed.items()}
    return figures


def in_motion_figures(steps: Sequence[Step]) -> dict[str, Any]:
    """How well moved objects were segmented while they moved, over all steps; empty where nobody knows it."""
    figures = pooled(step.in_motion for step in steps)
    return {"in_motion": asdict(figures)} if figures else {}


def peak_memory_mb() -> int:
    """The most memory this process has held so far, MB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024  # Linux counts in kB


class Narrator:
    """Tells a person how it goes: a line renewed at every frame, and one that stays for every step."""

    def __init__(self, console: Console | None = None, status: Status | None = None):
        self._console = console or Console(quiet=True)
        self._status = status
        self._start = perf_counter()

    def follow(self, progress: Progress) -> None:
        """Renew the line at the bottom of the terminal."""
        if self._status is not None:
            self._status.update(
                f"interaction {progress.interaction_step}, {progress.phase.value}: "
                f"{_objects(progress.objects)} found, {self._elapsed()}"
            )

    def tell_step(self, step: Step) -> None:
        """Say what the mask shows after an interaction."""
        i = step.interaction_step
        when = f"after interaction {i}" if i else "before any push"
        f = f", Overlap F {100 * step.scores.overlap_f:.1f} %" if step.scores is not None else ""
        if step.in_motion is not None:
            f += f" ({100 * step.in_motion.overlap_f:.1f} % of what moved, while it moved)"
        line = f"{when}: {_objects(step.objects)} found{f}, {self._elapsed()}"
        self._console.print(line, soft_wrap=True)

    def tell_end(self, progress: Progress) -> None:
        """Say why it is over."""
        self._console.print(f"ended after {self._elapsed()}: {progress.end}", soft_wrap=True)

    def _elapsed(self) -> str:
        return f"{perf_counter() - self._start:.0f} s"


def _objects(number: int) -> str:
    return "1 object" if number == 1 else f"{number} objects"


@contextmanager
def state_of(folder: RunFolder, progress: Progress, steps: list[Step]) -> Iterator[None]:
    """Enter in the summary how the run ended, also where it was stopped or failed.

    A KeyboardInterrupt is raised again, with what it left; so is any other exception.
    """
    start = perf_counter()

    def finish(state: str, end: str) -> None:
        folder.note(
            state=state,
            end=end,
            **ending_figures(progress),
            **in_motion_figures(steps),
            seconds=round(perf_counter() - start, 2),
            simulated_s=round(progress.time, 3),
            frames=progress.frames,
            peak_memory_mb=peak_memory_mb(),
        )
        folder.write_report(run_report(folder.summary, steps))

    def left() -> str:
        return f"{len(steps)} finished step{'' if len(steps) == 1 else 's'}; to look at: {folder.path / REPORT}"

    with end_noted(finish, left):
        yield
    finish("done", progress.end)


class RefinedSteps:
    """Adds sharper outlines to the steps that they belong to, whenever they come."""

    def __init__(self, wired: WiredDiagram, folder: RunFolder, steps: list[Step]):
        self._wired, self._folder, self._steps = wired, folder, steps
        self._last = NO_REFINED_MASK
        self._context: Context | None = None

    def look(self, _: Frame, context: Context) -> None:
        """A listener: see whether the worker is done with something."""
        self._context = context
        refined = self._wired.refined(context)
        if refined is not self._last:
            self._last = refined
            self._add([refined])

    def finish(self) -> None:
        """Wait for the rest."""
        if self._context is not None:
            self._add([m for m in self._wired.finish_refinement(self._context) if m is not self._last])

    def _add(self, refined: Iterable[RefinedMask]) -> None:
        for each in refined:
            for k, step in enumerate(self._steps):
                if step.time == each.time:
                    truth = step.ground_truth
                    scores = None if truth is None else score(each.mask, truth)
                    self._steps[k] = replace(step, refined_mask=each.mask, refined_scores=scores)
                    self._folder.write_refined(self._steps[k])


def report(steps: list[Step], console: Console) -> None:
    """Print the scores of every step, where there are any, and the times of the stages."""
    rows = [(str(step.interaction_step), step.scores) for step in steps if step.scores is not None]
    rows += [
        (f"{step.interaction_step} with SAM", step.refined_scores)
        for step in steps
        if step.refined_scores is not None
    ]
    if rows:
        console.print("\nscores in percent, after each interaction")
        moved = {str(s.interaction_step): s.in_motion.overlap_f for s in steps if s.in_motion is not None}
        console.print(score_table(rows, first="\nstep", in_motion=moved))
    console.print(stage_table(pooled_stages(steps), title="time of each stage"))
