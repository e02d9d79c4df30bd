import errno
import json
import subprocess
import sys
import time
from pathlib import Path

import cv2
import numpy as np
import pytest
from rich.console import Console

from riseg_drake.app.cli import main
from riseg_drake.app.evaluate import scene_work
from riseg_drake.app.evaluate.command import evaluate, scene_tasks
from riseg_drake.app.evaluate.scene_folder import is_finished, read_result
from riseg_drake.app.evaluate.scene_pool import PoolError, cluster_pool, local_pool
from riseg_drake.app.output import RunFolder, Step
from riseg_drake.app.output_folder import OutputError
from riseg_drake.app.scenario import Scenario
from riseg_drake.evaluation.in_motion import InMotion
from riseg_drake.evaluation.scores import score

LAST_STEP = 2
QUIET = Console(quiet=True)


def fake_run(scenario, seed, folder, record=False):
    """Stands in for a run: a square that is found in step 1; seed 3 fails before that, seed 4 at once."""
    folder.note(ran=True)
    ground_truth = np.zeros((48, 64), np.uint16)
    ground_truth[10:30, 10:30] = 1
    for i in range(LAST_STEP):
        if seed == 3 + (i == 0):
            folder.note(state="failed", end="the table broke")
            raise RuntimeError("the table\nbroke")
        mask = ground_truth if i else np.zeros_like(ground_truth)
        color, depth = np.zeros((48, 64, 3), np.uint8), np.full((48, 64), 0.5, np.float32)
        folder.write_step(
            Step(
                i,
                0.1 * i,
                color,
                depth,
                mask,
                1,
                ground_truth=ground_truth,
                scores=score(mask, ground_truth),
                in_motion=InMotion(12, 0.75, 0.5) if i else None,
            )
        )
    folder.note(state="done", end="no push is left", ended="no_path", unsettled_area_m2=0.002)


@pytest.fixture
def scenes_run(monkeypatch):
    """The seeds of the scenes that were run, with a stand-in for the simulation and the baselines."""
    seeds = []

    def run(scenario, seed, folder, record=False):
        seeds.append(seed)
        fake_run(scenario, seed, folder, record)

    def score_baselines(scenario, folder, steps):
        return {
            name: [score(np.eye(4, dtype=int), np.eye(4, dtype=int))] * steps for name in scene_work.BASELINES
        }

    monkeypatch.setattr(scene_work, "run", run)
    monkeypatch.setattr(scene_work, "score_baselines", score_baselines)
    monkeypatch.setattr("riseg_drake.app.evaluate.command.figure_png", lambda *_: b"")  # which takes longest
    return seeds


def tasks(folder, scenes, seed=0, scenario=None):
    return scene_tasks(scenario or Scenario(), "simulation", folder, scenes, seed)


def summary(folder):
    return json.loads((folder / "summary.json").read_text())


def test_scene_k_has_the_seed_s_plus_k_and_a_folder_of_its_own(tmp_path, scenes_run):
    evaluate(tasks(tmp_path, 3, seed=10), local_pool(1), LAST_STEP, QUIET)
    assert scenes_run == [10, 11, 12]
    assert summary(tmp_path / "scene_002")["seed"] == 12
    assert {path.name for path in tmp_path.iterdir()} == {
        *(f"scene_00{k}" for k in range(3)),
        "report.md",
        "report.html",
        "figure.png",
        "summary.json",
    }
    content = summary(tmp_path)
    assert content["state"] == "done"
    assert [step["mean"]["Objects F-measure"] for step in content["methods"]["riseg_drake"]] == [0, 1, 1]


def test_the_summary_says_how_runs_ended_and_how_good_masks_were_in_motion(tmp_path, scenes_run):
    evaluate(tasks(tmp_path, 2), local_pool(1), LAST_STEP, QUIET)
    content = summary(tmp_path)
    assert content["ended"] == {"no_path": 2}
    assert [(run["ended"], run["unsettled_area_m2"]) for run in content["runs"]] == [("no_path", 0.002)] * 2
    assert content["in_motion"]["all"] == {"scenes": 2, "frames": 24, "overlap_f": 0.75, "at_rest_f": 0.5}
    assert content["in_motion"]["interactions"][1] == {"scenes": 0}


def test_what_is_finished_is_not_run_again(tmp_path, scenes_run):
    before = evaluate(tasks(tmp_path, 2), local_pool(1), LAST_STEP, QUIET)
    after = evaluate(tasks(tmp_path, 3), local_pool(1), LAST_STEP, QUIET)
    assert scenes_run == [0, 1, 2]
    assert after[:2] == before


