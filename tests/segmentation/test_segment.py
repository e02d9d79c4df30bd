"""Line 7: by which method, once a frame."""

from dataclasses import replace

import numpy as np
import pytest

from riseg_drake.segmentation.bfif import BFIFParameters
from riseg_drake.segmentation.partition import Margins
from riseg_drake.segmentation.propagation import UNKNOWN
from riseg_drake.segmentation.segment import SegmentParameters, segment
from riseg_drake.segmentation.segmentation import Segmentation, nothing_segmented
from tests.segmentation.drawn_scene import DrawnScene, looking_down, planar
from tests.segmentation.watched import Watcher


def seen_once(method: str) -> tuple[Segmentation, tuple]:
    """What a first frame leaves, and what `segment` was given besides what was before."""
    frame, _ = DrawnScene([(0.07, 0.06, 0.03)]).frame(0, looking_down(), [planar(0, 0)])
    watcher = Watcher(segment=SegmentParameters(method=method))
    seen = watcher.take(frame)
    flows = seen.expected_flow, seen.optical_flow
    inputs = (seen.pair, *flows, seen.groups, seen.above_0, seen.above_1, lambda: seen.above_1)
    return seen.segmentation, (*inputs, SegmentParameters(method=method), BFIFParameters())


@pytest.mark.parametrize("method", ["evidence", "paper"])
def test_the_same_frame_again_changes_nothing(method: str) -> None:
    answer, inputs = seen_once(method)
    assert segment(answer, *inputs) is answer


def test_by_evidence_what_stands_there_is_unknown_and_the_paper_knows_no_such_thing() -> None:
    by_evidence, _ = seen_once("evidence")
    assert np.any(by_evidence.label == UNKNOWN)
    assert not by_evidence.mask.any()
    literal, _ = seen_once("paper")
    assert not literal.label.any()
    assert literal.belief is None


def test_an_unknown_method_is_refused_with_the_choices() -> None:
    _, inputs = seen_once("evidence")
    wrong = (*inputs[:-2], SegmentParameters(method="rules"), inputs[-1])
    with pytest.raises(ValueError, match=r"'rules'.*evidence or paper"):
        segment(nothing_segmented(inputs[0].current.depth.shape), *wrong)


def test_at_first_nothing_is_segmented() -> None:
    start = nothing_segmented((3, 4))
    assert start.mask.shape == (3, 4)
    assert not start.mask.any()
    assert start.object_ids == ()
    assert start.confidence == {}


def test_what_is_in_doubt_is_not_settled() -> None:
    label = np.array([[0, 1, 2, UNKNOWN]], np.uint16)
    seen = replace(
        nothing_segmented((1, 4)), label=label, margins=Margins({1: 1.0, 2: 4.0}, {1: 9.0, 2: 9.0}), settled=2.0
    )
    np.testing.assert_array_equal(seen.mask, [[0, 1, 2, 0]])
    np.testing.assert_array_equal(seen.settled_mask, [[0, 0, 2, 0]])
    assert seen.confidence == {1: pytest.approx(0.5), 2: pytest.approx(1 / (1 + np.exp(-6)))}
    assert seen.object_ids == (1, 2)
