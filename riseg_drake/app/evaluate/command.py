"""`riseg evaluate`: many scenes, the paper's table and figure made of them."""

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from pydrake.common.yaml import yaml_dump_typed
from rich.console import Console

from riseg_drake.app.evaluate.given_masks import parse_given_masks, with_given_masks
from riseg_drake.app.evaluate.page import evaluation_page
from riseg_drake.app.evaluate.progress import EvaluationProgress
from riseg_drake.app.evaluate.scene_folder import SceneTask, digest, is_finished, read_result
from riseg_drake.app.evaluate.scene_pool import Pool, pool_for
from riseg_drake.app.output_folder import OutputFolder
from riseg_drake.app.report_page import REPORT as PAGE
from riseg_drake.app.scenario import Scenario, load_scenario, scenario_name
from riseg_drake.app.tables import score_table
from riseg_drake.evaluation.disturbance import disturbance_of_all, disturbance_of_steps
from riseg_drake.evaluation.figure import figure_png
from riseg_drake.evaluation.in_motion import in_motion_of_steps, mean_over_scenes
from riseg_drake.evaluation.report import FIGURE_FILE, ending_counts, report_text
from riseg_drake.evaluation.scene_result import OURS, SceneResult, scores_by_method, scores_by_switch
from riseg_drake.evaluation.step_means import step_deviations, step_means
from riseg_drake.learned.sam import load_sam
from riseg_drake.recording.whole_file import write_bytes, write_text
from riseg_drake.stations.object_models import find_models
from riseg_drake.stations.scene import check_scene

REPORT = "report.md"
PARTS = "|".join([r"scene_\d+", *map(re.escape, (REPORT, PAGE, FIGURE_FILE))])
"""What an evaluation puts into its folder, beside the summary."""


class EvaluationError(ValueError):
    """Why an evaluation says nothing, in one line."""


@dataclass(frozen=True)
class EvaluationRequest:
    """What is to be evaluated, and how."""

    scenes: int = 20
    seed: int = 0
    """Of the first scene; the others follow."""
    objects: Path | None = None
    """A folder of models to draw from, or None for the scenario's."""
    jobs: int = 1
    """Scenes at a time."""
    dask: str | None = None
    """Address of a Dask scheduler that does them, or None."""
    output: Path | None = None
    """Folder (out/evaluate_NAME_seed_S)."""
    scenario: Path | None = None
    """A file, or None for the built-in one."""
    ablation: bool = False
    """Whether each recording is segmented again with parts of the algorithm switched off."""
    baseline: str | None = None
    """`sam`, or None."""
    masks: Sequence[str] = ()
    """NAME=FOLDER of masks that other methods made of the same pictures."""
    overwrite: bool = False
    """Whether an earlier evaluation there is removed first."""


def evaluate_command(request: EvaluationRequest, console: Console) -> None:
    """Run what is missing of an evaluation, then write its report.

    Raises EvaluationError where every scene failed, and OutputError for a folder that holds something else.
    """
    scenario = load_scenario(request.scenario)
    if request.objects is not None:
        scenario.simulated.scene.objects = [str(request.objects.resolve())]
    scene = scenario.simulated.scene
    check_scene(scene)
    if scene.placed is None:  # says it if there are none
        find_models(scene.objects, scene.names)
    name = scenario_name(request.scenario)
    sam = request.baseline == "sam"
    if sam:
        _require_sam(scenario)
    folder = request.output or Path("out") / f"evaluate_{name}_seed_{request.seed}"
    tasks = scene_tasks(scenario, name, folder, request.scenes, request.seed, request.ablation, sam)
    given = parse_given_masks(request.masks, taken=(OURS, *tasks[0].baselines))
    pool = pool_for(request.jobs, request.dask)
    last_step = scenario.arm.most_interactions
    results = evaluate(tasks, pool, last_step, console, given, request.overwrite)
    _print_scores(results, last_step, console)
    console.print(f"report in {folder / REPORT}")
    console.print(f"to look at: {folder / PAGE}", highlight=False, soft_wrap=True)
    failures = [result.failure for result in results if result.failure]
    if len(failures) == len(results):
        raise EvaluationError(f"every scene failed; the first: {failures[0]}")


