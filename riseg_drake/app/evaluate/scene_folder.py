"""One scene of an evaluation: which it is, what lies in its folder, and what is still missing there.

scene_003/
    summary.json  step_0/ ... step_5/    as `riseg run` leaves them
    report.html                          the same, to be looked at
    recording/                           with an ablation
    baselines.json  ablation.json        scores of other methods, of other versions
"""

import hashlib
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from riseg_drake.app.evaluate.ablation import versions
from riseg_drake.app.output import RECORDING
from riseg_drake.app.output_folder import SUMMARY, read_json, to_json
from riseg_drake.evaluation.baselines import BASELINES
from riseg_drake.evaluation.disturbance import Disturbance, ObjectMotion
from riseg_drake.evaluation.in_motion import InMotion
from riseg_drake.evaluation.scene_result import SAM_METHODS, SceneResult
from riseg_drake.evaluation.scores import Scores
from riseg_drake.recording.layout import COLOR_LIST
from riseg_drake.recording.whole_file import write_text

BASELINE_FILE = "baselines.json"
ABLATION_FILE = "ablation.json"

Figures = TypeVar("Figures")


@dataclass(frozen=True)
class SceneTask:
    """One scene to be evaluated; it can be sent to another process or machine."""

    folder: Path
    seed: int
    scenario_name: str
    scenario: str
    """The whole scenario as YAML."""
    ablation: bool = False
    sam: bool = False
    """Whether Segment Anything is among the baselines."""
    threads: int = 1
    """How many the drawing of images may use; numbers are always crunched in one."""

    @property
    def baselines(self) -> tuple[str, ...]:
        """The methods that must have their scores, by name."""
        return (*BASELINES, *(SAM_METHODS if self.sam else ()))

    @property
    def settings(self) -> dict[str, Any]:
        """What the result depends on, as the run's summary says it."""
        return {
            "scenario": self.scenario_name,
            "scenario_sha256": digest(self.scenario),
            "seed": self.seed,
        }


def digest(scenario: str) -> str:
    """A name for a scenario's whole content."""
    return hashlib.sha256(scenario.encode()).hexdigest()


def is_finished(task: SceneTask) -> bool:
    """Whether nothing is left to do for a scene."""
    if not _run_is_finished(task) or missing_baselines(task):
        return False
    return not task.ablation or ablation_is_finished(task)


def run_is_usable(task: SceneTask) -> bool:
    """Whether the run is finished, and recorded if it must be segmented again."""
    if not _run_is_finished(task):
        return False
    recorded = (task.folder / RECORDING / COLOR_LIST).exists()
    return not task.ablation or recorded or ablation_is_finished(task)


def missing_baselines(task: SceneTask) -> set[str]:
    """The methods that have no scores yet."""
    return set(task.baselines) - set(_scores_from_json(read_json(task.folder / BASELINE_FILE)))


def ablation_is_finished(task: SceneTask) -> bool:
    """Whether every version that there is to compare has its scores, at rest and in motion."""
    content = read_json(task.folder / ABLATION_FILE)
    both = _scores_from_json(content.get("scores")), _in_motion_from_json(content.get("in_motion"))
    return all(set(figures) == set(versions()) for figures in both)


def note_death(task: SceneTask, failure: str) -> None:
    """Say in a scene's summary that its process died, since that could not."""
    summary = read_json(task.folder / SUMMARY) or {**task.settings, "steps": []}
    task.folder.mkdir(parents=True, exist_ok=True)
    content = {"command": "run", **summary, "state": "failed", "end": failure}
    write_text(task.folder / SUMMARY, to_json(content))


def read_result(task: SceneTask, failure: str = "") -> SceneResult:
    """What the folder of a scene says; `failure` is what else is known to have gone wrong."""
    summary = read_json(task.folder / SUMMARY)
    end = str(summary.get("end", "it did not begin"))
    ablation = read_json(task.folder / ABLATION_FILE) if task.ablation else {}
    baselines = _scores_from_json(read_json(task.folder / BASELINE_FILE))
    try:
        scores, disturbances, in_motion = _figures_of_steps(summary)
        unsettled_area = _number(summary.get("unsettled_area_m2"))
    except _DAMAGED:
        scores, disturbances, in_motion, summary = [], [], [], {}
        unsettled_area = float("nan")
        end = f"{task.folder / SUMMARY} is damaged"
    return SceneResult(
        name=task.folder.name,
        seed=task.seed,
        failure=failure or ("" if summary.get("state") == "done" else end),
        end=end,
        ended=str(summary.get("ended") or ""),
        unsettled_area_m2=unsettled_area,
        scores=scores,
        disturbances=disturbances,
        in_motion=in_motion,
        baselines={name: baselines[name] for name in task.baselines if name in baselines},
        ablation=_scores_from_json(ablation.get("scores")),
        ablation_in_motion=_in_motion_from_json(ablation.get("in_motion")),
        ablation_failures=_texts(ablation.get("failures")),
    )


def _run_is_finished(task: SceneTask) -> bool:
    summary = read_json(task.folder / SUMMARY)
    same = all(summary.get(key) == task.settings[key] for key in ("scenario_sha256", "seed"))
    try:
        _figures_of_steps(summary)
        _number(summary.get("unsettled_area_m2"))
    except _DAMAGED:
        return False
    return same and summary.get("state") == "done"


_DAMAGED = (KeyError, TypeError, ValueError, AttributeError, OverflowError)
"""What comes of a file of results that somebody or something has changed."""


def _figures_of_steps(
    summary: Mapping[str, Any],
) -> tuple[list[Scores], list[Disturbance], list[InMotion | None]]:
    """The scores of all steps, what each interaction did, and the masks meanwhile. Raises one of _DAMAGED."""
    steps = summary.get("steps", [])
    return (
        [Scores.from_dict(step["scores"]) for step in steps],
        [_disturbance(step) for step in steps[1:]],
        [_in_motion(step.get("in_motion")) for step in steps[1:]],
    )


def _disturbance(step: Mapping[str, Any]) -> Disturbance:
    motions = {name: ObjectMotion(**motion) for name, motion in step.get("motions", {}).items()}
    return Disturbance(step.get("pushed"), motions)


def _in_motion(figures: Mapping[str, Any] | None) -> InMotion | None:
    if figures is None:
        return None
    return InMotion(int(figures["frames"]), _number(figures["overlap_f"]), _number(figures["at_rest_f"]))


def _number(value: float | None) -> float:
    """A number as JSON has it, where NaN is null."""
    return float("nan") if value is None else float(value)


def _scores_from_json(content: Any) -> dict[str, list[Scores]]:
    """The scores of each method whose entry can be read."""
    return _by_name(content, Scores.from_dict)


def _in_motion_from_json(content: Any) -> dict[str, list[InMotion | None]]:
    """The masks in motion of each version whose entry can be read."""
    return _by_name(content, _in_motion)


def _by_name(content: Any, read: Callable[[Any], Figures]) -> dict[str, list[Figures]]:
    """The figures of every name whose entry can be read."""
    figures = {}
    for name, entries in content.items() if isinstance(content, Mapping) else ():
        with suppress(*_DAMAGED):
            figures[name] = [read(each) for each in entries]
    return figures


def _texts(content: Any) -> dict[str, str]:
    return {str(k): str(v) for k, v in content.items()} if isinstance(content, Mapping) else {}
