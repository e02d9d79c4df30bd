"""`riseg evaluate --suite`: scenes of several kinds, one row of a table for each kind.

A suite is a folder of scenarios, one YAML file a kind, in the order of their names; `1_spread.yaml` is the
kind "spread". The built-in suites are in `riseg_drake/diagrams/suites`.

out/suite_clutter_seed_100/
    report.md  summary.json      a row a kind
    report.html                  the same, with the worst scene of each, in one page to send round
    1_spread/                    report.md  figure.png  scene_000/ ... as `riseg evaluate` leaves them
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.metadata import version
from importlib.resources import files
from pathlib import Path
from typing import Any

from rich.console import Console

from riseg_drake.app.evaluate.command import REPORT, EvaluationError, interruption_told, scene_tasks
from riseg_drake.app.evaluate.page import evaluation_page
from riseg_drake.app.evaluate.progress import EvaluationProgress
from riseg_drake.app.evaluate.scene_folder import SceneTask, digest, is_finished, read_result
from riseg_drake.app.evaluate.scene_pool import Pool, pool_for
from riseg_drake.app.evaluate.scene_work import SceneOutcome
from riseg_drake.app.evaluate.suite_page import suite_page
from riseg_drake.app.output_folder import OutputFolder
from riseg_drake.app.report_page import REPORT as PAGE
from riseg_drake.app.scenario import Scenario, load_scenario
from riseg_drake.app.scenario_file import ScenarioError
from riseg_drake.app.tables import score_table
from riseg_drake.evaluation.ablation_report import ablation_figures
from riseg_drake.evaluation.figure import figure_png
from riseg_drake.evaluation.report import FIGURE_FILE, report_text
from riseg_drake.evaluation.scene_result import SceneResult
from riseg_drake.evaluation.step_means import step_means
from riseg_drake.evaluation.suite_report import KindResult, of_all_kinds, suite_figures, suite_text
from riseg_drake.recording.whole_file import write_bytes, write_text

SCENES = 5
"""Of each kind, where nothing else is asked for."""


@dataclass(frozen=True, eq=False)
class Kind:
    """One kind of scenes."""

    folder: str
    """The file's name without its ending, and the name of the folder of results."""
    scenario: Scenario

    @property
    def name(self) -> str:
        """As the table has it: without the number that orders it."""
        return re.sub(r"^\d+_", "", self.folder).replace("_", " ")


@dataclass(frozen=True)
class SuiteRequest:
    """Which suite is to be run, and how."""

    suite: str
    """The name of a built-in one, or a folder of scenarios."""
    scenes: int = SCENES
    """Of each kind."""
    seed: int = 0
    """Of the first scene of each kind; the others follow."""
    jobs: int = 1
    """Scenes at a time."""
    dask: str | None = None
    """Address of a Dask scheduler that does them, or None."""
    output: Path | None = None
    """Folder (out/suite_NAME_seed_S)."""
    ablation: bool = False
    """Whether each recording is segmented again with parts of the algorithm switched off."""
    overwrite: bool = False
    """Whether an earlier run there is removed first."""


def suite_command(request: SuiteRequest, console: Console) -> None:
    """Run what is missing of a suite, then write its table. Raises EvaluationError where every scene failed."""
    kinds = find_suite(request.suite)
    folder = request.output or Path("out") / f"suite_{Path(request.suite).name}_seed_{request.seed}"
    tasks = {kind: kind_tasks(kind, folder, request.scenes, request.seed, request.ablation) for kind in kinds}
    pool = pool_for(request.jobs, request.dask)
    results = evaluate_suite(tasks, folder, pool, console, request.overwrite)
    rows = [(each.name, step_means([s.scores for s in each.scenes], each.last_step)[-1]) for each in results]
    console.print("\nafter the last interaction, means over the scenes of each kind, in percent")
    console.print(score_table(rows, first="\nkind"))
    console.print(f"report in {folder / REPORT}")
    console.print(f"to look at: {folder / PAGE}", highlight=False, soft_wrap=True)
    failures = [scene.failure for each in results for scene in each.scenes]
    if all(failures):
        raise EvaluationError(f"every scene failed; the first: {failures[0]}")


def find_suite(name_or_folder: str) -> list[Kind]:
    """The kinds of a built-in suite, or of a folder of scenarios. Raises ScenarioError."""
    built_in = Path(str(files("riseg_drake.diagrams"))) / "suites"
    folder = built_in / name_or_folder
    if not folder.is_dir() or Path(name_or_folder).name != name_or_folder:
        folder = Path(name_or_folder).expanduser()
    paths = sorted(folder.glob("*.yaml"))
    if not paths:
        known = ", ".join([*sorted(path.name for path in built_in.iterdir() if path.is_dir()), "films"])
        raise ScenarioError(
            f"--suite {name_or_folder}: neither a built-in suite ({known}) nor a folder of scenarios (*.yaml)"
        )
    kinds = [Kind(path.stem, load_scenario(path)) for path in paths]
    for kind in kinds:
        _ = kind.scenario.simulated  # says so where it is not
    return kinds


