"""`riseg segment`: Alg. 2 over a recording, without a robot."""

import json
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, astuple, dataclass, field
from importlib.resources import files
from pathlib import Path
from time import perf_counter

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from riseg_drake.app.exports import Exports, exporting
from riseg_drake.app.output import RECORDING, confidence_figures, stage_figures
from riseg_drake.app.report_page import REPORT
from riseg_drake.app.run.command import peak_memory_mb
from riseg_drake.app.scenario import Scenario, load_scenario
from riseg_drake.app.segment.doubts import frames_with, recording_doubts
from riseg_drake.app.segment.folder import VIDEO, SegmentFolder
from riseg_drake.app.segment.notes import ToldNotes
from riseg_drake.app.segment.recorded_view import RecordedView, recorded_view
from riseg_drake.app.segment.replay import Replay
from riseg_drake.app.segment.report import Album
from riseg_drake.app.tables import score_table, stage_table
from riseg_drake.app.timelines import Timeline, moment_of
from riseg_drake.app.work_state import end_noted
from riseg_drake.evaluation.scores import FIGURES, Scores, score
from riseg_drake.host.files import MOST_SETTINGS, FileError, check_inside, read_text
from riseg_drake.recording import layout
from riseg_drake.recording.layout import LeftOut, RecordedFrame, RecordingError
from riseg_drake.recording.source import RecordedSource, SourceOptions
from riseg_drake.recording.source_kinds import opened_source
from riseg_drake.segmentation.table_plane import NoPlaneError
from riseg_drake.segmentation.untouched import untouched_clusters
from riseg_drake.systems.stage_clock import StageClock
from riseg_drake.timeline.log import TimelineLog

MOST_TIMES = 10_000
"""Calls of each stage whose time is kept: a recording may be longer than memory."""


SAMPLE = Path(str(files("riseg_drake.recording") / "sample"))
"""A recorded run of three toys that ships with the package; tests/recording/make_sample.py made it."""


@dataclass(frozen=True)
class SegmentRequest:
    """What a person asks of `riseg segment`."""

    recording: Path = SAMPLE
    output: Path | None = None
    scenario: Path | None = None
    """Parameters; those of the recorded run, or the built-in ones, if None."""
    seed: int | None = None
    """Of the samples; that of the recorded run, or 0, if None."""
    robot: Path | None = None
    camera_frame: str = "camera"
    stamp_limit: float = 0.02
    """How far apart in time what belongs together may be, s."""
    follow: bool = False
    """Whether links may lead out of the recording."""
    rate: float | None = None
    """Images a second of a folder whose images have numbers for names, Hz."""
    topics: Mapping[str, str] = field(default_factory=dict)
    """Topics of a bag, or folders of images, by what they hold."""
    world_frame: str | None = None
    """The frame of a bag's transforms in which camera poses are given."""
    overwrite: bool = False
    """Whether an earlier segmentation is removed."""
    overlay: bool = False
    """Whether every picture of the video is a file of its own, too."""
    export: tuple[str, ...] = ()
    """Formats of other tools."""
    export_frames: tuple[int, ...] = ()
    """Numbers of the frames for Contact-GraspNet, from 0; the last one if there are none."""
    rerun: Path | None = None
    """File of a time line for Rerun's viewer; an empty path: in the output folder."""
    strict: bool = False
    """Whether what can hardly be is an error, and not a warning."""


@dataclass
class SegmentResult:
    """What came of a recording, without its masks."""

    frames: int = 0
    """Masks written."""
    object_ids: tuple[int, ...] = ()
    """Of all objects that are known after the last frame."""
    confidence: Mapping[int, float] = field(default_factory=dict)
    """Of these, as far as they were decided on."""
    scored: int = 0
    """Frames with true labels."""
    last: Scores | None = None
    """The scores of the last of these."""
    sums: NDArray[np.float64] = field(default_factory=lambda: np.zeros(len(FIGURES)))
    """[10], of the ten figures over them."""
    left_out: list[LeftOut] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    start: float = 0.0
    """Time stamp of the first frame, s."""
    album: Album = field(default_factory=Album)
    """What the report shows."""

    @property
    def mean(self) -> Scores:
        """The mean scores of the frames with true labels."""
        return Scores(*(self.sums / self.scored).tolist())


