"""Figures as tables on the terminal."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import astuple

from rich import box
from rich.table import Table

from riseg_drake.evaluation.scores import Scores


def score_table(
    rows: Iterable[tuple[str, Scores]], first: str, in_motion: Mapping[str, float] | None = None
) -> Table:
    """One row a name, in percent like the paper's table; an object with Overlap F above 75 % is found.

    With `in_motion` a last column has the Overlap F of what moved, while it moved, by the rows' names.
    """
    table = Table(box=box.SIMPLE, padding=(0, 1, 0, 0))
    table.add_column(first, justify="left", no_wrap=True)
    for column in ("Overlap\nP", "\nR", "\nF", "Boundary\nP", "\nR", "\nF", "found\n%", "\nobjects"):
        table.add_column(column, justify="right", no_wrap=True)
    if in_motion:
        table.add_column("in motion\nF", justify="right", no_wrap=True)
    for name, scores in rows:
        moved: tuple[str, ...] = ()
        if in_motion:
            moved = (f"{100 * in_motion[name]:.1f}" if name in in_motion else "",)
        found = f"{100 * scores.found_share:.1f}"
        table.add_row(name, *shares_in_percent(scores), found, objects_found(scores), *moved)
    return table


def shares_in_percent(scores: Scores) -> tuple[str, ...]:
    """Precision, recall and F, of Overlap and then of Boundary."""
    return tuple(f"{100 * share:.1f}" for share in astuple(scores)[:6])


def objects_found(scores: Scores) -> str:
    """How many of how many objects were found."""
    return f"{_count(scores.objects_found)} of {_count(scores.objects_true)}"


def _count(number: float) -> str:
    return f"{number:g}" if number % 1 == 0 else f"{number:.1f}"


def stage_table(stages: Mapping[str, Mapping[str, float]], title: str) -> Table:
    """One row a stage: calls, median and 95th percentile in milliseconds, and memory where measured."""
    with_memory = any("peak_mb" in figures for figures in stages.values())
    table = Table(box=box.SIMPLE, title=title, title_justify="left")
    table.add_column("stage", justify="left")
    columns: Sequence[str] = ("calls", "median ms", "p95 ms") + (("peak MB",) if with_memory else ())
    for column in columns:
        table.add_column(column, justify="right")
    for stage, figures in stages.items():
        cells = [f"{figures['calls']:.0f}", f"{figures['median_ms']:.1f}", f"{figures['p95_ms']:.1f}"]
        if with_memory:
            cells.append(f"{figures['peak_mb']:.1f}" if "peak_mb" in figures else "")
        table.add_row(stage, *cells)
    return table
