from types import SimpleNamespace

import numpy as np
import pytest
from pydrake.common.yaml import yaml_dump_typed

from riseg_drake.app.diagram import make_diagram
from riseg_drake.app.run.interactions import Progress, Truth, interactions, simulated_truth
from riseg_drake.app.run.recording import recording_of
from riseg_drake.app.scenario import HARDWARE, load_scenario
from riseg_drake.app.segment.command import SegmentRequest, _parameters
from riseg_drake.geometry.rgbd import Frame
from riseg_drake.recording.reader import RecordingReader
from riseg_drake.robot.kinematics import READY
from riseg_drake.systems.stage_clock import StageClock
from tests.recording.made_recordings import SMALL, drawn_frames


@pytest.mark.renders
def test_recorded_frames_are_those_that_were_segmented_bit_for_bit(small_scenario, tmp_path):
    scenario = load_scenario(small_scenario)
    seen = []
    wired = make_diagram(scenario, seed=1)
    with recording_of(wired, scenario, 1, simulated_truth(wired), tmp_path) as record:
        watchers = (record, lambda frame, _: seen.append(frame))
        assert list(interactions(wired, StageClock(), Progress(), 0.5, watchers))
    assert len(seen) > 5
    for before, after in zip(seen, RecordingReader(tmp_path), strict=True):
        assert after.time == before.time
        np.testing.assert_array_equal(after.color, before.color)
        np.testing.assert_array_equal(after.depth, before.depth)
        np.testing.assert_array_equal(after.robot, before.robot)


def test_the_recording_of_a_real_robot_is_segmented_as_it_was_seen(tmp_path):
    scenario = load_scenario(None, HARDWARE)
    scenario.hardware.panda.X_EC = [0.1, 0.02, -0.3, 0.0, 0.1, 0.2]
    frames = drawn_frames(3)
    wired = SimpleNamespace(intrinsics=SMALL, position=lambda context: READY)

    def truth(frame, context):
        return Truth(lambda: frames[1].labels, {}, {}) if frame.time == frames[1].time else None

    with recording_of(wired, scenario, 7, truth, tmp_path) as record:
        for k, seen in enumerate(frames):
            robot = np.zeros(SMALL.shape, bool)
            record(Frame(k, seen.time, SMALL, seen.color, seen.depth, seen.X_WC, robot), None)
    known, seed = _parameters(SegmentRequest(tmp_path, tmp_path / "out"))
    assert seed == 7
    assert yaml_dump_typed(known) == yaml_dump_typed(scenario)
    again = list(RecordingReader(tmp_path))
    assert [frame.labels is not None for frame in again] == [False, True, False]
    for frame in again:
        np.testing.assert_array_equal(frame.position, READY)
