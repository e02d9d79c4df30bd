"""The report of an evaluation, in Markdown: the paper's table with ours in it, and what else was seen."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from math import isnan

import numpy as np

from riseg_drake.evaluation.disturbance import (
    FELL,
    TOPPLED_DEG,
    DisturbanceFigures,
    disturbance_of_all,
    disturbance_of_steps,
)
from riseg_drake.evaluation.in_motion import MOVED, InMotion, in_motion_of_steps, mean_over_scenes, pooled
from riseg_drake.evaluation.published import PUBLISHED
from riseg_drake.evaluation.scene_result import OURS, SceneResult, scores_by_method, scores_by_switch
from riseg_drake.evaluation.scores import FOUND_ABOVE_F, Scores
from riseg_drake.evaluation.step_means import carried, step_means

FIGURE_FILE = "figure.png"

DISTURBANCE_HEAD = (
    "interactions",
    "pushed object moved, mean cm",
    "others moved, median mm",
    "most tilt, degrees",
    "toppled",
    "fell",
    "left the table",
)
_HEAD = ("Overlap P", "R", "F", "Boundary P", "R", "F", "found %")


def report_text(scenes: Sequence[SceneResult], about: Mapping[str, object], last_step: int) -> str:
    """The whole report.

    Args:
        scenes: all scenes of the evaluation, at least one.
        about: its settings, by name.
        last_step: the interactions that a scene may have.
    """
    sections = [
        "# Evaluation\n",
        "".join(f"- {name}: {value}\n" for name, value in about.items()),
        _failures(scenes),
        "## Scores after each interaction\n",
        _score_section(scenes, last_step),
        f"![share of objects found after each interaction]({FIGURE_FILE})\n",
        "## Masks while things move\n",
        _in_motion_section(scenes, last_step),
        "## What the interactions did to the scene\n",
        _disturbance_section(scenes, last_step),
        "## How the runs ended\n",
        _ending_section(scenes),
        "## The scenes, worst first\n",
        _scene_section(scenes, last_step),
    ]
    sections += [ablation_section(scenes, last_step)]
    return "\n".join(section for section in sections if section)


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


def _score_section(scenes: Sequence[SceneResult], last_step: int) -> str:
    rows = []
    for method, scores in scores_by_method(scenes).items():
        for i, mean in enumerate(step_means(scores, last_step)):
            rows.append([_strong(method, method == OURS), str(i), *score_cells(mean)])
    for method, published in PUBLISHED.items():
        for i, row in enumerate(published):
            rows.append([f"{method} (paper)", str(i), *(f"{figure:.1f}" for figure in row)])
    reached = ", ".join(
        f"{sum(scene.interactions >= i for scene in scenes)} reached {i}" for i in range(1, last_step + 1)
    )
    return (
        markdown_table(("method", "step i", *_HEAD), rows)
        + f"""
In percent. Step i is after i interactions; *found* is the share of objects with Overlap F above
{FOUND_ABOVE_F:.0%}. Each figure is the unweighted mean over the {len(scenes)} scenes, so the mean F is not
the F of the means. Every scene counts in every step: one that ended earlier, because nothing was left to
push or because it failed, keeps its last state in the steps that follow; one that failed before its first
image counts as an empty prediction. Of the {len(scenes)} scenes {reached}. The rows of the paper are its
own, on its own 20 real scenes; the other rows are on the images of this evaluation.
"""
    )


def _in_motion_section(scenes: Sequence[SceneResult], last_step: int) -> str:
    interactions = [scene.in_motion for scene in scenes]
    names = [*map(str, range(1, last_step + 1)), "**all**"]
    figures = [*in_motion_of_steps(interactions, last_step), mean_over_scenes(interactions)]
    rows = []
    for name, (number, mean) in zip(names, figures, strict=True):
        cells = ["0", "–", "–"] if mean is None else []
        if mean is not None:
            cells = [str(mean.frames), percent(mean.overlap_f), percent(mean.at_rest_f)]
        rows.append([name, str(number), *cells])
    return (
        markdown_table(("interaction", "scenes", "frames", "Overlap F in motion", "at rest after it"), rows)
        + f"""
Overlap F of the objects that the interaction has moved by {100 * MOVED:g} cm or more so far, in every
frame from then on until the camera observes again, and the same objects' in the last frame at rest. Means
over frames, then over scenes, in percent.
"""
    )


def ending_counts(scenes: Sequence[SceneResult]) -> dict[str, int]:
    """How many runs ended for each reason, the most frequent first."""
    return dict(Counter(scene.ended or "otherwise" for scene in scenes if not scene.failure).most_common())


def _ending_section(scenes: Sequence[SceneResult]) -> str:
    rows = []
    for ended, number in ending_counts(scenes).items():
        areas = [s.unsettled_area_m2 for s in scenes if not s.failure and (s.ended or "otherwise") == ended]
        known = [1e4 * area for area in areas if not isnan(area)]
        mean, most = (np.mean(known), max(known)) if known else (float("nan"), float("nan"))
        rows.append([ended, str(number), _number(float(mean), 1), _number(float(most), 1)])
    return (
        markdown_table(("reason", "scenes", "left, mean cm^2", "most"), rows)
        + """
*left* is what stands on the table and is yet to be segmented, as the push planner sees it.
"""
    )


def _disturbance_section(scenes: Sequence[SceneResult], last_step: int) -> str:
    disturbances = [scene.disturbances for scene in scenes]
    rows = [
        [str(i), *disturbance_cells(figures)]
        for i, figures in enumerate(disturbance_of_steps(disturbances, last_step), start=1)
    ]
    rows.append(["**all**", *disturbance_cells(disturbance_of_all(disturbances))])
    return (
        markdown_table(("after", *DISTURBANCE_HEAD), rows)
        + f"""