def test_an_interrupted_evaluation_goes_on_where_it_stopped(tmp_path, scenes_run, monkeypatch):
    def interrupted(pool):
        def outcomes(todo):
            yield from pool(todo[:1])
            RunFolder(todo[1].folder, todo[1].settings)  # begun, no more
            raise KeyboardInterrupt

        return outcomes

    with pytest.raises(KeyboardInterrupt, match="1 of 3 scenes are finished; the same command goes on"):
        evaluate(tasks(tmp_path, 3), interrupted(local_pool(1)), LAST_STEP, QUIET)
    assert summary(tmp_path)["state"] == "interrupted"
    assert not (tmp_path / "report.md").exists()
    evaluate(tasks(tmp_path, 3), local_pool(1), LAST_STEP, QUIET)
    assert scenes_run == [0, 1, 2]
    assert summary(tmp_path)["state"] == "done"


def test_a_scene_of_other_settings_is_run_again(tmp_path, scenes_run):
    evaluate(tasks(tmp_path, 2), local_pool(1), LAST_STEP, QUIET)
    content = summary(tmp_path / "scene_001")
    (tmp_path / "scene_001" / "summary.json").write_text(json.dumps({**content, "scenario_sha256": "other"}))
    evaluate(tasks(tmp_path, 2), local_pool(1), LAST_STEP, QUIET)
    assert scenes_run == [0, 1, 1]


def test_the_folder_of_another_evaluation_is_refused(tmp_path, scenes_run):
    evaluate(tasks(tmp_path, 1), local_pool(1), LAST_STEP, QUIET)
    with pytest.raises(OutputError, match="begins with seed 0, not 5"):
        evaluate(tasks(tmp_path, 1, seed=5), local_pool(1), LAST_STEP, QUIET)
    other = Scenario()
    other.station.scene.objects = "/elsewhere"
    with pytest.raises(OutputError, match="other settings"):
        evaluate(tasks(tmp_path, 1, scenario=other), local_pool(1), LAST_STEP, QUIET)
    assert summary(tmp_path)["state"] == "done"


def test_a_folder_that_holds_something_else_is_refused(tmp_path, scenes_run):
    (tmp_path / "thesis.tex").write_text("mine")
    with pytest.raises(OutputError, match="holds no earlier evaluation"):
        evaluate(tasks(tmp_path, 1), local_pool(1), LAST_STEP, QUIET)
    RunFolder(tmp_path / "run", {})
    with pytest.raises(OutputError, match="holds no earlier evaluation"):
        evaluate(tasks(tmp_path / "run", 1), local_pool(1), LAST_STEP, QUIET)
    assert scenes_run == []


def test_a_scene_that_fails_counts_as_what_it_is_and_loses_no_other(tmp_path, scenes_run, capsys):
    results = evaluate(tasks(tmp_path, 3, seed=2), local_pool(1), LAST_STEP, Console(width=200))
    assert [result.failure for result in results] == ["", "the table broke", "the table broke"]
    assert [len(result.scores) for result in results] == [2, 1, 0]
    assert "scene_001 FAILED with seed 3 after interaction 0: the table broke" in capsys.readouterr().out
    last = summary(tmp_path)["methods"]["riseg_drake"][LAST_STEP]["mean"]
    assert last["Objects F-measure"] == pytest.approx(1 / 3)  # found, seen but not found, never seen
    assert last["Objects Precision"] == 1.0
    assert "seed 4: the table broke" in (tmp_path / "report.md").read_text()
    # Next time those two are tried again.
    evaluate(tasks(tmp_path, 3, seed=2), local_pool(1), LAST_STEP, QUIET)
    assert scenes_run == [2, 3, 4, 3, 4]


def work_in_processes(seed_one_dies=""):
    """Work for child processes, which cannot see what a test replaces here.

    That on seed 1 may die before, in or after its run, five times at most.
    """
    run = fake_run

    def work(task):
        import os
        import time

        from riseg_drake.app.evaluate.scene_work import SceneOutcome
        from riseg_drake.app.output import RunFolder
        from riseg_drake.app.scenario import Scenario

        def die(when):
            deaths = task.folder.parent / "deaths"
            if task.seed == 1 and when == seed_one_dies and len(list(deaths.glob("*"))) < 5:
                deaths.mkdir(parents=True, exist_ok=True)
                (deaths / str(os.getpid())).touch()
                time.sleep(0.2)
                os._exit(9)

        die("before")
        folder = RunFolder(task.folder, task.settings, overwrite=True)
        die("in")
        run(Scenario(), task.seed, folder)
        die("after")
        return SceneOutcome(task, "", 0.0)

    return work


