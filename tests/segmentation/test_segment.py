"""Line 7 whole: a rendered body that is pushed gets one id, which stays."""

import numpy as np
import pytest

from riseg_drake.segmentation.bfif import BFIFParameters
from riseg_drake.segmentation.body_frames import BodyFrameParameters
from riseg_drake.segmentation.frame_pairs import FramePairParameters
from riseg_drake.segmentation.grouping import GroupingParameters
from riseg_drake.segmentation.segment import SegmentParameters, nothing_segmented, push_by_flow, segment
from tests.segmentation.algorithm import Algorithm
from tests.segmentation.drawn_scene import intersection_over_union


@pytest.fixture(scope="module")
def watched(pushed):
    """The algorithm after the whole push, its answers, and the truth, frame by frame."""
    algorithm = Algorithm()
    return algorithm, [algorithm.take(frame) for frame, _ in pushed], [label for _, label in pushed]


@pytest.mark.renders
def test_a_body_that_is_pushed_gets_one_id_that_stays(watched) -> None:
    _, answers, _ = watched
    found = [set(np.unique(answer.mask)) - {0} for answer in answers]
    first = next(k for k, ids in enumerate(found) if ids)
    assert 2 < first < 8
    (only,) = found[first]
    assert found[first:] == [{only}] * (len(found) - first)
    assert answers[-1].object_ids == (only,)


@pytest.mark.renders
def test_its_mask_is_the_body_and_stays_on_it(watched) -> None:
    _, answers, truths = watched
    for answer, truth in list(zip(answers, truths, strict=True))[9:]:
        assert intersection_over_union(answer.mask > 0, truth == 1) > 0.9


@pytest.mark.renders
def test_bodies_that_never_moved_stay_unknown(watched) -> None:
    _, answers, truths = watched
    for answer, truth in zip(answers, truths, strict=True):
        assert np.mean(answer.mask[np.isin(truth, [2, 3])] == 0) > 0.97


@pytest.mark.renders
def test_the_same_pair_again_changes_nothing(watched) -> None:
    algorithm, answers, _ = watched
    assert segment(answers[-1], *algorithm.inputs) is answers[-1]


@pytest.mark.renders
def test_the_same_frames_give_the_same_masks_to_the_byte(watched, pushed) -> None:
    again = Algorithm()
    for (frame, _), answer in zip(pushed[:12], watched[1], strict=False):
        assert again.take(frame).mask.tobytes() == answer.mask.tobytes()


@pytest.mark.renders
def test_the_papers_own_version_runs_and_labels_what_moves(pushed) -> None:
    literal = Algorithm(
        bfif=BFIFParameters(
            frames=BodyFrameParameters(kind="triplets"),
            grouping=GroupingParameters(covariance="sample"),
        ),
        segment=SegmentParameters(outline="flow", propagation="flow", ids="fresh", memory=False),
        pairs=FramePairParameters(kind="consecutive"),
    )
    most = 0.0
    for frame, truth in pushed[:10]:
        answer = literal.take(frame)
        assert answer.mask.dtype == np.uint16
        most = max(most, np.mean(answer.mask[truth == 1] > 0))
    assert most > 0.5
    assert answer.object_ids


def test_at_first_nothing_is_segmented() -> None:
    start = nothing_segmented((3, 4))
    assert start.mask.shape == (3, 4)
    assert not start.mask.any()
    assert start.object_ids == ()


def test_pushing_by_flow_moves_labels_by_whole_pixels_and_off_the_image() -> None:
    label = np.zeros((4, 6), np.uint16)
    label[1, 1], label[2, 5] = 3, 4
    flow = np.zeros((4, 6, 2), np.float32)
    flow[1, 1], flow[2, 5] = [2.4, 0.6], [1.0, 0.0]
    expected = np.zeros_like(label)
    expected[2, 3] = 3
    np.testing.assert_array_equal(push_by_flow(label, flow), expected)


@pytest.mark.renders
@pytest.mark.parametrize(
    ("wrong", "choices"),
    [({"outline": "snake"}, "motion or flow"), ({"propagation": "copy"}, "reference or flow")],
)
def test_an_unknown_choice_is_refused_with_the_choices(pushed, wrong, choices) -> None:
    algorithm = Algorithm(segment=SegmentParameters(**wrong))
    with pytest.raises(ValueError, match=choices):
        list(map(algorithm.take, [frame for frame, _ in pushed[:8]]))