The pushed object is the one that the push was planned to meet. Tilt is against the start of the run, and
rolling is none; more than {TOPPLED_DEG:g} degrees count as toppled. What came down by more than
{100 * FELL:g} cm without toppling fell.
"""
    )


def disturbance_cells(figures: DisturbanceFigures) -> list[str]:
    """A row of a table below `DISTURBANCE_HEAD`."""
    return [
        str(figures.interactions),
        _number(100 * figures.pushed_mean_m, 2),
        _number(1000 * figures.others_median_m, 2),
        _number(figures.tilt_max_deg, 1),
        str(figures.toppled),
        str(figures.fell),
        str(figures.left_table),
    ]


def _scene_section(scenes: Sequence[SceneResult], last_step: int) -> str:
    rows = []
    for scene in sorted(scenes, key=lambda scene: carried(scene.scores, last_step)[-1].overlap_f):
        last = carried(scene.scores, last_step)[-1]
        picture = f"[{scene.name}]({scene.name}/step_{scene.interactions}/overlay.png)"
        found = "–" if isnan(last.objects_true) else f"{last.objects_found:g} of {last.objects_true:g}"
        figures = [percent(last.overlap_f), percent(last.boundary_f), found]
        rows.append(
            [
                picture if scene.scores else scene.name,
                str(scene.seed),
                str(scene.interactions),
                *figures,
                percent(_moving_f(scene.in_motion)),
                scene.failure or scene.end,
            ]
        )
    return markdown_table(
        ("scene", "seed", "interactions", "Overlap F", "Boundary F", "found", "F in motion", "end"), rows
    )


def _failures(scenes: Sequence[SceneResult]) -> str:
    failed = [scene for scene in scenes if scene.failure]
    if not failed:
        return ""
    lines = "".join(f"- {scene.name}, seed {scene.seed}: {scene.failure}\n" for scene in failed)
    head = f"**{len(failed)} of {len(scenes)} scenes failed** and count with the last step that they reached:"
    return f"{head}\n\n{lines}"


def ablation_section(scenes: Sequence[SceneResult], last_step: int) -> str:
    """What each part is worth, in a table; empty without an ablation."""
    switches = scores_by_switch(scenes)
    if not switches:
        return ""
    ours = [scene.scores for scene in scenes]
    moved = [scene.in_motion for scene in scenes]
    rows = [[f"**{OURS}**", *score_cells(step_means(ours, last_step)[-1]), "", _in_motion_cell(moved), ""]]
    for switch, scores in switches.items():
        at_rest = [
            carried(other, last_step)[-1].overlap_f - carried(own, last_step)[-1].overlap_f
            for other, own in zip(scores, ours, strict=True)
        ]
        other_moved = [scene.ablation_in_motion.get(switch, ()) for scene in scenes]
        moving = [_moving_f(other) - _moving_f(own) for other, own in zip(other_moved, moved, strict=True)]
        rows.append(
            [
                switch,
                *score_cells(step_means(scores, last_step)[-1]),
                _difference(at_rest),
                _in_motion_cell(other_moved),
                _difference(moving),
            ]
        )
    return (
        "## What each part is worth\n\n"
        + markdown_table(("version", *_HEAD, "F against ours", "F in motion", "against ours"), rows)
        + """
After the last interaction, in percent, means over the same scenes, and Overlap F of what moved while it
moved. The runs were made once, by this project's version, which chose the pushes; each row segments the
recorded frames again with one thing otherwise, as the paper has it or left out (the last rows with all as
the paper has it). A difference in Overlap F is the mean over the scenes, ± its standard error.
"""
        + "".join(
            f"\nIn {scene.name} *{switch}* failed on the way and keeps what it had: {why}\n"
            for scene in scenes
            for switch, why in scene.ablation_failures.items()
        )
    )


def _moving_f(interactions: Sequence[InMotion | None]) -> float:
    """Overlap F in motion of one scene, in [0, 1]; NaN where nothing moved in sight."""
    figures = pooled(interactions)
    return float("nan") if figures is None else figures.overlap_f


def _in_motion_cell(scenes: Sequence[Sequence[InMotion | None]]) -> str:
    """The mean over the scenes where something moved in sight, in percent."""
    _, mean = mean_over_scenes(scenes)
    return "–" if mean is None else percent(mean.overlap_f)


def _difference(of_scenes: Iterable[float]) -> str:
    """The mean over the scenes where it is known, with its standard error, in percent."""
    difference = 100 * np.array([each for each in of_scenes if not isnan(each)])
    if not len(difference):
        return "–"
    if len(difference) < 2:
        return f"{difference.mean():+.1f}"
    return f"{difference.mean():+.1f} ± {difference.std(ddof=1) / np.sqrt(len(difference)):.1f}"


def markdown_table(head: Iterable[str], rows: Iterable[Sequence[str]]) -> str:
    """A table in Markdown, its figures to the right."""
    head = list(head)
    lines = [
        head,
        ["---"] + ["---:"] * (len(head) - 1),
        *([cell.replace("|", "/") for cell in row] for row in rows),
    ]
    return "".join(f"| {' | '.join(cells)} |\n" for cells in lines)


def _strong(text: str, strong: bool) -> str:
    return f"**{text}**" if strong else text


def percent(share: float) -> str:
    """A share in percent, or a dash for what is unknown."""
    return _number(100 * share, 1)


def _number(value: float, digits: int) -> str:
    return "–" if isnan(value) else f"{value:.{digits}f}"