@pytest.mark.renders
def test_processes_leave_the_same_as_one(tmp_path):
    for jobs in (1, 2):
        todo = tasks(tmp_path / f"jobs_{jobs}", 3)
        outcomes = list(local_pool(jobs, work_in_processes())(todo))
        assert sorted(outcome.task.seed for outcome in outcomes) == [0, 1, 2]
    for k in range(3):
        one, two = (tmp_path / f"jobs_{jobs}" / f"scene_00{k}" / "step_1" / "mask.png" for jobs in (1, 2))
        assert one.read_bytes() == two.read_bytes()


@pytest.mark.renders
@pytest.mark.parametrize("when", ["before", "in", "after"])
def test_a_process_that_dies_takes_no_other_scene_with_it_and_is_not_tried_for_ever(tmp_path, when):
    todo = tasks(tmp_path, 3)
    outcomes = list(local_pool(2, work_in_processes(seed_one_dies=when))(todo))
    failures = {outcome.task.seed: outcome.failure for outcome in outcomes}
    assert sorted(failures) == [0, 1, 2]
    assert not failures[0]
    assert not failures[2]
    assert "its process died" in failures[1]
    assert "its process died" in read_result(todo[1]).failure
    assert not is_finished(todo[1])


@pytest.mark.renders
def test_processes_end_when_their_parent_is_killed(tmp_path):
    parent = subprocess.Popen(
        [sys.executable, "-c", KILLED_PARENT.format(folder=str(tmp_path))], stdin=subprocess.DEVNULL
    )
    while len(list(tmp_path.glob("pid_*"))) < 2:
        assert parent.poll() is None
        time.sleep(0.02)
    children = [int(path.name.removeprefix("pid_")) for path in tmp_path.glob("pid_*")]
    parent.kill()
    parent.wait()
    deadline = time.monotonic() + 10
    while any(is_alive(child) for child in children):
        assert time.monotonic() < deadline, "a child is still there"
        time.sleep(0.02)


KILLED_PARENT = """
import os, time
from pathlib import Path
from rich.console import Console
from riseg_drake.app.evaluate.command import scene_tasks
from riseg_drake.app.scenario import Scenario
from riseg_drake.app.evaluate.scene_pool import local_pool

def work(task):
    (Path({folder!r}) / f"pid_{{os.getpid()}}").touch()
    time.sleep(600)

list(local_pool(2, work)(scene_tasks(Scenario(), "simulation", Path({folder!r}) / "out", 2, 0)))
"""


def is_alive(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


def test_a_second_evaluation_in_the_same_folder_is_refused(tmp_path, scenes_run, monkeypatch):
    monkeypatch.setattr("riseg_drake.app.output_folder.PATIENCE", 0.0)

    def second(todo):
        with pytest.raises(OutputError, match="another riseg is writing to"):
            evaluate(tasks(tmp_path, 2), local_pool(1), LAST_STEP, QUIET)
        yield from local_pool(1)(todo)

    evaluate(tasks(tmp_path, 2), second, LAST_STEP, QUIET)
    assert scenes_run == [0, 1]


def test_overwriting_begins_an_evaluation_anew(tmp_path, scenes_run):
    evaluate(tasks(tmp_path, 2), local_pool(1), LAST_STEP, QUIET)
    evaluate(tasks(tmp_path, 1, seed=5), local_pool(1), LAST_STEP, QUIET, overwrite=True)
    assert scenes_run == [0, 1, 5]
    assert not (tmp_path / "scene_001").exists()


@pytest.mark.parametrize(
    "damage",
    [
        {"steps": [{"step": 0}]},
        {"steps": 3},
        {"steps": [{"scores": {}}]},
        {"unsettled_area_m2": "much"},
        {"unsettled_area_m2": 10**400},
    ],
)
def test_a_scene_whose_results_are_damaged_is_done_anew(tmp_path, scenes_run, damage):
    evaluate(tasks(tmp_path, 1), local_pool(1), LAST_STEP, QUIET)
    content = summary(tmp_path / "scene_000")
    (tmp_path / "scene_000" / "summary.json").write_text(json.dumps({**content, **damage}))
    assert "damaged" in read_result(tasks(tmp_path, 1)[0]).failure
    evaluate(tasks(tmp_path, 1), local_pool(1), LAST_STEP, QUIET)
    assert scenes_run == [0, 0]


def test_a_full_disk_ends_an_evaluation_and_is_no_failure_of_its_scenes(tmp_path, scenes_run, monkeypatch):
    def full(scenario, seed, folder, record=False):
        raise OSError(errno.ENOSPC, "No space left on device", "mask.png")

    monkeypatch.setattr(scene_work, "run", full)
    with pytest.raises(OutputError, match="No space left on device"):
        evaluate(tasks(tmp_path, 3), local_pool(1), LAST_STEP, QUIET)
    assert not (tmp_path / "report.md").exists()


def test_without_shared_memory_several_jobs_are_refused_in_one_line(tmp_path, monkeypatch):
    def no_semaphores(*_, **__):
        raise PermissionError(errno.EACCES, "Permission denied")

    monkeypatch.setattr("riseg_drake.app.evaluate.scene_pool.Parallel", no_semaphores)
    with pytest.raises(PoolError, match=r"is /dev/shm usable.*--jobs 1 needs none"):
        list(local_pool(2)(tasks(tmp_path, 2)))


@pytest.mark.renders
@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["evaluate", "--scenes", "2", "--jobs", "2", "--output", "out"], "is /dev/shm usable?"),
        (["run", "nowhere.yaml", "--output", "out"], "nowhere.yaml is not there"),
    ],
)
def test_where_nothing_can_be_shared_several_jobs_are_refused_and_nobody_else_minds(tmp_path, words, says):
    command = [sys.executable, "-c", NOTHING_SHARED, *words]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert says in done.stderr
    assert not (tmp_path / "out").exists()


