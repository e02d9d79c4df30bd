"""What each part of the algorithm is worth: in words for reports, and as data."""

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from math import isnan
from typing import Any

import numpy as np

from riseg_drake.evaluation.figure_table import SCORE_HEAD, FigureTable, markdown_table, percent, score_cells
from riseg_drake.evaluation.in_motion import InMotion, mean_over_scenes, pooled
from riseg_drake.evaluation.scene_result import OURS, SceneResult, scores_by_switch
from riseg_drake.evaluation.scores import Scores
from riseg_drake.evaluation.step_means import carried, step_means

TITLE = "What each part is worth"


@dataclass(frozen=True)
class Difference:
    """Of an Overlap F against ours, in [-1, 1]."""

    mean: float
    """Over the scenes where it is known; NaN where it is in none."""
    standard_error: float
    """Of the mean; NaN of less than two scenes."""

    @classmethod
    def of(cls, scenes: Iterable[float]) -> "Difference":
        """That of some scenes, NaN where it is unknown."""
        known = np.array([each for each in scenes if not isnan(each)])
        if not len(known):
            return cls(float("nan"), float("nan"))
        error = known.std(ddof=1) / np.sqrt(len(known)) if len(known) > 1 else float("nan")
        return cls(float(known.mean()), float(error))

    def __str__(self) -> str:
        """In percent, with its standard error."""
        if isnan(self.mean):
            return "–"
        error = "" if isnan(self.standard_error) else f" ± {100 * self.standard_error:.1f}"
        return f"{100 * self.mean:+.1f}{error}"


@dataclass(frozen=True)
class Version:
    """One version after the last interaction, over all scenes."""

    scores: Scores
    """Means over the scenes."""
    in_motion_f: float
    """Overlap F of what moved, while it moved; NaN where nothing moved in sight."""
    against_ours: Difference | None = None
    """In Overlap F; None of ours."""
    in_motion_against_ours: Difference | None = None

    @property
    def cells(self) -> list[str]:
        """Its row of the table, in percent, without its name."""
        rest, moving = (
            "" if each is None else str(each) for each in (self.against_ours, self.in_motion_against_ours)
        )
        return [*score_cells(self.scores), rest, percent(self.in_motion_f), moving]


def ablation_versions(scenes: Sequence[SceneResult], last_step: int) -> dict[str, Version]:
    """Ours, then every switch, by name; empty without an ablation.

    Args:
        scenes: of one or of many kinds.
        last_step: the interactions that a scene may have; one that ended earlier keeps its last state.
    """
    switches = scores_by_switch(scenes)
    if not switches:
        return {}
    ours, moved = [scene.scores for scene in scenes], [scene.in_motion for scene in scenes]
    versions = {OURS: Version(step_means(ours, last_step)[-1], _in_motion_mean(moved))}
    for switch, scores in switches.items():
        at_rest = [
            carried(other, last_step)[-1].overlap_f - carried(own, last_step)[-1].overlap_f
            for other, own in zip(scores, ours, strict=True)
        ]
        other_moved = [scene.ablation_in_motion.get(switch, ()) for scene in scenes]
        moving = [moving_f(other) - moving_f(own) for other, own in zip(other_moved, moved, strict=True)]
        versions[switch] = Version(
            step_means(scores, last_step)[-1],
            _in_motion_mean(other_moved),
            Difference.of(at_rest),
            Difference.of(moving),
        )
    return versions


def ablation_table(scenes: Sequence[SceneResult], last_step: int) -> FigureTable | None:
    """A row a version, in percent; None without an ablation."""
    rows = [[name, *version.cells] for name, version in ablation_versions(scenes, last_step).items()]
    head = ("version", *SCORE_HEAD, "F against ours", "F in motion", "against ours")
    return FigureTable(head, rows) if rows else None


def ablation_figures(scenes: Sequence[SceneResult], last_step: int) -> dict[str, Any]:
    """The table as data, by version; shares in [0, 1]."""
    return {
        name: {
            "scores": version.scores.as_dict(),
            "in_motion_f": version.in_motion_f,
            "against_ours": _data(version.against_ours),
            "in_motion_against_ours": _data(version.in_motion_against_ours),
        }
        for name, version in ablation_versions(scenes, last_step).items()
    }


def ablation_failures(scenes: Sequence[SceneResult]) -> list[str]:
    """A sentence for every version that failed on the way."""
    return [
        f"{scene.name}: {switch} failed on the way and keeps what it had: {why}"
        for scene in scenes
        for switch, why in scene.ablation_failures.items()
    ]


def ablation_section(scenes: Sequence[SceneResult], last_step: int) -> str:
    """The table in Markdown, with what it says; empty without an ablation."""
    table = ablation_table(scenes, last_step)
    if table is None:
        return ""
    rows = [[f"**{row[0]}**" if row[0] == OURS else row[0], *row[1:]] for row in table.rows]
    return (
        f"## {TITLE}\n\n"
        + markdown_table(table.head, rows)
        + """
After the last interaction, in percent, means over the same scenes, and Overlap F of what moved while it
moved. The runs were made once, by this project's version, which chose the pushes; each row segments the
recorded frames again with one thing otherwise, as the paper has it or left out (the last rows with all as
the paper has it). A difference in Overlap F is the mean over the scenes, ± its standard error.
"""
        + "".join(f"\n{line}\n" for line in ablation_failures(scenes))
    )


def moving_f(interactions: Sequence[InMotion | None]) -> float:
    """Overlap F in motion of one scene, in [0, 1]; NaN where nothing moved in sight."""
    figures = pooled(interactions)
    return float("nan") if figures is None else figures.overlap_f


def _in_motion_mean(scenes: Sequence[Sequence[InMotion | None]]) -> float:
    """Over the scenes where something moved in sight."""
    _, mean = mean_over_scenes(scenes)
    return float("nan") if mean is None else mean.overlap_f


def _data(difference: Difference | None) -> dict[str, float] | None:
    return None if difference is None else asdict(difference)