def segment_command(request: SegmentRequest, console: Console) -> None:
    """Segment a recording into a folder, tell how it goes, and show the scores if there are labels.

    Raises RecordingError for what is none, and, if asked to be strict, for one that can hardly be right.
    """
    options = SourceOptions(
        request.stamp_limit,
        request.follow,
        request.rate,
        request.topics,
        request.world_frame,
        robot=request.robot is not None,
    )
    reader = opened_source(request.recording, options)
    scenario, seed = _parameters(request)
    view = recorded_view(reader, scenario, request.robot, request.camera_frame)
    doubts = recording_doubts(reader, view)
    reader.scale_is_asked = True
    if request.strict and (odd := [*reader.warnings, *doubts]):
        raise RecordingError("; ".join(odd))
    view.warnings.extend(doubts)
    having = frames_with(reader)
    about = {
        "recording": str(request.recording),
        "width": reader.intrinsics.width,
        "height": reader.intrinsics.height,
        "rate_hz": round(reader.rate, 3),
        "camera_poses": view.camera_poses,
        "robot_pixels": view.robot_pixels,
        "frames_with": having,
        "seed": seed,
    }
    output = request.output or Path("out") / f"segment_{_recording_name(request.recording)}"
    exports, timeline = Exports(output, request.export, request.export_frames), Timeline(request.rerun, output)
    clock, result = StageClock(), SegmentResult()
    with (
        SegmentFolder(
            output, reader.rate, about, overlay=request.overlay, overwrite=request.overwrite
        ) as folder,
        _state_of(folder, result, clock),
        exporting(exports, folder.note),
        timeline.opened(_recording_name(request.recording), view.kinematics) as log,
    ):
        what = "the sample recording" if request.recording == SAMPLE else request.recording
        console.print(f"{len(reader)} frames of {what}, results in {output}", highlight=False)
        console.print(f"camera poses: {view.camera_poses}; robot pixels: {view.robot_pixels}", highlight=False)
        console.print(
            "frames with " + ", ".join(f"{name}: {number}" for name, number in having.items()), highlight=False
        )
        _segment(reader, view, Replay(scenario, view.view, seed), folder, exports, log, clock, result, console)
    _report(result, clock, output, console)
    exports.tell(console)
    timeline.tell(console)


def _segment(
    reader: RecordedSource,
    view: RecordedView,
    replay: Replay,
    folder: SegmentFolder,
    exports: Exports,
    log: TimelineLog | None,
    clock: StageClock,
    result: SegmentResult,
    console: Console,
) -> None:
    """Put every frame through Alg. 2 and write what comes of it."""
    clock.watch(replay.stages)
    told = ToldNotes(console)
    told.tell(view.warnings)
    with Progress(
        TextColumn("frames"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[rate]}"),
        TimeRemainingColumn(),
        console=console,
    ) as progress:
        bar, start = progress.add_task("frames", total=len(reader), rate=""), perf_counter()
        for frame in reader:
            if _take(frame, reader, replay, folder, result):
                exports.take(replay.segmentation, frame.name)
                if log is not None:
                    scores = None if frame.labels is None else result.last
                    log.take(moment_of(replay.read, frame.position, clock.seconds, scores))
            result.left_out, result.warnings = reader.left_out, [*view.warnings, *reader.warnings]
            told.tell([*result.warnings, *map(str, result.left_out)])
            for times in clock.seconds.values():
                del times[:-MOST_TIMES]
            taken = result.frames + len(result.left_out)
            rate = f"{taken / (perf_counter() - start):.1f} frames/s"
            progress.update(bar, completed=min(taken, len(reader)), rate=rate)
        told.tell([*result.warnings, *map(str, result.left_out)])
        progress.update(bar, completed=len(reader))
    if result.frames == 0:
        raise RecordingError(f"{reader.path}: no frame shows a table top; the first: {result.left_out[-1].why}")
    folder.write_untouched(untouched_clusters(replay.segmentation))
    folder.finish()


