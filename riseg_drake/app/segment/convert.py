"""`riseg convert`: any recording as a folder in the project's own layout."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from riseg_drake.app.work_state import end_noted
from riseg_drake.host.terminal import one_line
from riseg_drake.recording.layout import RecordingError
from riseg_drake.recording.source import STAMP_LIMIT, SourceOptions
from riseg_drake.recording.source_kinds import opened_source
from riseg_drake.recording.writer import RecordingWriter


@dataclass(frozen=True)
class ConvertRequest:
    """What a person asks of `riseg convert`."""

    recording: Path
    output: Path
    stamp_limit: float = STAMP_LIMIT
    """How far apart in time what belongs together may be, s."""
    follow: bool = False
    rate: float | None = None
    """Hz, of images with numbers for names."""
    topics: Mapping[str, str] = field(default_factory=dict)
    world_frame: str | None = None


def convert_command(request: ConvertRequest, console: Console) -> None:
    """Write the frames of a recording into a new folder; what was written stays where it is stopped.

    Raises RecordingError.
    """
    options = SourceOptions(
        request.stamp_limit, request.follow, request.rate, request.topics, request.world_frame
    )
    source = opened_source(request.recording, options)
    if request.output.exists() and (not request.output.is_dir() or any(request.output.iterdir())):
        raise RecordingError(f"{request.output} is not empty; give a new folder")
    names = None if source.joints is None else source.joints.names
    with (
        RecordingWriter(request.output, source.intrinsics, source.depth_scale, names) as writer,
        end_noted(lambda *_: None, lambda: f"{writer.frames} frames in {request.output}"),
        Progress(
            TextColumn("frames"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn(), console=console
        ) as progress,
    ):
        bar = progress.add_task("frames", total=len(source))
        for frame in source:
            writer.append(frame)
            progress.advance(bar)
        progress.update(bar, completed=len(source))
    for note in (*source.warnings, *map(str, source.left_out)):
        console.print(one_line(note), style="yellow", markup=False, highlight=False, soft_wrap=True)
    console.print(
        f"{writer.frames} frames in {request.output}; camera poses: {source.camera_poses or 'fixed camera'}; "
        f"joint angles: {'none' if source.joints is None else source.joints.path}",
        highlight=False,
    )
