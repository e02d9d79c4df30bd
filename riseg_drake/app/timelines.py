"""`--rerun`: what a command sees and finds, on one time line, for Rerun's viewer."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from rich.console import Console

from riseg_drake.app.options import IN_OUTPUT
from riseg_drake.evaluation.scores import Scores
from riseg_drake.robot.silhouette import Kinematics, UnknownShapeError
from riseg_drake.timeline.file import check_timeline, has_display, timeline_stream
from riseg_drake.timeline.log import TimelineLog
from riseg_drake.timeline.moment import Moment
from riseg_drake.timeline.robot_shapes import RobotShapes

FILE = "rerun.rrd"
"""In the output folder, unless another file is named."""
Read = Callable[[str], Any]
"""Gives the present value of an output of Alg. 2's diagram by its name."""


class Timeline:
    """A time line that was asked for, or none. Raises TimelineError before anything is written."""

    def __init__(self, asked: Path | None, output: Path):
        """`asked` is a file, IN_OUTPUT, or None for no time line; `output` is the command's folder."""
        self._file = output / FILE if asked == IN_OUTPUT else asked
        self._live = asked == IN_OUTPUT and has_display()
        if self._file is not None:
            check_timeline(self._file)

    @contextmanager
    def opened(self, name: str, kinematics: Kinematics | None) -> Iterator[TimelineLog | None]:
        """The log, for a `with`; None where none was asked for. Of unknown shapes a robot is not drawn."""
        if self._file is None:
            yield None
            return
        robot = None
        if kinematics is not None:
            with suppress(UnknownShapeError):
                robot = RobotShapes(kinematics)
        with timeline_stream(self._file, name, live=self._live) as stream:
            yield TimelineLog(stream, robot)

    def tell(self, console: Console) -> None:
        """Say how it is looked at."""
        if self._file is not None:
            console.print(f"to look at: rerun {self._file}", highlight=False, soft_wrap=True)


def moment_of(
    read: Read, position: Any, stage_seconds: Mapping[str, Sequence[float]], scores: Scores | None = None
) -> Moment:
    """What Alg. 2's diagram has made of the newest frame, at joint angles theta_t, if these are known."""
    return Moment(
        pair=read("pair"),
        expected_flow=read("expected_flow"),
        optical_flow=read("optical_flow"),
        groups=read("groups"),
        segmentation=read("segmentation"),
        position=position,
        stage_ms={stage: 1e3 * seconds[-1] for stage, seconds in stage_seconds.items() if len(seconds)},
        scores=percent(scores),
    )


def percent(scores: Scores | None) -> dict[str, float]:
    """The two figures that are shown as curves, by name."""
    if scores is None:
        return {}
    return {"Overlap F": 100 * scores.overlap_f, "Boundary F": 100 * scores.boundary_f}