def scene_tasks(
    scenario: Scenario,
    name: str,
    folder: Path,
    scenes: int,
    seed: int,
    ablation: bool = False,
    sam: bool = False,
) -> list[SceneTask]:
    """The scenes of an evaluation: scene k has the seed `seed + k` and the folder `scene_kkk`."""
    text = yaml_dump_typed(scenario, schema=Scenario)
    return [SceneTask(folder / f"scene_{k:03d}", seed + k, name, text, ablation, sam) for k in range(scenes)]


def evaluate(
    tasks: Sequence[SceneTask],
    pool: Pool,
    last_step: int,
    console: Console,
    given: Mapping[str, Path] | None = None,
    overwrite: bool = False,
) -> list[SceneResult]:
    """Work on the scenes that are not finished yet, and write the report on all of them.

    `given` are folders with masks of other methods, by name; with `overwrite` an earlier evaluation is
    removed first. Raises OutputError if the folder belongs to something else, or nothing can be written,
    LabelFolderError for masks that are missing; KeyboardInterrupt says how far it came.
    """
    with _claimed(tasks, overwrite) as folder:
        return _evaluate(folder, tasks, pool, last_step, console, given or {})


def _evaluate(
    folder: OutputFolder,
    tasks: Sequence[SceneTask],
    pool: Pool,
    last_step: int,
    console: Console,
    given: Mapping[str, Path],
) -> list[SceneResult]:
    todo = [task for task in tasks if not is_finished(task)]
    failures: dict[Path, str] = {}
    console.print(_plan(tasks, todo, folder.path))
    with (
        interruption_told(folder, tasks),
        EvaluationProgress(len(tasks), len(tasks) - len(todo), console) as progress,
    ):
        for outcome in pool(todo):
            failures[outcome.task.folder] = outcome.failure
            progress.tell(read_result(outcome.task, outcome.failure), outcome.seconds)
    results = [read_result(task, failures.get(task.folder, "")) for task in tasks]
    results = with_given_masks(results, tasks, given)
    about = _about_text(folder.summary["riseg_drake"], tasks)
    with folder.writing():
        write_text(folder.path / REPORT, report_text(results, about, last_step))
        write_bytes(folder.path / FIGURE_FILE, figure_png(results, last_step))
        write_text(folder.path / PAGE, evaluation_page(results, tasks, folder.summary, last_step))
    folder.note(state="done", **_figures(results, last_step))
    return results


def _require_sam(scenario: Scenario) -> None:
    """Say before the first scene what would fail in each of them."""
    if not scenario.sam.folder:
        raise EvaluationError("--baseline sam needs a model: name its folder in a scenario, sam: {folder: ...}")
    load_sam(Path(scenario.sam.folder), scenario.sam.device)


def _claimed(tasks: Sequence[SceneTask], overwrite: bool) -> OutputFolder:
    """The evaluation's folder, new or to be gone on with. Raises OutputError."""
    settings = {**tasks[0].settings, "ablation": tasks[0].ablation}
    about = {
        "evaluation": settings,
        "scenes": len(tasks),
        "riseg_drake": version("riseg-drake"),
        "state": "running",
    }
    return OutputFolder(
        tasks[0].folder.parent,
        "evaluate",
        PARTS,
        about,
        overwrite=overwrite,
        goes_on=lambda earlier: _difference(earlier.get("evaluation"), settings),
    )


def _difference(earlier: Any, settings: Mapping[str, Any]) -> str:
    """Why an earlier evaluation is not this one; empty if it is."""
    if not isinstance(earlier, dict):
        return "whose settings are unknown"
    if earlier.get("seed") != settings["seed"]:
        return f"which begins with seed {earlier.get('seed')}, not {settings['seed']}"
    if earlier.get("scenario_sha256") != settings["scenario_sha256"]:
        return "which has other settings (scenario or objects)"
    return ""


