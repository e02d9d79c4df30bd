"""Figures as words in a table, for reports of any form."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import isnan

from riseg_drake.evaluation.scores import Scores

SCORE_HEAD = ("Overlap P", "R", "F", "Boundary P", "R", "F", "found %")
"""Above `score_cells`."""


@dataclass(frozen=True)
class FigureTable:
    """Figures in words."""

    head: Sequence[str]
    rows: Sequence[Sequence[str]]


def score_cells(scores: Scores) -> list[str]:
    """The seven figures of the paper's table, in percent."""
    return [percent(share) for share in table_figures(scores)]


def table_figures(scores: Scores) -> tuple[float, ...]:
    """Overlap P, R, F, Boundary P, R, F and the share of objects found, in [0, 1]."""
    return (
        scores.overlap_precision,
        scores.overlap_recall,
        scores.overlap_f,
        scores.boundary_precision,
        scores.boundary_recall,
        scores.boundary_f,
        scores.found_share,
    )


def markdown_table(head: Iterable[str], rows: Iterable[Sequence[str]]) -> str:
    """A table in Markdown, its figures to the right."""
    head = list(head)
    lines = [
        head,
        ["---"] + ["---:"] * (len(head) - 1),
        *([cell.replace("|", "/") for cell in row] for row in rows),
    ]
    return "".join(f"| {' | '.join(cells)} |\n" for cells in lines)


def percent(share: float) -> str:
    """A share in percent, or a dash for what is unknown."""
    return number(100 * share, 1)


def number(value: float, digits: int) -> str:
    """A number (percent, m or degrees) with so many digits after its point, or a dash for what is unknown."""
    return "–" if isnan(value) else f"{value:.{digits}f}"
