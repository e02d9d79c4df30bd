"""The report of a suite, in Markdown: a row a kind, beside what one picture alone gives."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from riseg_drake.evaluation.ablation_report import ablation_section
from riseg_drake.evaluation.disturbance import DisturbanceFigures, disturbance_of_all
from riseg_drake.evaluation.figure_table import FigureTable, markdown_table, percent
from riseg_drake.evaluation.in_motion import MOVED, InMotion, mean_over_scenes
from riseg_drake.evaluation.report import DISTURBANCE_HEAD, disturbance_cells
from riseg_drake.evaluation.scene_result import SceneResult
from riseg_drake.evaluation.scores import Scores
from riseg_drake.evaluation.step_means import step_means


@dataclass(frozen=True)
class KindResult:
    """All scenes of one kind."""

    name: str
    folder: str
    """Where their results are, beside the report."""
    scenes: Sequence[SceneResult]
    last_step: int
    """The interactions that a scene may have."""

    def mean(self, method: str | None, step: int) -> Scores:
        """The mean scores at a step (-1: the last) of ours (None) or of a baseline."""
        scores = [s.scores if method is None else s.baselines.get(method, ()) for s in self.scenes]
        return step_means(scores, self.last_step)[step]

    @property
    def interactions(self) -> float:
        """How many times things were pushed in a scene, on the mean."""
        return float(np.mean([scene.interactions for scene in self.scenes]))

    @property
    def in_motion(self) -> InMotion | None:
        """Of the things that were moved, the mean over the scenes; None where nothing moved in sight."""
        return mean_over_scenes([scene.in_motion for scene in self.scenes])[1]

    @property
    def disturbance(self) -> DisturbanceFigures:
        """By how much things were moved."""
        return disturbance_of_all([scene.disturbances for scene in self.scenes])

    @property
    def endings(self) -> dict[str, int]:
        """How many scenes ended for each reason, the most frequent first."""
        reasons = [f"failed: {s.failure}" if s.failure else s.ended or "otherwise" for s in self.scenes]
        return dict(Counter(reasons).most_common())


def suite_text(kinds: Sequence[KindResult], about: Mapping[str, object]) -> str:
    """The whole report; `about` are its settings, by name."""

    def linked(table: FigureTable, places: Sequence[str]) -> str:
        rows = [[f"[{row[0]}]({place})", *row[1:]] for row, place in zip(table.rows, places, strict=True)]
        return markdown_table(table.head, rows)

    pictures = [
        f"{kind.folder}/{scene.name}/step_{scene.interactions}/overlay.png"
        for kind in kinds
        for scene in kind.scenes
    ]
    moved = moved_table(kinds)
    ablation = ablation_section(*of_all_kinds(kinds))
    return "\n".join(
        [
            "# A suite of scenes\n",
            "".join(f"- {name}: {value}\n" for name, value in about.items()),
            linked(kinds_table(kinds), [f"{kind.folder}/report.md" for kind in kinds]),
            "In percent, after the last interaction, means over the scenes of a kind. The baselines move\n"
            "nothing: their Overlap F on the picture before the first interaction, and after the last.\n",
            "## In motion, and what was moved\n",
            markdown_table(moved.head, moved.rows),
            f"Overlap F, in percent, of what has moved by {100 * MOVED:g} cm or more, in every frame from\n"
            "then on until the camera observes again, and of the same at rest after it.\n",
            *([ablation] if ablation else []),
            "## The scenes\n",
            linked(scenes_table(kinds), pictures),
        ]
    )


def of_all_kinds(kinds: Sequence[KindResult]) -> tuple[list[SceneResult], int]:
    """Every scene, its kind before its name, and the most interactions that any of them may have."""
    scenes = [replace(scene, name=f"{kind.name}, {scene.name}") for kind in kinds for scene in kind.scenes]
    return scenes, max(kind.last_step for kind in kinds)


def kinds_table(kinds: Sequence[KindResult]) -> FigureTable:
    """The scores of each kind beside the baselines', in percent, and how its scenes ended."""
    baselines = list(dict.fromkeys(name for kind in kinds for scene in kind.scenes for name in scene.baselines))
    head = ["kind", "scenes", "interactions", "Overlap F", "Boundary F", "found %"]
    head += [f"{name}, {when}" for name in baselines for when in ("untouched", "last")] + ["ended"]
    rows = []
    for kind in kinds:
        last = kind.mean(None, -1)
        of_baselines = [percent(kind.mean(name, step).overlap_f) for name in baselines for step in (0, -1)]
        rows.append(
            [
                kind.name,
                str(len(kind.scenes)),
                f"{kind.interactions:.1f} of {kind.last_step}",
                percent(last.overlap_f),
                percent(last.boundary_f),
                percent(last.found_share),
                *of_baselines,
                "; ".join(f"{number} {reason}" for reason, number in kind.endings.items()),
            ]
        )
    return FigureTable(head, rows)


def suite_figures(kinds: Sequence[KindResult]) -> dict[str, Any]:
    """The table as data, by the kind's folder."""
    return {
        kind.folder: {
            "scenes": len(kind.scenes),
            "interactions": kind.interactions,
            "most_interactions": kind.last_step,
            "scores": kind.mean(None, -1).as_dict(),
            "baselines": {
                name: {"untouched": kind.mean(name, 0).as_dict(), "last": kind.mean(name, -1).as_dict()}
                for name in dict.fromkeys(name for scene in kind.scenes for name in scene.baselines)
            },
            "in_motion": None if kind.in_motion is None else asdict(kind.in_motion),
            "disturbance": asdict(kind.disturbance),
            "endings": kind.endings,
        }
        for kind in kinds
    }


def moved_table(kinds: Sequence[KindResult]) -> FigureTable:
    """Overlap F in motion and at rest after it, in percent, and by how much things were moved."""
    rows = []
    for kind in kinds:
        moved, disturbed = kind.in_motion, kind.disturbance
        in_motion = ["–", "–"] if moved is None else [percent(moved.overlap_f), percent(moved.at_rest_f)]
        rows.append([kind.name, *in_motion, *disturbance_cells(disturbed)])
    return FigureTable(("kind", "in motion", "at rest after it", *DISTURBANCE_HEAD), rows)


def scenes_table(kinds: Sequence[KindResult]) -> FigureTable:
    """Every scene's scores in percent, and how it ended."""
    rows = []
    for kind in kinds:
        for scene in kind.scenes:
            last = scene.scores[-1] if scene.scores else None
            figures = ["–"] * 3
            if last is not None:
                found = f"{last.objects_found:g} of {last.objects_true:g}"
                figures = [percent(last.overlap_f), percent(last.boundary_f), found]
            about = [kind.name, str(scene.seed), str(scene.interactions)]
            rows.append([*about, *figures, scene.failure or scene.end])
    return FigureTable(("kind", "seed", "interactions", "Overlap F", "Boundary F", "found", "end"), rows)
