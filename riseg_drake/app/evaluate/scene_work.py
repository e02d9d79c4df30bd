"""The work on one scene of an evaluation: all that one process does."""

import os
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from time import perf_counter

import cv2
from threadpoolctl import threadpool_limits

from riseg_drake.app.evaluate.ablation import RecordedStep, ablate
from riseg_drake.app.evaluate.sam_baseline import score_sam
from riseg_drake.app.evaluate.scene_baselines import score_baselines
from riseg_drake.app.evaluate.scene_folder import (
    ABLATION_FILE,
    BASELINE_FILE,
    SceneTask,
    ablation_is_finished,
    missing_baselines,
    run_is_usable,
)
from riseg_drake.app.output import RECORDING, RunFolder
from riseg_drake.app.output_folder import SUMMARY, OutputError, read_json, to_json
from riseg_drake.app.run.command import run
from riseg_drake.app.scenario import Scenario
from riseg_drake.app.scenario_file import parse_scenario
from riseg_drake.evaluation.baselines import BASELINES
from riseg_drake.evaluation.scene_result import SAM_METHODS
from riseg_drake.evaluation.scores import Scores
from riseg_drake.host.terminal import Notice, one_line
from riseg_drake.learned.sam import SamParameters
from riseg_drake.recording.whole_file import write_text


@dataclass(frozen=True)
class SceneOutcome:
    """What the process that worked on a scene has to say."""

    task: SceneTask
    failure: str
    """In one line; empty if all went well."""
    seconds: float
    """How long it took, s."""


def work_on(task: SceneTask) -> SceneOutcome:
    """Do what is missing of a scene. Any error is the scene's failure and is returned, not raised.

    But OutputError is, where nothing can be written.
    """
    start = perf_counter()
    scenario = parse_scenario(task.scenario, Scenario, source=task.scenario_name)
    failure = ""
    with limited_threads(task.threads), warnings.catch_warnings():
        warnings.simplefilter("ignore", Notice)  # told once, before all scenes
        for part in (_run, _score_others):
            try:
                part(task, scenario)
            except (OutputError, OSError) as error:  # a full disk is no scene's failure: it would be everyone's
                raise OutputError(one_line(error)) from None
            except Exception as error:  # whatever it is, the other scenes go on
                failure = failure or one_line(error) or type(error).__name__
    return SceneOutcome(task, failure, perf_counter() - start)


@contextmanager
def limited_threads(threads: int) -> Iterator[None]:
    """Give drawing and images so many threads, and linear algebra one.

    Sums of numbers come out differently, in their last bits, with the number of threads that share them;
    images do not.
    """
    before = cv2.getNumThreads()
    os.environ.setdefault("LP_NUM_THREADS", str(threads))  # Mesa's software renderer
    cv2.setNumThreads(threads)
    try:
        with threadpool_limits(1):
            yield
    finally:
        cv2.setNumThreads(before)


def _run(task: SceneTask, scenario: Scenario) -> None:
    if run_is_usable(task):
        return
    for name in (BASELINE_FILE, ABLATION_FILE):
        (task.folder / name).unlink(missing_ok=True)
    # Outlines are refined afterwards, from what the run left: it is the same with and without a model.
    scenario = replace(scenario, sam=SamParameters())
    # What a stopped evaluation left half done is done anew.
    with RunFolder(task.folder, task.settings, overwrite=True) as folder:
        run(scenario, task.seed, folder, record=task.ablation)


def _score_others(task: SceneTask, scenario: Scenario) -> None:
    """The scores of the baselines and, if asked for, of the other versions, for the steps there are."""
    steps = read_json(task.folder / SUMMARY).get("steps", [])
    missing = missing_baselines(task)
    for methods, score_methods in ((BASELINES, score_baselines), (SAM_METHODS, score_sam)):
        if missing & set(methods):
            scores = _scores_to_json(score_methods(scenario, task.folder, len(steps)))
            earlier = read_json(task.folder / BASELINE_FILE)
            write_text(task.folder / BASELINE_FILE, to_json({**earlier, **scores}))
    if task.ablation and steps and not ablation_is_finished(task):
        recorded = [RecordedStep.from_summary(step) for step in steps]
        ablation = ablate(scenario, task.seed, task.folder / RECORDING, recorded)
        content = {
            "scores": _scores_to_json(ablation.scores),
            "in_motion": {
                name: [None if each is None else asdict(each) for each in interactions]
                for name, interactions in ablation.in_motion.items()
            },
            "failures": ablation.failures,
        }
        write_text(task.folder / ABLATION_FILE, to_json(content))


def _scores_to_json(scores: Mapping[str, Sequence[Scores]]) -> dict[str, list[dict[str, float]]]:
    return {name: [each.as_dict() for each in steps] for name, steps in scores.items()}
