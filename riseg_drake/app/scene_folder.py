"""One scene of an evaluation: which it is, what lies in its folder, and what is still missing there.

scene_003/
    summary.json  step_0/ ... step_5/    as `riseg run` leaves them
    recording/                           with an ablation
    baselines.json  ablation.json        scores of other methods, of other versions
"""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from riseg_drake.app.ablation import versions
from riseg_drake.app.output import RECORDING, SUMMARY, to_json
from riseg_drake.evaluation.baselines import BASELINES
from riseg_drake.evaluation.disturbance import Disturbance, ObjectMotion
from riseg_drake.evaluation.in_motion import InMotion
from riseg_drake.evaluation.scene_result import SAM_METHODS, SceneResult
from riseg_drake.evaluation.scores import Scores
from riseg_drake.recording.layout import COLOR_LIST
from riseg_drake.recording.whole_file import write_text

BASELINE_FILE = "baselines.json"
ABLATION_FILE = "ablation.json"


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
    return set(task.baselines) - set(read_json(task.folder / BASELINE_FILE))


def ablation_is_finished(task: SceneTask) -> bool:
    """Whether every version that there is to compare has its scores."""
    return set(read_json(task.folder / ABLATION_FILE).get("scores", {})) == set(versions())


def note_death(task: SceneTask, failure: str) -> None:
    """Say in a scene's summary that its process died, since that could not."""
    summary = read_json(task.folder / SUMMARY) or {**task.settings, "steps": []}
    task.folder.mkdir(parents=True, exist_ok=True)
    write_text(task.folder / SUMMARY, to_json({**summary, "state": "failed", "end": failure}))


def has_begun(task: SceneTask) -> bool:
    """Whether a process is at work on the run, or died over it."""
    return read_json(task.folder / SUMMARY).get("state") == "running"


def read_result(task: SceneTask, failure: str = "") -> SceneResult:
    """What the folder of a scene says; `failure` is what else is known to have gone wrong."""
    summary = read_json(task.folder / SUMMARY)
    end = str(summary.get("end", "it did not begin"))
    ablation = read_json(task.folder / ABLATION_FILE) if task.ablation else {}
    steps = summary.get("steps", [])
    baselines = _scores_from_json(read_json(task.folder / BASELINE_FILE))
    return SceneResult(
        name=task.folder.name,
        seed=task.seed,
        failure=failure or ("" if summary.get("state") == "done" else end),
        end=end,
        ended=summary.get("ended") or "",
        unsettled_area_m2=_number(summary.get("unsettled_area_m2")),
        scores=[Scores.from_dict(step["scores"]) for step in steps],
        disturbances=[_disturbance(step) for step in steps[1:]],
        in_motion=[_in_motion(step.get("in_motion")) for step in steps[1:]],
        baselines={name: baselines[name] for name in task.baselines if name in baselines},
        ablation=_scores_from_json(ablation.get("scores", {})),
        ablation_failures=ablation.get("failures", {}),
    )


def read_json(path: Path) -> dict[str, Any]:
    """The content of a file; empty if it is not there, or nobody can read it."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return content if isinstance(content, dict) else {}


def _run_is_finished(task: SceneTask) -> bool:
    summary = read_json(task.folder / SUMMARY)
    same = all(summary.get(key) == task.settings[key] for key in ("scenario_sha256", "seed"))
    return same and summary.get("state") == "done"


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


def _scores_from_json(content: Mapping[str, Any]) -> dict[str, list[Scores]]:
    return {name: [Scores.from_dict(each) for each in steps] for name, steps in content.items()}
