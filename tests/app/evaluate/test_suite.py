import json
import re

import numpy as np
import pytest
from rich.console import Console

from riseg_drake.app.cli import main
from riseg_drake.app.evaluate import scene_work
from riseg_drake.app.evaluate.ablation import Ablation, versions
from riseg_drake.app.evaluate.scene_pool import local_pool
from riseg_drake.app.evaluate.suite import evaluate_suite, find_suite, kind_tasks
from riseg_drake.app.output import RunFolder, Step
from riseg_drake.app.output_folder import OutputError
from riseg_drake.app.scenario_file import ScenarioError
from riseg_drake.evaluation.baselines import BASELINES
from riseg_drake.evaluation.in_motion import InMotion
from riseg_drake.evaluation.scores import score
from riseg_drake.stations.object_models import find_models, resolve

QUIET = Console(quiet=True)
SQUARE = np.zeros((48, 64), np.uint16)
SQUARE[10:30, 10:30] = 1


@pytest.fixture
def runs(monkeypatch):
    """The runs that were made, (scenario, seed), with stand-ins: ours finds all, baselines half of it."""
    made = []

    def run(scenario, seed, folder, record=False):
        made.append((folder.path.parent.name, seed))
        color, depth = np.zeros((48, 64, 3), np.uint8), np.full((48, 64), 0.5, np.float32)
        for i in range(2):
            mask = SQUARE if i else np.zeros_like(SQUARE)
            scores = score(mask, SQUARE)
            moved = InMotion(10, 0.7 if seed else 0.5, 1.0) if i else None
            step = Step(i, 0.1 * i, color, depth, mask, 1, ground_truth=SQUARE, scores=scores, in_motion=moved)
            folder.write_step(step)
        folder.note(state="done", ended="enough_interactions" if seed else "nothing_left")

    def score_baselines(scenario, folder, steps):
        half = SQUARE.copy()
        half[20:] = 0
        return {name: [score(half, SQUARE), score(SQUARE, SQUARE)] for name in BASELINES}

    monkeypatch.setattr(scene_work, "run", run)
    monkeypatch.setattr(scene_work, "score_baselines", score_baselines)
    monkeypatch.setattr("riseg_drake.app.evaluate.command.figure_png", lambda *_: b"")  # which takes longest
    return made


@pytest.fixture
def suite(tmp_path):
    """A suite of two kinds."""
    folder = tmp_path / "mine"
    folder.mkdir()
    (folder / "2_late.yaml").write_text("arm: {most_interactions: 1}\n")
    (folder / "1_early_bird.yaml").write_text("arm: {most_interactions: 3}\n")
    return folder


def tasks(suite, output, scenes=2, seed=0):
    return {kind: kind_tasks(kind, output, scenes, seed) for kind in find_suite(str(suite))}


def test_a_kind_is_a_file_in_the_order_of_names_and_called_without_its_number(suite):
    assert [kind.name for kind in find_suite(str(suite))] == ["early bird", "late"]


def test_the_table_has_a_row_a_kind_beside_the_baselines_on_first_and_last_picture(suite, tmp_path, runs):
    output = tmp_path / "out"
    evaluate_suite(tasks(suite, output), output, local_pool(1), QUIET)
    assert runs == [(kind, seed) for kind in ("1_early_bird", "2_late") for seed in (0, 1)]
    half = 100 * score(np.where(np.arange(48)[:, None] < 20, SQUARE, 0), SQUARE).overlap_f
    row = next(line for line in (output / "report.md").read_text().splitlines() if "[late]" in line)
    cells = [cell.strip() for cell in row.strip("|").split("|")]
    assert cells[1:6] == ["2", "1.0 of 1", "100.0", "100.0", "100.0"]
    assert cells[6:10] == [f"{half:.1f}", "100.0"] * 2
    assert set(cells[10].split("; ")) == {"1 nothing_left", "1 enough_interactions"}
    moved = next(line for line in (output / "report.md").read_text().splitlines() if "| late " in line)
    assert [cell.strip() for cell in moved.split("|")[2:4]] == ["60.0", "100.0"], "means over the scenes"
    content = json.loads((output / "summary.json").read_text())
    assert content["state"] == "done"
    assert list(content["kinds"]) == ["1_early_bird", "2_late"]
    assert content["kinds"]["2_late"]["in_motion"]["overlap_f"] == pytest.approx(0.6)
    assert (output / "2_late" / "report.md").exists(), "each kind has its whole report, too"
    assert "<h1>A suite of 4 scenes of 2 kinds</h1>" in (output / "report.html").read_text()


def test_an_interrupted_suite_goes_on_where_it_stopped(suite, tmp_path, runs):
    output = tmp_path / "out"

    def interrupted(todo):
        yield from local_pool(1)(todo[:3])
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt, match="3 of 4 scenes are finished; the same command goes on"):
        evaluate_suite(tasks(suite, output), output, interrupted, QUIET)
    evaluate_suite(tasks(suite, output), output, local_pool(1), QUIET)
    assert len(runs) == 4