def _take(
    frame: RecordedFrame, reader: RecordedSource, replay: Replay, folder: SegmentFolder, result: SegmentResult
) -> bool:
    """Whether the frame could be taken in."""
    try:
        mask = replay.mask_after(frame)
    except NoPlaneError as error:
        reader.leave_out(frame, str(error))
        return False
    scores = None
    if frame.labels is not None:
        scores = result.last = score(mask, frame.labels)
        result.sums += astuple(scores)
        result.scored += 1
    segmentation = replay.segmentation
    if result.frames == 0:
        result.start = frame.time
    result.frames += 1
    share = (result.frames + len(result.left_out)) / len(reader)
    time = frame.time - result.start
    folder.write(frame.name, frame.color, mask, segmentation.confidence, scores, time, share)
    result.album.look(frame, segmentation)
    result.object_ids, result.confidence = segmentation.object_ids, segmentation.confidence
    return True


def _parameters(request: SegmentRequest) -> tuple[Scenario, int]:
    """The scenario and the seed: as asked for, as the recorded run had them, or as built in."""
    scenario = load_scenario(request.scenario or _own(request, layout.SCENARIO_FILE))
    if request.seed is not None:
        return scenario, request.seed
    run = request.recording / layout.RUN_FILE
    try:
        seed = (
            0 if _own(request, layout.RUN_FILE) is None else json.loads(read_text(run, MOST_SETTINGS))["seed"]
        )
    except (ValueError, KeyError, TypeError, RecursionError):
        seed = None
    if isinstance(seed, bool) or not isinstance(seed, int) or seed < 0:
        raise RecordingError(f'{run} must hold the seed of the run, as {{"seed": 0}}; or give --seed')
    return scenario, seed


def _own(request: SegmentRequest, name: str) -> Path | None:
    """A file that the recording brings along, if it does. Raises RecordingError where it lies elsewhere."""
    path = request.recording / name
    if not os.path.lexists(path):
        return None
    try:
        check_inside(path, None if request.follow else request.recording)
    except FileError as error:
        raise layout.refusal(error) from None
    return path


def _recording_name(folder: Path) -> str:
    """What a recording is called; that of a run by its run."""
    folder = folder.resolve()
    return folder.parent.name if folder.name == RECORDING else folder.stem if folder.is_file() else folder.name


@contextmanager
def _state_of(folder: SegmentFolder, result: SegmentResult, clock: StageClock) -> Iterator[None]:
    """Enter in the summary what came of it, also where it was stopped or failed."""
    start = perf_counter()

    def finish(state: str, end: str) -> None:
        scores = {}
        if result.last is not None:
            scores = {"scores": result.mean.as_dict(), "scores_last": result.last.as_dict()}
        folder.note(
            state=state,
            end=end,
            frames=result.frames,
            objects=len(result.object_ids),
            object_ids=list(result.object_ids),
            confidence=confidence_figures(result.confidence),
            **scores,
            left_out=[asdict(line) for line in result.left_out],
            warnings=result.warnings,
            stages=stage_figures(clock.seconds),
            seconds=round(perf_counter() - start, 2),
            peak_memory_mb=peak_memory_mb(),
        )
        title = f"{_recording_name(Path(folder.summary['recording']))}, segmented"
        stages = stage_figures(clock.seconds)
        folder.write_report(result.album.page(title, folder.summary, _score_rows(result), stages))

    with end_noted(finish, lambda: f"{_masks(result.frames)} in {folder.path}"):
        yield
    finish("done", "all frames were read")


def _report(result: SegmentResult, clock: StageClock, output: Path, console: Console) -> None:
    objects = len(result.object_ids)
    console.print(
        f"{_masks(result.frames)}, {objects} object{'' if objects == 1 else 's'} found, "
        f"{len(result.left_out)} lines left out",
        highlight=False,
    )
    if result.last is not None:
        console.print("\nscores in percent")
        console.print(score_table(_score_rows(result), first="\nframes"))
    console.print(stage_table(stage_figures(clock.seconds), title="time of each stage"))
    console.print(f"to look at: {output / REPORT}, {output / VIDEO}", highlight=False, soft_wrap=True)


def _score_rows(result: SegmentResult) -> list[tuple[str, Scores]]:
    if result.last is None:
        return []
    return [(f"mean of {result.scored}", result.mean), ("last", result.last)]


def _masks(number: int) -> str:
    return "1 mask" if number == 1 else f"{number} masks"
