"""What Meshcat showed, as one HTML file; and how long its live view stays."""

import json
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import resources
from pathlib import Path

from pydrake.geometry import Meshcat
from rich.console import Console

from riseg_drake.recording.whole_file import write_text

FRAME_RATE = 30.0
"""Of the replay's motions, 1/s."""
_MARKS = "/*marks*/[]"


class Replay:
    """The interactions of a replay, to be found again on its slider."""

    def __init__(self, start: float):
        """`start` is the diagram's time at which the replay begins, s."""
        self._start = start
        self.marks: dict[int, float] = {}
        """When each interaction began, s since the replay's beginning."""

    def mark(self, interaction_step: int, time: float) -> None:
        """To be told again and again which interaction is under way at a time of the diagram, s."""
        if interaction_step:
            self.marks.setdefault(interaction_step, max(0.0, time - self._start))


@contextmanager
def replay(meshcat: Meshcat, file: Path, start: float = 0.0) -> Iterator[Replay]:
    """Keep what Meshcat shows from a diagram's time on, s, and save it as one HTML file however that ends."""
    meshcat.StartRecording(FRAME_RATE, set_visualizations_while_recording=True)
    # Its frames are numbered from there: with wall time there would be more of them than numbers.
    meshcat.get_mutable_recording().set_start_time(start)
    # The live view stays as the run ended instead of beginning anew; the replay's own page plays it.
    meshcat.get_mutable_recording().set_autoplay(False)
    kept = Replay(start)
    try:
        yield kept
    finally:
        meshcat.StopRecording()
        meshcat.PublishRecording()
        write_text(file, with_marks(meshcat.StaticHtml(), kept.marks))


def with_marks(page: str, marks: dict[int, float]) -> str:
    """Meshcat's page with a slider along its lower edge, marked where each interaction begins, s."""
    slider = resources.files(__package__).joinpath("replay_marks.html").read_text(encoding="utf-8")
    rows = json.dumps([[str(step), round(time, 3)] for step, time in sorted(marks.items())])
    before, end, after = page.rpartition("</body>")
    return before + slider.replace(_MARKS, rows) + end + after


def enter() -> None:
    """Wait for Enter, or for the end of what can be read."""
    sys.stdin.readline()


def stay(meshcat: Meshcat, file: Path, console: Console, wait: bool, until: Callable[[], None] = enter) -> None:
    """Name the replay, and keep the live view until somebody has seen enough of it.

    Nobody is waited for without `wait`, nor where the input is no terminal. Ctrl-C is as good as Enter:
    all there is to be written has been.
    """
    wait = wait and sys.stdin is not None and sys.stdin.isatty()
    if wait:
        console.print(f"\nthe view stays at {meshcat.web_url()} until Enter")
    console.print(f"open {file}", soft_wrap=True)
    if wait:
        try:
            until()
        except KeyboardInterrupt:
            console.print()
