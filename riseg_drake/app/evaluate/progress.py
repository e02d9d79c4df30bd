"""Tells a person how an evaluation goes: a bar with the time that is left, and a line for every scene."""

from types import TracebackType

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, ProgressColumn, Task, TextColumn
from rich.text import Text

from riseg_drake.evaluation.scene_result import SceneResult


class EvaluationProgress:
    """The bar. Use it in a `with` block; scenes that were finished before count as done at once."""

    def __init__(self, scenes: int, finished: int, console: Console):
        self._console = console
        self._progress = Progress(
            TextColumn("scenes"), BarColumn(), MofNCompleteColumn(), _TimeLeft(), console=console
        )
        self._bar = self._progress.add_task(
            "scenes", total=scenes, completed=finished, finished=finished, at=0.0
        )

    def tell(self, scene: SceneResult, seconds: float) -> None:
        """A scene is over; it took so many seconds."""
        (task,) = self._progress.tasks
        self._progress.update(self._bar, advance=1, at=task.elapsed or 0.0)
        if scene.failure:
            self._console.print(
                f"{scene.name} FAILED with seed {scene.seed} after interaction {scene.interactions}: "
                f"{scene.failure}",
                style="red",
                markup=False,
            )
            return
        last = scene.scores[-1]
        self._console.print(
            f"{scene.name}, seed {scene.seed}, step {scene.interactions}: "
            f"{last.objects_found:g} of {last.objects_true:g} found, "
            f"Overlap F {100 * last.overlap_f:.1f} %, {seconds:.0f} s",
            highlight=False,
        )

    def __enter__(self) -> "EvaluationProgress":
        self._progress.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._progress.stop()


class _TimeLeft(ProgressColumn):
    """How long it will take yet, by the pace of this session's scenes; rich's own looks back 30 s only."""

    def render(self, task: Task) -> Text:
        """The text of the column."""
        return Text(
            time_left(
                task.total or 0, task.completed, task.fields["finished"], task.fields["at"], task.elapsed or 0.0
            )
        )


def time_left(total: float, completed: float, finished_before: float, last_at: float, elapsed: float) -> str:
    """The expected remaining time in words.

    Args:
        total: all scenes.
        completed: those that are over.
        finished_before: those of them that were so at the start.
        last_at: when the last one ended, s since the start.
        elapsed: now, s since the start.
    """
    if completed >= total:
        return f"done in {_words(elapsed)}"
    done = completed - finished_before
    if done == 0:
        return f"{_words(elapsed)} so far, time left is known after the next scene"
    left = last_at / done * (total - completed) - (elapsed - last_at)
    return f"about {_words(max(left, 0.0))} left"


def _words(seconds: float) -> str:
    minutes, seconds = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return (
        f"{hours} h {minutes:02d} min"
        if hours
        else f"{minutes} min {seconds:02d} s"
        if minutes
        else f"{seconds} s"
    )