def test_an_ablation_segments_the_recorded_scenes_of_every_kind_again(suite, tmp_path, runs, monkeypatch):
    switched = []

    def ablate(scenario, seed, recording, steps):
        switched.append((recording.parent.parent.name, seed, [step.time for step in steps]))
        half = [score(np.zeros_like(SQUARE), SQUARE), score(np.where(np.arange(64) < 20, SQUARE, 0), SQUARE)]
        figures = dict.fromkeys(versions(), half)
        return Ablation(figures, {name: [InMotion(10, 0.25, 0.5)] for name in versions()}, {})

    monkeypatch.setattr(scene_work, "ablate", ablate)
    output = tmp_path / "out"
    kinds = {kind: kind_tasks(kind, output, 1, 0, ablation=True) for kind in find_suite(str(suite))}
    for _ in range(2):  # the second time nothing is left to do
        evaluate_suite(kinds, output, local_pool(1), QUIET)
        assert runs == [("1_early_bird", 0), ("2_late", 0)]
        assert switched == [("1_early_bird", 0, [0.0, 0.1]), ("2_late", 0, [0.0, 0.1])]
    row = next(
        line for line in (output / "report.md").read_text().splitlines() if line.startswith("| no memory")
    )
    # Ours found all of it, and had 50 in motion.
    cells = [cell.strip() for cell in row.strip("| ").split("|")]
    assert [cells[3], *cells[8:]] == ["66.7", "-33.3 ± 0.0", "25.0", "-25.0 ± 0.0"]
    page = (output / "report.html").read_text()
    assert "<h2>What each part is worth, over all kinds, in percent</h2>" in page
    of_switch = re.search(r"<tr><td>no memory.*?</tr>", page, re.DOTALL)[0]
    assert re.findall("<td>(.*?)</td>", of_switch)[1:] == cells[1:]
    of_kind = (output / "2_late" / "report.html").read_text()
    assert "<h2>What each part is worth, in percent</h2>" in of_kind
    figures = json.loads((output / "summary.json").read_text())["ablation"]
    assert list(figures) == ["riseg_drake", *versions()]
    assert figures["riseg_drake"]["in_motion_f"] == 0.5
    assert figures["riseg_drake"]["against_ours"] is None
    (name,) = (name for name in figures if name.startswith("no memory"))
    assert figures[name]["scores"]["Objects F-measure"] == pytest.approx(2 / 3)
    assert figures[name]["against_ours"] == {"mean": pytest.approx(-1 / 3), "standard_error": 0}
    assert figures[name]["in_motion_against_ours"] == {"mean": -0.25, "standard_error": 0}


def test_the_folder_of_something_else_is_refused(suite, tmp_path, runs):
    output = tmp_path / "out"
    evaluate_suite(tasks(suite, output), output, local_pool(1), QUIET)
    with pytest.raises(OutputError, match="no earlier run of this suite with this seed"):
        evaluate_suite(tasks(suite, output, seed=7), output, local_pool(1), QUIET)
    RunFolder(tmp_path / "run", {})
    with pytest.raises(OutputError, match="not empty"):
        evaluate_suite(tasks(suite, tmp_path / "run"), tmp_path / "run", local_pool(1), QUIET)


def test_an_unknown_suite_says_which_there_are(capsys, tmp_path):
    with pytest.raises(ScenarioError, match=r"neither a built-in suite \(.*clutter.*\)"):
        find_suite("clatter")
    assert main(["evaluate", "--suite", str(tmp_path)]) == 2


def test_clutter_has_nine_kinds_with_the_layouts_and_pushes_that_they_are_known_by():
    kinds = {kind.name: kind.scenario for kind in find_suite("clutter")}
    assert {name: scenario.arm.most_interactions for name, scenario in kinds.items()} == {
        "spread": 5,
        "packed": 6,
        "crowd": 10,
        "pile": 8,
        "white on white": 5,
        "black": 5,
        "wood hard light": 5,
        "low": 5,
        "view at 45 degrees": 5,
    }
    for name in ("packed", "crowd", "pile"):
        assert kinds[name].station.scene.layout == name
    for scenario in kinds.values():
        scene = scenario.station.scene
        if scene.names:
            there_are = {path.stem for folder in scene.objects for path in resolve(folder).glob("*/*.sdf")}
            assert len(there_are & set(scene.names)) == len(scene.names) >= 6
    low = kinds["low"].station.scene
    for model in find_models(low.objects, low.names):
        assert 0.0049 <= np.ptp(model.corners[:, 2]) <= 0.0091
    assert re.fullmatch(r"0\.785\d*", f"{kinds['view at 45 degrees'].station.observe_pitch}")


@pytest.mark.parametrize(
    ("arguments", "refused"),
    [
        (["--suite", "clutter", "--objects", "my_models"], "--objects does not go with --suite clutter"),
        (["--suite", "clutter", "--scenario", "my.yaml"], "--scenario does not go with --suite clutter"),
        (["--suite", "films", "--ablation"], "--ablation does not go with --suite films"),
        (["--suite", "films", "--masks", "a=b"], "--masks does not go with --suite films"),
        (["--recordings", "my_films"], "--recordings does not go with an evaluation without --suite films"),
    ],
)
def test_options_that_would_do_nothing_are_refused(arguments, refused, capsys):
    assert main(["evaluate", *arguments]) == 2
    assert refused in " ".join(capsys.readouterr().err.split())
