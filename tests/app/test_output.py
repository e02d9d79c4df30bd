import json

import cv2
import numpy as np
import pytest

from riseg_drake.app.output import RunFolder, Step, stage_figures
from riseg_drake.app.output_folder import OutputError
from riseg_drake.evaluation.scores import FIGURES, score
from riseg_drake.pictures.object_colors import object_colors


def step(number):
    rng = np.random.default_rng(number)
    mask = np.zeros((48, 64), np.uint16)
    mask[10:20, 10:20] = 300
    return Step(
        interaction_step=number,
        time=2.0 * number,
        color=rng.integers(0, 256, (48, 64, 3), np.uint8),
        depth=np.full((48, 64), 0.5, np.float32),
        mask=mask,
        frames=7,
        confidence={300: 0.98765, 7: 0.5},
        untouched=np.where(mask > 0, np.uint16(0), np.uint16(2)),
        untouched_confidence=0.119,
        stage_seconds={"OpticalFlow": [0.010, 0.012, 0.014]},
        ground_truth=mask,
        scores=score(mask, mask),
    )


def read(path):
    return cv2.imread(str(path), cv2.IMREAD_UNCHANGED)


def summary(folder):
    return json.loads((folder / "summary.json").read_text())


def test_a_step_is_written_in_the_form_that_was_promised(tmp_path):
    written = step(0)
    RunFolder(tmp_path / "run", {"seed": 3}).write_step(written)
    folder = tmp_path / "run" / "step_0"
    np.testing.assert_array_equal(read(folder / "color.png"), written.color[..., ::-1])
    np.testing.assert_array_equal(read(folder / "mask.png"), written.mask)
    colored = read(folder / "mask_color.png")[..., ::-1]
    np.testing.assert_array_equal(colored, object_colors(written.mask))
    np.testing.assert_array_equal(read(folder / "untouched.png"), written.untouched)
    np.testing.assert_array_equal(read(folder / "ground_truth.png"), written.mask)
    depth = read(folder / "depth.png")
    assert depth.dtype == np.uint16
    assert (depth == 500).all()
    assert read(folder / "overlay.png").shape == (48, 64, 3)

    content = summary(tmp_path / "run")
    assert content["seed"] == 3
    (entry,) = content["steps"]
    assert tuple(entry["scores"]) == FIGURES
    assert entry["frames"] == 7
    assert entry["objects"] == 1
    assert entry["confidence"] == {"7": 0.5, "300": 0.988}
    assert entry["untouched"] == {"1": 0.119, "2": 0.119}
    assert entry["stages"]["OpticalFlow"] == {"calls": 3, "median_ms": 12.0, "p95_ms": 13.8}


def test_after_every_step_summary_and_folders_agree(tmp_path):
    output = RunFolder(tmp_path, {})
    for number in range(3):
        output.write_step(step(number))
        listed = [entry["step"] for entry in summary(tmp_path)["steps"]]
        assert listed == list(range(number + 1))
        assert sorted(path.name for path in tmp_path.glob("step_*")) == [f"step_{i}" for i in listed]


def test_a_step_that_was_cut_off_is_not_listed_and_not_there(tmp_path, monkeypatch):
    output = RunFolder(tmp_path, {})
    output.write_step(step(0))

    def stop(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("riseg_drake.app.output.draw_masks", stop)
    with pytest.raises(KeyboardInterrupt):
        output.write_step(step(1))
    assert [entry["step"] for entry in summary(tmp_path)["steps"]] == [0]
    assert not (tmp_path / "step_1").exists()


def test_overwriting_replaces_an_earlier_run_and_nothing_else(tmp_path):
    with RunFolder(tmp_path, {}) as output:
        for number in range(3):
            output.write_step(step(number))
    (tmp_path / "notes.txt").write_text("mine")
    RunFolder(tmp_path, {}, overwrite=True).write_step(step(0))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["notes.txt", "step_0", "summary.json"]


def test_a_folder_that_holds_something_else_is_refused(tmp_path):
    (tmp_path / "thesis.tex").write_text("mine")
    with pytest.raises(OutputError, match="not empty and holds no earlier run"):
        RunFolder(tmp_path, {})
    with pytest.raises(OutputError, match="is a file"):
        RunFolder(tmp_path / "thesis.tex", {})


def test_what_json_does_not_have_becomes_null(tmp_path):
    RunFolder(tmp_path, {"figure": float("nan")})
    assert summary(tmp_path)["figure"] is None


def test_stages_that_were_not_called_have_no_figures():
    assert stage_figures({"OpticalFlow": []}) == {}