NOTHING_SHARED = """
import _multiprocessing, errno, sys

class SemLock(_multiprocessing.SemLock):
    def __new__(cls, *_, **__):
        raise OSError(errno.EROFS, "Read-only file system")

_multiprocessing.SemLock = SemLock
from riseg_drake.app.cli import main
sys.exit(main(sys.argv[1:]))
"""


@pytest.mark.renders
def test_a_dask_cluster_sends_back_what_a_scene_leaves(tmp_path):
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None
    ) as cluster:
        todo = tasks(tmp_path / "cluster", 2)
        outcomes = list(cluster_pool(cluster.scheduler_address, work_in_processes())(todo))
    assert {outcome.task for outcome in outcomes} == set(todo)
    list(local_pool(1, work_in_processes())(tasks(tmp_path / "here", 2)))
    for path in (tmp_path / "here").rglob("*.png"):
        there = tmp_path / "cluster" / path.relative_to(tmp_path / "here")
        assert there.read_bytes() == path.read_bytes()
    assert len(read_result(todo[1]).scores) == LAST_STEP


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--scenes", "0"], "'0' is not a whole number from 1 up"),
        (["--jobs", "two"], "'two' is not a whole number from 1 up"),
        (["--objects", "nowhere"], "nowhere is not a folder"),
        (["--scenario", "nowhere.yaml"], "nowhere.yaml is not there"),
        (["--dask", "tcp://127.0.0.1:1"], "ask"),  # not installed, or nobody answers
    ],
)
def test_a_mistake_is_answered_in_one_line(arguments, says, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    try:
        code = main(["evaluate", *arguments])
    except SystemExit as stop:
        code = stop.code
    assert code == 2
    error = capsys.readouterr().err
    assert says in error
    assert error.count("\n") == 1


@pytest.mark.renders
def test_scenes_do_not_depend_on_the_processes_that_run_them(small_scenario, tmp_path):
    common = ["evaluate", "--scenario", str(small_scenario), "--seed", "1"]
    for jobs, scenes in ((1, 1), (2, 2)):
        folder = tmp_path / f"jobs_{jobs}"
        options = ["--jobs", str(jobs), "--scenes", str(scenes), "--output", str(folder)]
        assert main([*common, *options]) == 0
        assert set(summary(folder)["methods"]) == {"riseg_drake", *scene_work.BASELINES}
        assert summary(folder)["disturbance"]["all"]["pushed_mean_m"] > 0.005
    for name in ("color.png", "depth.png", "mask.png", "ground_truth.png"):
        one, two = (tmp_path / f"jobs_{jobs}" / "scene_000" / "step_1" / name for jobs in (1, 2))
        assert one.read_bytes() == two.read_bytes(), name
    assert cv2.imread(str(tmp_path / "jobs_2" / "scene_000" / "step_1" / "mask.png"), -1).any()
