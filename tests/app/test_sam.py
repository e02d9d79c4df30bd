"""Sharper outlines in a run, and Segment Anything among the baselines."""

import json
import threading

import cv2
import numpy as np
import pytest

from riseg_drake.app import refinement_block
from riseg_drake.app.bench import sam as sam_bench
from riseg_drake.app.cli import main
from riseg_drake.app.diagram import make_diagram
from riseg_drake.app.run.interactions import Progress, interactions
from riseg_drake.app.scenario import load_scenario
from riseg_drake.evaluation.scores import score
from riseg_drake.learned.prompts import Answer
from riseg_drake.systems.mask_refiner import NO_REFINED_MASK
from riseg_drake.systems.stage_clock import StageClock

LONG = 60.0
"""s; nothing here waits that long, unless something is broken."""


def dilating(color, prompts):
    """Stands in for a model: every mask that it is asked about, one pixel wider."""
    for prompt in prompts:
        wider = cv2.dilate(prompt.mask.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
        yield Answer(wider[None], np.array([0.9]), np.array([1.0]))


def read(path):
    return cv2.imread(str(path), cv2.IMREAD_UNCHANGED)


def with_sam(small_scenario, folder, path, more=""):
    path.write_text(small_scenario.read_text() + f"sam: {{folder: {folder}{more}}}\n")
    return path


@pytest.mark.renders
def test_a_run_leaves_refined_masks_beside_its_own_and_changes_none(small_scenario, tmp_path, monkeypatch):
    monkeypatch.setattr(refinement_block, "load_sam", lambda folder, device: dilating)
    scenario = with_sam(small_scenario, tmp_path, tmp_path / "sam.yaml", ", outlines: {with_mask: true}")
    for name, file in (("with", scenario), ("without", small_scenario)):
        assert main(["run", str(file), "--seed", "1", "--output", str(tmp_path / name)]) == 0
    content = json.loads((tmp_path / "with" / "summary.json").read_text())
    assert [step["step"] for step in content["steps"]] == [0, 1]
    for step in content["steps"]:
        folder = tmp_path / "with" / f"step_{step['step']}"
        mask, refined = read(folder / "mask.png"), read(folder / "refined.png")
        assert mask.tobytes() == read(tmp_path / "without" / folder.name / "mask.png").tobytes()
        assert set(np.unique(refined)) == set(np.unique(mask))
        assert step["refined_scores"] == pytest.approx(
            score(refined, read(folder / "ground_truth.png")).as_dict()
        )
    assert (refined > 0).sum() > (mask > 0).sum() > 0
    assert (refined[mask > 0] > 0).all()


@pytest.mark.renders
def test_a_whole_run_goes_on_to_its_end_while_the_model_is_still_at_its_first_mask(
    small_scenario, tmp_path, monkeypatch
):
    begun, may_end = threading.Event(), threading.Event()

    def slow(frame, mask, segmenter, parameters):
        begun.set()
        assert may_end.wait(LONG)  # it does not end before the run has
        return mask

    monkeypatch.setattr(refinement_block, "load_sam", lambda folder, device: dilating)
    monkeypatch.setattr(refinement_block, "refine_outlines", slow)
    wired = make_diagram(load_scenario(with_sam(small_scenario, tmp_path, tmp_path / "sam.yaml")), seed=1)
    contexts, progress, beside = [], Progress(), []

    def follow(frame, context):
        contexts.append(context)
        if begun.is_set():
            beside.append((frame.sequence, wired.mask(context).max(), wired.refined(context)))

    try:
        steps = list(interactions(wired, StageClock(), progress, 60.0, (follow,)))
        assert begun.wait(LONG)
        assert progress.end
        sequences, ids, refined = zip(*beside, strict=True)
        assert list(sequences) == list(range(sequences[0], sequences[0] + len(sequences)))  # none was left out
        assert len(sequences) > 50
        assert ids[0] == 0 < ids[-1]  # objects were found meanwhile
        assert all(each is NO_REFINED_MASK for each in refined)
    finally:
        may_end.set()  # a worker that waits for ever would keep pytest from ending
    coming = wired.finish_refinement(contexts[-1])
    assert [each.time for each in coming] == [step.time for step in steps]
    np.testing.assert_array_equal(coming[-1].mask, steps[-1].mask)


@pytest.mark.renders
def test_an_evaluation_scores_a_real_model_alone_and_with_our_masks(small_scenario, tmp_path):
    pytest.importorskip("torch", reason="SAM needs torch (pip install 'riseg-drake[sam]')")
    pytest.importorskip("transformers", reason="SAM needs transformers (pip install 'riseg-drake[sam]')")
    from tests.learned.tiny_sam import tiny_sam2

    tiny_sam2().save_pretrained(tmp_path / "model")
    scenario = with_sam(small_scenario, tmp_path / "model", tmp_path / "sam.yaml")
    output = tmp_path / "out"
    command = ["evaluate", "--scenario", str(scenario), "--scenes", "1", "--seed", "1", "--output", str(output)]
    assert main(command) == 0
    assert "SAM" not in json.loads((output / "summary.json").read_text())["methods"]
    before = (output / "scene_000" / "summary.json").read_bytes()

    # The same once more, with two more methods: only these are worked on.
    assert main([*command, "--baseline", "sam", "--masks", f"again={output}"]) == 0
    assert (output / "scene_000" / "summary.json").read_bytes() == before
    methods = json.loads((output / "summary.json").read_text())["methods"]
    assert set(methods) >= {"riseg_drake", "SAM", "riseg_drake + SAM", "again"}
    # Random weights answer nonsense, which is refused.
    assert methods["riseg_drake + SAM"] == methods["riseg_drake"] == methods["again"]
    assert "| SAM | 1 |" in (output / "report.md").read_text()


@pytest.mark.parametrize(
    ("scenario", "says"),
    [
        ("{}", "--baseline sam needs a model"),
        ("sam: {folder: /nowhere}", "/nowhere is no folder"),
    ],
)
def test_without_a_model_the_evaluation_does_not_begin(tmp_path, capsys, scenario, says):
    (tmp_path / "scene.yaml").write_text(scenario)
    arguments = ["--scenario", str(tmp_path / "scene.yaml"), "--output", str(tmp_path / "out")]
    assert main(["evaluate", "--baseline", "sam", *arguments]) == 2
    error = capsys.readouterr().err
    assert says in error
    assert error.count("\n") == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.renders
def test_the_bench_keeps_the_model_at_work_beside_the_frames(small_scenario, tmp_path, monkeypatch, capsys):
    asked = []

    def model(color, prompts):
        asked.append(len(prompts))
        return iter(())

    monkeypatch.setattr(sam_bench, "load_sam", lambda folder, device: model)
    monkeypatch.setattr(sam_bench, "ROUNDS", 1)
    assert main(["bench", "--sam", str(with_sam(small_scenario, tmp_path, tmp_path / "sam.yaml"))]) == 0
    rows = {line.split("  ")[1]: line.split() for line in capsys.readouterr().out.splitlines() if "  " in line}
    frames = int(rows[sam_bench.ALONE][-3])
    assert int(rows[sam_bench.BESIDE][-3]) == frames > 10
    # It answers at once here: an image or two for each frame that it is shown.
    assert set(asked) == {sam_bench.OBJECTS}
    assert int(rows[sam_bench.MODEL][-3]) == len(asked) > frames / 4
