"""`riseg evaluate`: many scenes, the paper's table and figure made of them."""

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path
from typing import Any

from pydrake.common.yaml import yaml_dump_typed
from rich.console import Console

from riseg_drake.app.evaluation_progress import EvaluationProgress
from riseg_drake.app.given_masks import parse_given_masks, with_given_masks
from riseg_drake.app.graphics import require_graphics
from riseg_drake.app.output import SUMMARY, OutputError, to_json
from riseg_drake.app.scenario import Scenario, load_scenario, scenario_name
from riseg_drake.app.scene_folder import SceneTask, digest, is_finished, read_result
from riseg_drake.app.scene_pool import Pool, cluster_pool, local_pool
from riseg_drake.app.tables import score_table
from riseg_drake.evaluation.disturbance import disturbance_of_all, disturbance_of_steps
from riseg_drake.evaluation.figure import draw_figure
from riseg_drake.evaluation.report import FIGURE_FILE, report_text
from riseg_drake.evaluation.scene_result import OURS, SceneResult, scores_by_method, scores_by_switch
from riseg_drake.evaluation.step_means import step_deviations, step_means
from riseg_drake.learned.sam import load_sam
from riseg_drake.recording.whole_file import write_text
from riseg_drake.stations.object_models import find_models

REPORT = "report.md"


class EvaluationError(ValueError):
    """Why an evaluation says nothing, in one line."""


def evaluate_command(
    scenes: int,
    seed: int,
    objects: Path | None,
    jobs: int,
    output: Path | None,
    scenario_file: Path | None,
    dask: str | None,
    ablation: bool,
    baseline: str | None,
    masks: Sequence[str],
    console: Console,
) -> None:
    """Run what is missing of an evaluation, then write its report.

    Raises EvaluationError where every scene failed, and OutputError for a folder that holds something else.
    """
    scenario = load_scenario(scenario_file)
    if objects is not None:
        scenario.simulated.scene.objects = [str(objects.resolve())]
    if not scenario.simulated.scene.placed:  # says it if there are none
        find_models(scenario.simulated.scene.objects, scenario.simulated.scene.names)
    name = scenario_name(scenario_file)
    if baseline == "sam":
        _require_sam(scenario)
    tasks = scene_tasks(
        scenario,
        name,
        output or Path("out") / f"evaluate_{name}_seed_{seed}",
        scenes,
        seed,
        ablation,
        sam=baseline == "sam",
    )
    given = parse_given_masks(masks, taken=(OURS, *tasks[0].baselines))
    folder = tasks[0].folder.parent
    if dask is None:
        require_graphics()
    pool = local_pool(jobs) if dask is None else cluster_pool(dask)
    last_step = scenario.arm.most_interactions
    results = evaluate(tasks, pool, last_step, console, given)
    _print_scores(results, last_step, console)
    console.print(f"report in {folder / REPORT}")
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
) -> list[SceneResult]:
    """Work on the scenes that are not finished yet, and write the report on all of them.

    `given` are folders with masks of other methods, by name. Raises OutputError if the folder belongs to
    something else, LabelFolderError for masks that are missing; KeyboardInterrupt says how far it came.
    """
    folder = tasks[0].folder.parent
    about = _claim(folder, tasks)
    todo = [task for task in tasks if not is_finished(task)]
    failures: dict[Path, str] = {}
    console.print(_plan(tasks, todo, folder))
    with (
        _interruption_told(folder, about, tasks),
        EvaluationProgress(len(tasks), len(tasks) - len(todo), console) as progress,
    ):
        for outcome in pool(todo):
            failures[outcome.task.folder] = outcome.failure
            progress.tell(read_result(outcome.task, outcome.failure), outcome.seconds)
    results = [read_result(task, failures.get(task.folder, "")) for task in tasks]
    results = with_given_masks(results, tasks, given or {})
    write_text(folder / REPORT, report_text(results, _about_text(about, tasks), last_step))
    draw_figure(results, last_step, folder / FIGURE_FILE)
    write_text(folder / SUMMARY, to_json({**about, "state": "done", **_figures(results, last_step)}))
    return results


