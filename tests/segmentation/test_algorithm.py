"""Alg. 2 in one call: that it numbers, passes over and repeats frames; the wired systems are compared with it
in tests/systems."""

from dataclasses import replace

import numpy as np
import pytest

from riseg_drake.segmentation.algorithm import SegmentObjsParameters, no_frame_segmented, segment_objs
from riseg_drake.segmentation.optical_flow import DisFlow
from riseg_drake.segmentation.table_plane import NoPlaneError
from tests.segmentation.drawn_scene import CAMERA, DrawnScene, looking_down, planar


@pytest.fixture(scope="module")
def frames() -> list:
    """The first of two boxes is pushed by 2 mm a frame."""
    scene, rng = DrawnScene([(0.07, 0.06, 0.03), (0.06, 0.08, 0.05)]), np.random.default_rng(0)
    return [
        scene.frame(10 * k, looking_down(), [planar(-0.05, 0.002 * k, 0.3), planar(0.06, 0.0)], rng)[0]
        for k in range(5)
    ]


def through(frames, seed: int = 0) -> list:
    answers = [no_frame_segmented(CAMERA.shape)]
    for frame in frames:
        answers.append(segment_objs(answers[-1], frame, DisFlow(), SegmentObjsParameters(), seed))
    return answers[1:]


def test_frames_are_numbered_one_after_the_other_and_paired(frames) -> None:
    answers = through(frames)
    assert [answer.segmentation.sequence for answer in answers] == [0, 1, 2, 3, 4]
    assert [answer.pair.reference.sequence for answer in answers] == [0] * 5
    assert answers[-1].above_0 is answers[0].above_1
    assert answers[-1].mask.any()


def test_a_frame_that_is_not_newer_changes_nothing(frames) -> None:
    (answer,) = through(frames[:1])
    again = segment_objs(answer, replace(frames[0], sequence=7), DisFlow(), SegmentObjsParameters())
    assert again is answer


def test_the_state_before_is_left_as_it_was(frames) -> None:
    answers = through(frames)
    branched = segment_objs(answers[2], frames[3], DisFlow(), SegmentObjsParameters())
    assert branched.mask.tobytes() == answers[3].mask.tobytes()


def test_body_frames_are_drawn_by_seed_and_number(frames) -> None:
    first, second = through(frames)[-1], through(frames, seed=1)[-1]
    assert not np.array_equal(first.groups.pixel, second.groups.pixel)
    assert np.array_equal(first.groups.pixel, through(frames)[-1].groups.pixel)


def test_a_frame_without_a_table_is_refused(frames) -> None:
    blind = replace(frames[0], depth=np.zeros_like(frames[0].depth))
    with pytest.raises(NoPlaneError):
        segment_objs(no_frame_segmented(CAMERA.shape), blind, DisFlow(), SegmentObjsParameters())