def evaluate_suite(
    tasks: Mapping[Kind, Sequence[SceneTask]],
    path: Path,
    pool: Pool,
    console: Console,
    overwrite: bool = False,
) -> list[KindResult]:
    """Work on the scenes of all kinds that are not finished yet, and write the table.

    All kinds share the pool, so that no process waits for the last scene of a kind. With `overwrite` an earlier
    run of the suite is removed first. Raises OutputError if the folder belongs to something else;
    KeyboardInterrupt says how far it came.
    """
    every = [task for group in tasks.values() for task in group]
    with _claimed(path, tasks, overwrite) as folder:
        todo = [task for task in every if not is_finished(task)]
        outcomes: dict[Path, SceneOutcome] = {}
        before = f", {len(every) - len(todo)} finished before" if len(todo) < len(every) else ""
        console.print(f"{len(tasks)} kinds, {len(every)} scenes{before}; results in {path}")
        with (
            interruption_told(folder, every),
            EvaluationProgress(len(every), len(every) - len(todo), console) as progress,
        ):
            for outcome in pool(todo):
                outcomes[outcome.task.folder] = outcome
                progress.tell(_named(outcome), outcome.seconds)
        settings = _about_text(folder.summary, tasks)
        with folder.writing():
            results = [_of_kind(kind, group, outcomes, settings) for kind, group in tasks.items()]
            write_text(path / REPORT, suite_text(results, settings))
            write_text(path / PAGE, suite_page(results, path, settings))
        ablation = ablation_figures(*of_all_kinds(results))
        folder.note(state="done", kinds=suite_figures(results), ablation=ablation)
    return results


def kind_tasks(kind: Kind, folder: Path, scenes: int, seed: int, ablation: bool = False) -> list[SceneTask]:
    """The scenes of a kind: scene k has the seed `seed + k`; `folder` is the suite's."""
    return scene_tasks(kind.scenario, kind.folder, folder / kind.folder, scenes, seed, ablation)


def _of_kind(
    kind: Kind, tasks: Sequence[SceneTask], outcomes: Mapping[Path, SceneOutcome], about: Mapping[str, object]
) -> KindResult:
    """The scenes of a kind, with a whole report of their own in its folder."""
    failures = {path: outcome.failure for path, outcome in outcomes.items()}
    scenes = [read_result(task, failures.get(task.folder, "")) for task in tasks]
    last_step = kind.scenario.arm.most_interactions
    folder = tasks[0].folder.parent
    write_text(folder / REPORT, report_text(scenes, about, last_step))
    write_bytes(folder / FIGURE_FILE, figure_png(scenes, last_step))
    write_text(folder / PAGE, evaluation_page(scenes, tasks, {}, last_step))
    return KindResult(kind.name, kind.folder, scenes, last_step)


def _named(outcome: SceneOutcome) -> SceneResult:
    """A result whose name says its kind, too."""
    result = read_result(outcome.task, outcome.failure)
    return replace(result, name=f"{outcome.task.scenario_name} {result.name}")


def _claimed(folder: Path, tasks: Mapping[Kind, Sequence[SceneTask]], overwrite: bool) -> OutputFolder:
    """The suite's folder, new or to be gone on with. Raises OutputError."""
    kinds = {kind.folder: digest(group[0].scenario) for kind, group in tasks.items()}
    settings = {
        "seed": next(iter(tasks.values()))[0].seed,
        "kinds_sha256": kinds,
    }
    about = {
        "suite": settings,
        "scenes": sum(map(len, tasks.values())),
        "riseg_drake": version("riseg-drake"),
        "state": "running",
    }
    parts = "|".join(map(re.escape, [REPORT, PAGE, *kinds]))

    def goes_on(earlier: Mapping[str, Any]) -> str:
        return "" if earlier.get("suite") == settings else "no earlier run of this suite with this seed"

    return OutputFolder(folder, "evaluate", parts, about, overwrite=overwrite, goes_on=goes_on)


def _about_text(about: Mapping[str, Any], tasks: Mapping[Kind, Sequence[SceneTask]]) -> dict[str, object]:
    group = next(iter(tasks.values()))
    return {
        "scenes of each kind": f"{len(group)}, seeds {group[0].seed} to {group[-1].seed}",
        "riseg_drake": about["riseg_drake"],
    }
