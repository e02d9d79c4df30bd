"""`report.html` of an evaluation: what was run, every scene's last picture, the worst first, and the means."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from riseg_drake.app.evaluate.scene_folder import SceneTask
from riseg_drake.app.output_folder import SUMMARY, read_json
from riseg_drake.app.report_page import Moment, Report, Table, View, report_html, scores_table, told_facts, view
from riseg_drake.evaluation.ablation_report import TITLE, ablation_failures, ablation_table
from riseg_drake.evaluation.report import ending_counts
from riseg_drake.evaluation.scene_result import SceneResult, scores_by_method
from riseg_drake.evaluation.step_means import step_means
from riseg_drake.host.images import DamagedImageError, read_image

MOST_VIEWS = 12
"""Scenes whose picture is shown, those with the lowest Overlap F: some 150 kB each."""


def evaluation_page(
    results: Sequence[SceneResult], tasks: Sequence[SceneTask], summary: Mapping[str, Any], last_step: int
) -> str:
    """The page, as HTML. A scene of which a picture cannot be read is shown without."""
    folders = {task.folder.name: task.folder for task in tasks}
    views: list[View] = []
    moments: list[Moment] = []
    for result in worst_first(results)[:MOST_VIEWS]:
        seen = last_view(result, folders[result.name])
        if seen is not None:
            moments.append(Moment(f"{result.name}, seed {result.seed}", [end_of(result)], [len(views)]))
            views.append(seen)
    methods = scores_by_method(results)
    means = [(method, step_means(scores, last_step)[-1]) for method, scores in methods.items()]
    steps = [(str(i), mean) for i, mean in enumerate(step_means([r.scores for r in results], last_step))]
    scenes = [(f"{r.name}, {r.ended or 'otherwise'}", r.scores[-1]) for r in results if r.scores]
    endings = ", ".join(f"{number} {ended}" for ended, number in ending_counts(results).items())
    ablation = ablation_table(results, last_step)
    settings = summary.get("evaluation", {})
    facts = [(name, str(settings[name])) for name in ("scenario", "seed") if name in settings]
    return report_html(
        Report(
            title=f"Evaluation of {len(results)} scene{'' if len(results) == 1 else 's'}",
            facts=[*told_facts(), *facts, ("scenes shown", f"{len(views)}, the lowest Overlap F first")],
            ending=f"Ended: {endings}.",
            views=views,
            moments=moments,
            objects=None,
            doubts=[f"{r.name} (seed {r.seed}) failed: {r.failure}" for r in results if r.failure]
            + ablation_failures(results),
            tables=[
                scores_table(means, "method"),
                scores_table(steps, "after interaction"),
                scores_table(scenes, "scene, and how it ended"),
                *([Table(f"{TITLE}, in percent", ablation.head, ablation.rows)] if ablation else []),
            ],
        )
    )


def worst_first(results: Sequence[SceneResult]) -> list[SceneResult]:
    """The scenes that have scores, those with the lowest Overlap F first."""
    return sorted((r for r in results if r.scores), key=lambda result: result.scores[-1].overlap_f)


def end_of(result: SceneResult) -> str:
    """How a scene ended, in a sentence."""
    last = result.scores[-1]
    pushes = f"{result.interactions} interaction{'' if result.interactions == 1 else 's'}"
    return f"Overlap F {100 * last.overlap_f:.1f} % after {pushes}; {result.end}."


def last_view(result: SceneResult, folder: Path) -> View | None:
    """The picture after the last interaction, with masks and truth."""
    step = folder / f"step_{len(result.scores) - 1}"
    try:
        color, mask, truth = (read_image(step / f"{name}.png") for name in ("color", "mask", "ground_truth"))
        color = np.ascontiguousarray(color[..., ::-1])  # OpenCV reads BGR
        steps = read_json(folder / SUMMARY).get("steps", [])
        sure = {int(a): float(c) for a, c in steps[-1].get("confidence", {}).items()}
        return view(f"{result.name}, after the last interaction", color, mask, truth, sure)
    except (DamagedImageError, OSError, ValueError, TypeError, AttributeError, IndexError):
        return None
