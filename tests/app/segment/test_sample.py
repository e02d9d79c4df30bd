import json
import shutil

import pytest

from riseg_drake.app.cli import main
from riseg_drake.app.segment.command import SAMPLE
from riseg_drake.recording.reader import RecordingReader

LARGEST = 3_000_000
"""Bytes, which every installation carries."""


def test_the_sample_is_small_and_a_whole_recording_with_labels():
    assert sum(path.stat().st_size for path in SAMPLE.rglob("*") if path.is_file()) < LARGEST
    reader = RecordingReader(SAMPLE)
    frames = list(reader)
    assert len(frames) == len(reader) > 50
    assert reader.left_out == []
    assert all(frame.labels is not None and frame.position is not None for frame in frames)
    assert set(frames[0].labels.ravel().tolist()) == {0, 1, 2, 3}


@pytest.mark.renders
def test_without_a_recording_the_three_toys_of_the_sample_are_found(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["segment"]) == 0
    output = tmp_path / "out" / "segment_sample"
    summary = json.loads((output / "summary.json").read_text())
    assert (summary["state"], summary["left_out"], summary["warnings"]) == ("done", [], [])
    last = summary["scores_last"]
    assert (last["obj_gt"], last["obj_detected_075"], last["obj_detected"]) == (3, 3, 3)
    # Which files to look at is said, and they are there.
    said = capsys.readouterr().out.splitlines()[-1].removeprefix("to look at: ").split(", ")
    assert all((tmp_path / name).is_file() for name in said)
    assert len(said) == 2


def test_labels_of_a_jpeg_are_pngs_of_its_name(tmp_path):
    shutil.copytree(SAMPLE, tmp_path / "sample")
    (tmp_path / "sample" / "label" / "000000.png").unlink()
    first, second, *_ = RecordingReader(tmp_path / "sample")
    assert first.labels is None
    assert second.labels is not None
