"""Fewer pixels of a frame, and the whole one where it is asked for."""

import numpy as np
import pytest

from riseg_drake.geometry.reduction import reduced
from riseg_drake.geometry.rgbd import NO_FRAME
from riseg_drake.systems.frame_reducer import FrameReducer
from tests.systems.ports import evaluate, port_names


def test_ports_have_the_names_of_the_contract() -> None:
    assert port_names(FrameReducer(320)) == (["frame"], ["frame"])


def test_it_gives_what_the_function_makes_of_the_frame(drawn_frames) -> None:
    frame, expected = drawn_frames[0], reduced(drawn_frames[0], 160)
    few = evaluate(FrameReducer(160), "frame", frame=frame)
    assert few.intrinsics == expected.intrinsics
    np.testing.assert_array_equal(few.color, expected.color)
    np.testing.assert_array_equal(few.depth, expected.depth)
    assert few.source is frame


@pytest.mark.parametrize("width", [0, 320])
def test_a_frame_that_is_no_wider_goes_through_as_it_is(drawn_frames, width: int) -> None:
    assert evaluate(FrameReducer(width), "frame", frame=drawn_frames[0]) is drawn_frames[0]


def test_no_frame_stays_none() -> None:
    assert evaluate(FrameReducer(160), "frame", frame=NO_FRAME) is NO_FRAME
