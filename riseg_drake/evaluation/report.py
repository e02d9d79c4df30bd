"""The report of an evaluation, in Markdown: the paper's table with ours in it, and what else was seen."""

from collections import Counter
from collections.abc import Mapping, Sequence
from math import isnan

import numpy as np

from riseg_drake.evaluation.ablation_report import ablation_section, moving_f
from riseg_drake.evaluation.disturbance import (
    FELL,
    TOPPLED_DEG,
    DisturbanceFigures,
    disturbance_of_all,
    disturbance_of_steps,
)
from riseg_drake.evaluation.figure_table import SCORE_HEAD, markdown_table, number, percent, score_cells
from riseg_drake.evaluation.in_motion import MOVED, in_motion_of_steps, mean_over_scenes
from riseg_drake.evaluation.published import PUBLISHED
from riseg_drake.evaluation.scene_result import OURS, SceneResult, scores_by_method
from riseg_drake.evaluation.scores import FOUND_ABOVE_F
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
        markdown_table(("method", "step i", *SCORE_HEAD), rows)
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
    for name, (count, mean) in zip(names, figures, strict=True):
        cells = ["0", "–", "–"] if mean is None else []
        if mean is not None:
            cells = [str(mean.frames), percent(mean.overlap_f), percent(mean.at_rest_f)]
        rows.append([name, str(count), *cells])
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
    for ended, count in ending_counts(scenes).items():
        areas = [s.unsettled_area_m2 for s in scenes if not s.failure and (s.ended or "otherwise") == ended]
        known = [1e4 * area for area in areas if not isnan(area)]
        mean, most = (np.mean(known), max(known)) if known else (float("nan"), float("nan"))
        rows.append([ended, str(count), number(float(mean), 1), number(float(most), 1)])
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
        number(100 * figures.pushed_mean_m, 2),
        number(1000 * figures.others_median_m, 2),
        number(figures.tilt_max_deg, 1),
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
                percent(moving_f(scene.in_motion)),
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


def _strong(text: str, strong: bool) -> str:
    return f"**{text}**" if strong else text
