"""Which frame is the reference: kept while things move, renewed when the pair spans enough."""

import numpy as np
import pytest

from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.geometry.rgbd import NO_PAIR, Frame, FramePair
from riseg_drake.segmentation.frame_pairs import FramePairParameters, camera_span, next_pair
from tests.segmentation.drawn_scene import looking_down

CAMERA = Intrinsics(64, 48, 60.0, 60.0, 31.5, 23.5)
DEPTH = 0.5


def frame(sequence: int, X_WC: np.ndarray | None = None, rate: float = 15.0) -> Frame:
    shape = CAMERA.shape
    return Frame(
        sequence=sequence,
        time=sequence / rate,
        intrinsics=CAMERA,
        color=np.zeros((*shape, 3), np.uint8),
        depth=np.full(shape, DEPTH, np.float32),
        X_WC=looking_down() if X_WC is None else X_WC,
        robot=np.zeros(shape, bool),
    )


def references(frames: list[Frame], spans: list[float], **parameters) -> list[int]:
    """The reference of each pair, where `spans` is what each frame's pair turned out to span."""
    pair, out, span = NO_PAIR, [], 0.0
    for newest, following in zip(frames, spans, strict=True):
        pair = next_pair(pair, newest, span, FramePairParameters(**parameters))
        assert pair.current is newest
        out.append(pair.reference.sequence)
        span = following
    return out


def test_the_first_frame_is_paired_with_itself() -> None:
    first = frame(0)
    pair = next_pair(NO_PAIR, first, 0.0, FramePairParameters())
    assert pair.reference is pair.current is first


def test_consecutive_pairs_are_the_papers() -> None:
    frames = [frame(k) for k in range(5)]
    assert references(frames, [0, 9, 0, 30, 2], kind="consecutive") == [0, 0, 1, 2, 3]


@pytest.mark.parametrize(
    ("step", "expected"),
    [(1 / 15, [0, 0, 1, 2, 3, 4, 5]), (2 / 15, [0, 0, 0, 2, 2, 4, 4]), (0.19, [0, 0, 0, 0, 3, 3, 3])],
)
def test_a_time_step_pairs_frames_that_far_apart_and_those_between_with_the_one_before(step, expected) -> None:
    frames = [frame(k) for k in range(7)]
    assert references(frames, [5.0] * 7, kind="consecutive", step=step) == expected


def test_the_reference_stays_while_things_move_and_is_renewed_beyond_the_span() -> None:
    frames = [frame(k) for k in range(7)]
    share = 10.0 / CAMERA.width
    assert references(frames, [0, 1, 4, 7, 11, 2, 4], flow_span_share=share) == [0, 0, 0, 0, 0, 4, 4]


def test_a_pair_knows_how_far_things_had_moved_since_its_reference() -> None:
    pair, spans = NO_PAIR, []
    for newest, before in zip([frame(k) for k in range(6)], [0, 0, 3, 7, 11, 2], strict=True):
        pair = next_pair(pair, newest, before, FramePairParameters(flow_span_share=10.0 / CAMERA.width))
        spans.append(pair.span)
    assert spans == [0, 0, 3, 7, 0, 2]


def test_motion_keeps_an_old_reference_and_stillness_does_not() -> None:
    frames = [frame(k, rate=2.0) for k in range(7)]
    assert references(frames, [1.5] * 7, age_still=1.2) == [0] * 7
    assert references(frames, [0.0] * 7, age_still=1.2) == [0, 0, 0, 2, 2, 4, 4]


def test_the_camera_may_go_farther_while_something_moves() -> None:
    # A share of the width is so many metres at the scene's distance.
    metre = CAMERA.width * DEPTH / CAMERA.fx
    frames = [frame(k, looking_down(x=0.03 * k * metre)) for k in range(5)]
    spans = {"camera_span_moving": 0.07, "camera_span_still": 0.02}
    assert references(frames, [1.5] * 5, **spans) == [0, 0, 0, 2, 2]
    assert references(frames, [0.0] * 5, **spans) == [0, 0, 1, 2, 3]


def test_the_new_reference_is_the_frame_before_the_newest() -> None:
    pair = FramePair(frame(3), frame(8))
    after = next_pair(pair, frame(9), 1e3, FramePairParameters())
    assert (after.reference.sequence, after.current.sequence) == (8, 9)


@pytest.mark.parametrize("shift", [0.01, 0.05])
def test_the_cameras_span_is_that_of_its_shift_or_of_its_turn(shift: float) -> None:
    there = camera_span(frame(0), frame(1, looking_down(x=shift)))
    assert there == pytest.approx(CAMERA.fx * shift / DEPTH, rel=1e-6)
    turned = camera_span(frame(0), frame(1, looking_down(tilt=shift)))
    assert turned == pytest.approx(CAMERA.fx * shift, rel=1e-6)
    assert camera_span(frame(0), frame(1)) == pytest.approx(0, abs=1e-9)


def test_another_kind_of_pair_is_refused_with_the_choices() -> None:
    with pytest.raises(ValueError, match=r"'keyframe'.*motion or consecutive"):
        next_pair(NO_PAIR, frame(0), 0.0, FramePairParameters(kind="keyframe"))
