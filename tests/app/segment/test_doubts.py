"""A bag is doubted as the folder of the same frames is."""

import json
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("rosbags", reason="rosbags is not installed: pip install 'riseg-drake[bags]'")

from riseg_drake.app.cli import main
from riseg_drake.app.scenario import load_scenario
from riseg_drake.app.segment.doubts import recording_doubts
from riseg_drake.app.segment.recorded_view import recorded_view
from riseg_drake.geometry.se3 import inverse
from riseg_drake.plausibility.check import looked_at
from riseg_drake.recording.layout import RecordedFrame
from riseg_drake.recording.source import SourceOptions
from riseg_drake.recording.source_kinds import opened_source
from tests.plausibility.filmed import hand_held
from tests.recording.made_bags import BagKind, write_bag
from tests.recording.made_recordings import write

MILLIMETRE = np.float32(0.001)


@pytest.fixture(scope="module")
def film():
    return hand_held()


def lines_of(path):
    reader = opened_source(path, SourceOptions())
    lines = recording_doubts(reader, recorded_view(reader, load_scenario(None), None, "camera"))
    # A bag's poses are from its TF, a folder's from its list; all else is said in the same words.
    return [line.replace("TF, camera_color_optical_frame in world", "groundtruth.txt") for line in lines]


def both(tmp_path, frames, k):
    bag = write_bag(tmp_path / "bag", frames, k, BagKind())
    return lines_of(bag), lines_of(write(tmp_path / "folder", frames, k))


def recorded(film, times=1.0, pose=lambda X: X):
    return [
        RecordedFrame(
            frame.sequence / 10,
            frame.color,
            np.rint(frame.depth * times * 1000) * MILLIMETRE,
            pose(frame.X_WC),
        )
        for frame in film
    ]


@pytest.mark.renders
@pytest.mark.parametrize(
    ("case", "words"),
    [
        ({}, []),
        ({"times": 5.0}, ["depth_scale"]),
        ({"pose": inverse}, ["the table does not stand still"]),
    ],
)
def test_a_bag_is_doubted_in_the_words_of_its_folder(tmp_path, film, case, words):
    of_bag, of_folder = both(tmp_path, recorded(film, **case), film[0].intrinsics)
    assert of_bag == of_folder
    for word in words:
        assert any(word in line for line in of_bag)
    assert bool(of_bag) == bool(words)


@pytest.mark.renders
def test_a_bag_without_poses_whose_camera_moves_is_not_believed_to_stand(tmp_path, film):
    frames = [replace(frame, X_WC=None) for frame in recorded(film)]
    bag = write_bag(tmp_path / "bag", frames, film[0].intrinsics, BagKind(poses="nothing"))
    (line,) = lines_of(bag)
    assert line == lines_of(write(tmp_path / "folder", frames, film[0].intrinsics))[0]


@pytest.mark.parametrize("count", [0, 1, 2, 5, 14, 1000])
def test_few_frames_are_read_however_many_there_are(count):
    numbers = looked_at(count)
    assert len(numbers) <= 18
    assert all(0 <= number < count for number in numbers)
    assert (len(numbers) > 0) == (count > 0)


@pytest.mark.renders
@pytest.mark.parametrize("kind", ["folder", "bag"])
@pytest.mark.parametrize("times", [0.1, 0.2, 100.0])
def test_depth_in_a_wrong_unit_is_said_once_whatever_tells_it(tmp_path, film, times, kind):
    frames = recorded(film[:6], times)
    source = (
        write(tmp_path / kind, frames, film[0].intrinsics)
        if kind == "folder"
        else write_bag(tmp_path / kind, frames, film[0].intrinsics, BagKind())
    )
    assert main(["segment", str(source), "--output", str(tmp_path / "out")]) == 0
    said = json.loads((tmp_path / "out" / "summary.json").read_text())["warnings"]
    told = [line for line in said if line.startswith('"depth_scale"') or "the median depth" in line]
    assert len(told) == 1
