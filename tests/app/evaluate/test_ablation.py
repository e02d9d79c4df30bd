import json
from dataclasses import asdict
from functools import reduce
from pathlib import Path

import cv2
import numpy as np
import pytest

from riseg_drake.app.cli import main
from riseg_drake.app.evaluate import ablation
from riseg_drake.app.evaluate.ablation import (
    AS_IN_THE_PAPER,
    LITERAL,
    LITERAL_STEPS,
    RecordedStep,
    ablate,
    switched,
    versions,
)
from riseg_drake.app.scenario import Scenario, load_scenario
from riseg_drake.app.segment.replay import Replay
from riseg_drake.app.segmentation_block import panda_view
from riseg_drake.recording.layout import RecordedFrame, RecordingError
from riseg_drake.recording.reader import RecordingReader
from riseg_drake.robot.kinematics import PandaKinematics


def value(scenario, path):
    return reduce(getattr, path.split("."), scenario)


@pytest.mark.parametrize("name", versions())
def test_a_switch_changes_what_this_version_does(name):
    scenario, switch = Scenario(), versions()[name]
    for path, other in switch.items():
        assert value(scenario, path) != other
        assert type(value(scenario, path)) is type(other)
        assert value(switched(scenario, switch), path) == other


def test_a_switched_scenario_is_a_copy():
    scenario = Scenario()
    switched(scenario, versions()[LITERAL])
    assert scenario.bfif.frames.kind == "patches"
    assert scenario.segment.method == "evidence"


def test_the_literal_paper_has_every_switch_at_every_time_step():
    lines = set().union(*(switch.items() for switch in AS_IN_THE_PAPER.values()))
    assert set(versions()[LITERAL].items()) == lines
    for step in LITERAL_STEPS:
        assert set(versions()[f"{LITERAL}, {step:g} s"].items()) == lines | {("frame_pair.step", step)}


def test_a_switch_that_does_not_exist_is_an_error():
    with pytest.raises(ValueError, match=r"no key 'bfif\.frame'"):
        switched(Scenario(), {"bfif.frame": 1})


@pytest.fixture(scope="module")
def recorded(small_scenario, tmp_path_factory):
    folder = tmp_path_factory.mktemp("recorded")
    assert main(["run", str(small_scenario), "--seed", "1", "--record", "--output", str(folder)]) == 0
    return folder


def steps(folder):
    return json.loads((folder / "summary.json").read_text())["steps"]


@pytest.mark.renders
def test_a_replay_gives_the_masks_of_the_run_itself(recorded, small_scenario):
    scenario = load_scenario(small_scenario)
    replay = Replay(scenario, panda_view(scenario, PandaKinematics(scenario.station.panda)), seed=1)
    masks = {round(f.time, 6): replay.mask_after(f).copy() for f in RecordingReader(recorded / "recording")}
    for step in steps(recorded):
        written = cv2.imread(str(recorded / f"step_{step['step']}" / "mask.png"), cv2.IMREAD_UNCHANGED)
        np.testing.assert_array_equal(masks[step["time_s"]], written)
    assert written.any()


def ablated(folder, scenario_file, switch, wanted=None):
    """What becomes of the recorded run with one switch; of all its steps, if none are named."""
    wanted = wanted or [RecordedStep.from_summary(step) for step in steps(folder)]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ablation, "versions", lambda: {"switched": switch})
        return ablate(load_scenario(scenario_file), 1, folder / "recording", wanted)


@pytest.fixture(scope="module")
def as_it_is(recorded, small_scenario):
    return ablated(recorded, small_scenario, {})


@pytest.mark.renders
def test_each_version_is_scored_at_the_steps_of_the_run(as_it_is, recorded, small_scenario):
    own = [step["scores"] for step in steps(recorded)]
    assert [scores.as_dict() for scores in as_it_is.scores["switched"]] == [pytest.approx(each) for each in own]
    with pytest.raises(RecordingError, match=r"no frame at 1000\.0 s"):
        ablated(recorded, small_scenario, {}, [RecordedStep(1000.0)])


@pytest.mark.renders
def test_what_moved_is_scored_in_the_same_frames_as_in_the_run(as_it_is, recorded):
    own = [step.get("in_motion") for step in steps(recorded)[1:]]
    assert any(own)
    assert [each and asdict(each) for each in as_it_is.in_motion["switched"]] == [
        each and pytest.approx(each) for each in own
    ]


def test_each_interaction_has_its_own_frames_in_motion(small_scenario, monkeypatch):
    # Frames 0, 3 and 5 are at rest; an object of ten columns moves in frames 1 and 2, in 2 half of it is found.
    labels = np.zeros((10, 20), np.uint16)
    labels[:, 5:15] = 1
    found = [10, 10, 5, 10, 5, 8]

    def frame(number):
        color, depth = np.zeros((10, 20, 3), np.uint8), np.ones((10, 20), np.float32)
        return RecordedFrame(number / 15, color, depth, labels=labels)

    class Stub:
        def __init__(self, *_):
            pass

        def mask_after(self, frame):
            return np.where(np.arange(20) < 5 + found[round(frame.time * 15)], labels, 0)

    monkeypatch.setattr(ablation, "Replay", Stub)
    monkeypatch.setattr(ablation, "RecordingReader", lambda _: [frame(number) for number in range(6)])
    wanted = [
        RecordedStep(0.0),
        RecordedStep(3 / 15, {1 / 15: [1], 2 / 15: [1]}),
        RecordedStep(5 / 15, {4 / 15: [1]}),
    ]
    result = ablated(Path("recorded"), small_scenario, {}, wanted)
    # P = 1: half of it has F 2 / 3, eight tenths 16 / 18.
    first, second = result.in_motion["switched"]
    assert (first.frames, first.overlap_f, first.at_rest_f) == (2, pytest.approx(5 / 6), 1.0)
    assert (second.frames, second.overlap_f, second.at_rest_f) == (
        1,
        pytest.approx(2 / 3),
        pytest.approx(16 / 18),
    )
    assert [scores.overlap_f for scores in result.scores["switched"]] == [1.0, 1.0, pytest.approx(16 / 18)]


@pytest.mark.renders
def test_a_version_that_fails_on_the_way_keeps_what_it_had(recorded, small_scenario):
    result = ablated(recorded, small_scenario, {"segment.method": "freehand"})
    assert len(result.scores["switched"]) < len(steps(recorded))
    assert "choose evidence or paper" in result.failures["switched"]