def _require_sam(scenario: Scenario) -> None:
    """Say before the first scene what would fail in each of them."""
    if not scenario.sam.folder:
        raise EvaluationError("--baseline sam needs a model: name its folder in a scenario, sam: {folder: ...}")
    load_sam(Path(scenario.sam.folder), scenario.sam.device)


def _claim(folder: Path, tasks: Sequence[SceneTask]) -> dict[str, Any]:
    """Make the folder, or make sure that it is this evaluation's; returns what its summary begins with."""
    settings = {**tasks[0].settings, "ablation": tasks[0].ablation}
    about = {"evaluation": settings, "scenes": len(tasks), "riseg_drake": version("riseg-drake")}
    if folder.exists() and not folder.is_dir():
        raise OutputError(f"{folder} is a file; give a folder for the output")
    try:
        if folder.is_dir() and any(folder.iterdir()):
            _require_same(folder, settings)
        folder.mkdir(parents=True, exist_ok=True)
        write_text(folder / SUMMARY, to_json({**about, "state": "running"}))
    except OSError as error:
        raise OutputError(f"cannot write to {folder}: {error.strerror}") from None
    return about


def _require_same(folder: Path, settings: Mapping[str, Any]) -> None:
    try:
        earlier = json.loads((folder / SUMMARY).read_text(encoding="utf-8"))["evaluation"]
    except (OSError, ValueError, KeyError, TypeError):
        raise OutputError(
            f"{folder} is not empty and holds no earlier evaluation; give a new folder, or an empty one"
        ) from None
    if earlier.get("seed") != settings["seed"]:
        what = f"begins with seed {earlier.get('seed')}, not {settings['seed']}"
    elif earlier.get("scenario_sha256") != settings["scenario_sha256"]:
        what = "has other settings (scenario or objects)"
    else:
        return
    raise OutputError(f"{folder} holds another evaluation, which {what}; give a new folder with --output")


def _plan(tasks: Sequence[SceneTask], todo: Sequence[SceneTask], folder: Path) -> str:
    seeds = f"seeds {tasks[0].seed} to {tasks[-1].seed}" if len(tasks) > 1 else f"seed {tasks[0].seed}"
    done = len(tasks) - len(todo)
    before = f", {done} finished before" if done else ""
    return f"{tasks[0].scenario_name}, {_count(len(tasks))}, {seeds}{before}; results in {folder}"


def _count(scenes: int) -> str:
    return "1 scene" if scenes == 1 else f"{scenes} scenes"


@contextmanager
def _interruption_told(folder: Path, about: Mapping[str, Any], tasks: Sequence[SceneTask]) -> Iterator[None]:
    """After Ctrl-C, say what is there and how to go on."""
    try:
        yield
    except KeyboardInterrupt:
        write_text(folder / SUMMARY, to_json({**about, "state": "interrupted"}))
        done = sum(map(is_finished, tasks))
        raise KeyboardInterrupt(
            f"{done} of {len(tasks)} scenes are finished; the same command goes on from there"
        ) from None


def _about_text(about: Mapping[str, Any], tasks: Sequence[SceneTask]) -> dict[str, object]:
    return {
        "scenes": f"{len(tasks)}, seeds {tasks[0].seed} to {tasks[-1].seed}",
        "scenario": f"{tasks[0].scenario_name} (SHA-256 {digest(tasks[0].scenario)[:12]})",
        "riseg_drake": about["riseg_drake"],
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
        "runs": [
            {
                "scene": result.name,
                "seed": result.seed,
                "interactions": result.interactions,
                "end": result.end,
                "failure": result.failure,
                "scores": result.scores[-1].as_dict() if result.scores else None,
            }
            for result in results
        ],
    }


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
    console.print(score_table(rows, first="\nmethod"))
