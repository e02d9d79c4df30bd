import json
from dataclasses import asdict
from functools import reduce

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
from riseg_drake.recording.layout import RecordingError
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


@pytest.mark.renders
def test_each_version_is_scored_at_the_steps_of_the_run(recorded, small_scenario, monkeypatch):
    scenario = load_scenario(small_scenario)
    monkeypatch.setattr(ablation, "versions", lambda: {"as it is": {}})
    recorded_steps = [RecordedStep.from_summary(step) for step in steps(recorded)]
    result = ablate(scenario, 1, recorded / "recording", recorded_steps)
    own = [step["scores"] for step in steps(recorded)]
    assert [scores.as_dict() for scores in result.scores["as it is"]] == [pytest.approx(each) for each in own]
    with pytest.raises(RecordingError, match=r"no frame at 1000\.0 s"):
        ablate(scenario, 1, recorded / "recording", [RecordedStep(1000.0)])


@pytest.mark.renders
def test_what_moved_is_scored_in_the_same_frames_as_in_the_run(recorded, small_scenario, monkeypatch):
    scenario = load_scenario(small_scenario)
    monkeypatch.setattr(ablation, "versions", lambda: {"as it is": {}})
    recorded_steps = [RecordedStep.from_summary(step) for step in steps(recorded)]
    result = ablate(scenario, 1, recorded / "recording", recorded_steps)
    own = [step.get("in_motion") for step in steps(recorded)[1:]]
    assert any(own)
    assert [each and asdict(each) for each in result.in_motion["as it is"]] == [
        each and pytest.approx(each) for each in own
    ]


@pytest.mark.renders
def test_a_version_that_fails_on_the_way_keeps_what_it_had(recorded, small_scenario, monkeypatch):
    scenario = load_scenario(small_scenario)
    broken = {"segment.method": "freehand"}
    monkeypatch.setattr(ablation, "versions", lambda: {"broken": broken})
    recorded_steps = [RecordedStep.from_summary(step) for step in steps(recorded)]
    result = ablate(scenario, 1, recorded / "recording", recorded_steps)
    assert len(result.scores["broken"]) < len(recorded_steps)
    assert "choose evidence or paper" in result.failures["broken"]