def _plan(tasks: Sequence[SceneTask], todo: Sequence[SceneTask], folder: Path) -> str:
    seeds = f"seeds {tasks[0].seed} to {tasks[-1].seed}" if len(tasks) > 1 else f"seed {tasks[0].seed}"
    done = len(tasks) - len(todo)
    before = f", {done} finished before" if done else ""
    return f"{tasks[0].scenario_name}, {_count(len(tasks))}, {seeds}{before}; results in {folder}"


def _count(scenes: int) -> str:
    return "1 scene" if scenes == 1 else f"{scenes} scenes"


@contextmanager
def interruption_told(folder: OutputFolder, tasks: Sequence[SceneTask]) -> Iterator[None]:
    """After Ctrl-C, say what is there and how to go on: raises KeyboardInterrupt with that sentence."""
    try:
        yield
    except KeyboardInterrupt:
        folder.note(state="interrupted")
        done = sum(map(is_finished, tasks))
        raise KeyboardInterrupt(
            f"{done} of {len(tasks)} scenes are finished; the same command goes on from there"
        ) from None


def _about_text(program: str, tasks: Sequence[SceneTask]) -> dict[str, object]:
    return {
        "scenes": f"{len(tasks)}, seeds {tasks[0].seed} to {tasks[-1].seed}",
        "scenario": f"{tasks[0].scenario_name} (SHA-256 {digest(tasks[0].scenario)[:12]})",
        "riseg_drake": program,
    }


def _figures(results: Sequence[SceneResult], last_step: int) -> dict[str, Any]:
    """The report's figures as data."""
    return {
        "methods": {
            method: _by_step(scores, last_step) for method, scores in scores_by_method(results).items()
        },
        "ablation": {
            switch: _by_step(scores, last_step) for switch, scores in scores_by_switch(results).items()
        },
        "disturbance": {
            "interactions": [asdict(figures) for figures in _disturbances(results, last_step)],
            "all": asdict(disturbance_of_all([result.disturbances for result in results])),
        },
        "in_motion": {
            "interactions": [
                {"scenes": number, **(asdict(mean) if mean else {})}
                for number, mean in in_motion_of_steps([result.in_motion for result in results], last_step)
            ],
            "all": _in_motion_of_all(results),
        },
        "ended": ending_counts(results),
        "runs": [
            {
                "scene": result.name,
                "seed": result.seed,
                "interactions": result.interactions,
                "end": result.end,
                "ended": result.ended or None,
                "unsettled_area_m2": result.unsettled_area_m2,
                "failure": result.failure,
                "scores": result.scores[-1].as_dict() if result.scores else None,
            }
            for result in results
        ],
    }


def _in_motion_of_all(results: Sequence[SceneResult]) -> dict[str, Any]:
    number, mean = mean_over_scenes([result.in_motion for result in results])
    return {"scenes": number, **(asdict(mean) if mean else {})}


def _disturbances(results: Sequence[SceneResult], last_step: int) -> list[Any]:
    return disturbance_of_steps([result.disturbances for result in results], last_step)


def _by_step(scores: Sequence[Sequence[Any]], last_step: int) -> list[dict[str, Any]]:
    steps = zip(step_means(scores, last_step), step_deviations(scores, last_step), strict=True)
    return [
        {"step": i, "mean": mean.as_dict(), "deviation": deviation.as_dict()}
        for i, (mean, deviation) in enumerate(steps)
    ]


def _print_scores(results: Sequence[SceneResult], last_step: int, console: Console) -> None:
    rows = [(method, step_means(scores, last_step)[-1]) for method, scores in scores_by_method(results).items()]
    console.print(f"\nafter the last interaction, means over {_count(len(results))}, in percent")
    _, moved = mean_over_scenes([result.in_motion for result in results])
    console.print(score_table(rows, first="\nmethod", in_motion={OURS: moved.overlap_f} if moved else {}))
    endings = ", ".join(f"{number} {ended}" for ended, number in ending_counts(results).items())
    console.print(f"ended: {endings}")
