"""Line 7 by evidence: a rendered body that is pushed gets one id, sharper still once it is at rest."""

from dataclasses import replace

import numpy as np
import pytest

from riseg_drake.segmentation import segment_by_evidence as module
from riseg_drake.segmentation.algorithm import SegmentObjsParameters
from riseg_drake.segmentation.segment import SegmentParameters
from tests.segmentation.drawn_scene import (
    Blank,
    DrawnScene,
    Texture,
    intersection_over_union,
    looking_down,
    planar,
)
from tests.segmentation.watched import Watcher


@pytest.fixture(scope="module")
def watched(pushed):
    """What is answered during a push and a rest, and the truth, frame by frame."""
    watcher = Watcher()
    shown = [*pushed, *resting(pushed)]
    return [watcher.take(frame).segmentation for frame, _ in shown], [label for _, label in shown]


def resting(pushed) -> list:
    """The last frame three times more: nothing moves, the camera neither."""
    frame, label = pushed[-1]
    return [(replace(frame, sequence=20 + k, time=frame.time + (k + 1) / 15), label) for k in range(3)]


@pytest.mark.renders
def test_a_body_that_is_pushed_gets_an_id_in_motion_and_its_neighbours_none(watched) -> None:
    answers, truths = watched
    for answer, truth in list(zip(answers, truths, strict=True))[9:]:
        assert intersection_over_union(answer.mask > 0, truth == 1) > 0.9
        assert np.mean(answer.mask[np.isin(truth, [2, 3])] == 0) > 0.97


@pytest.mark.renders
def test_before_a_still_camera_what_went_far_is_decided_and_the_frame_becomes_the_keyframe(
    watched,
) -> None:
    answers, truths = watched
    assert answers[0].belief.keyframe.frame.sequence == 0
    keyframes = [answer.belief.keyframe.frame.sequence for answer in answers]
    # After 15 pixels of motion; in the rest after that nothing is new.
    assert keyframes == [0] * 19 + [19] * 4
    (only,) = set(np.unique(answers[-1].mask)) - {0}
    assert intersection_over_union(answers[-1].mask == only, truths[-1] == 1) > 0.95
    assert answers[-1].object_ids == (only,)
    assert set(answers[-1].confidence) == {only}


@pytest.mark.renders
@pytest.mark.parametrize("fresh", [0.5, 0.8])
def test_a_frame_in_motion_adds_to_the_running_mean_of_evidence_and_a_new_keyframe_begins_anew(
    pushed, monkeypatch, fresh: float
) -> None:
    own, judged = [], []
    observe, bodies_of = module.observe, module.bodies_of

    def observed(*arguments):
        own.append(observe(*arguments))
        return own[-1]

    def made_of(belief, seen, *arguments):
        judged.append(seen.evidence)
        return bodies_of(belief, seen, *arguments)

    monkeypatch.setattr(module, "observe", observed)
    monkeypatch.setattr(module, "bodies_of", made_of)
    watcher, earlier, told = Watcher(segment=SegmentParameters()), None, 0
    watcher.parameters.segment.evidence.fresh = fresh
    for frame, _ in [*pushed, *resting(pushed)]:
        own.clear(), judged.clear()
        segmentation = watcher.take(frame).segmentation
        if segmentation.belief.keyframe.frame.sequence == frame.sequence:
            # The last in motion, and the one that decides, which counts for itself.
            for one, other in list(zip(own, judged, strict=True))[1:]:
                np.testing.assert_array_equal(one.evidence, other)
            assert segmentation.said is None
            earlier = None
        elif judged:
            mean = own[0].evidence if earlier is None else fresh * own[0].evidence + (1 - fresh) * earlier
            np.testing.assert_allclose(judged[0], mean, atol=1e-12)
            earlier, told = segmentation.said, told + 1
    assert told > 10


@pytest.mark.renders
def test_the_same_frames_give_the_same_masks_to_the_byte(watched, pushed) -> None:
    again = Watcher()
    for (frame, _), answer in zip([*pushed, *resting(pushed)], watched[0], strict=True):
        assert again.take(frame).mask.tobytes() == answer.mask.tobytes()


@pytest.mark.parametrize("holes", [0.0, 0.3], ids=["whole", "with holes"])
def test_what_a_camera_sees_that_creeps_back_to_where_it_was_is_decided_at_its_rest(holes) -> None:
    scene = DrawnScene([(0.07, 0.06, 0.03), (0.06, 0.08, 0.05)])
    there, pushed_to = planar(0.08, 0.0), [planar(-0.05, 0.004 * k, 0.3) for k in range(7)]
    watcher, rng = Watcher(), np.random.default_rng(0)
    # Away while the box is pushed, and back; the last step but one is 2 pixels long, and ends 1 from the start.
    xs = [0.0, 0.0, 0.02, 0.04, 0.04, 0.04, 0.04, 0.04, 0.02, 0.004, 0.0008, 0.0008, 0.0008, 0.0008, 0.0008]
    places = [*[pushed_to[0]] * 3, *pushed_to[1:], *[pushed_to[-1]] * 6]
    keyframes = []
    for sequence, (x, place) in enumerate(zip(xs, places, strict=True)):
        frame, label = scene.frame(sequence, looking_down(x), [place, there], rng)
        # Dark things have holes in depth, others in each frame.
        missing = (label > 0) & (rng.random(label.shape) < holes)
        frame = replace(frame, depth=np.where(missing, np.float32(0), frame.depth))
        segmentation = watcher.take(frame).segmentation
        keyframes.append(segmentation.belief.keyframe.frame.sequence)
    # It stands still from the frame after that step on, and for 0.1 s two frames later.
    assert keyframes[-6:] == [0, 0, 0, 0, 13, 13]
    assert segmentation.decided
    (only,) = segmentation.object_ids
    assert intersection_over_union(segmentation.mask == only, label == 1) > 0.95


def test_what_was_decided_in_motion_is_looked_at_once_more_at_its_rest() -> None:
    scene = DrawnScene([(0.07, 0.06, 0.03), (0.06, 0.08, 0.05)])
    watcher, rng = Watcher(), np.random.default_rng(0)
    answers = []
    for sequence, y in enumerate([0.0, 0.0, *np.arange(1, 12) * 0.003, *[0.033] * 4]):
        frame, _ = scene.frame(sequence, looking_down(), [planar(-0.05, y, 0.3), planar(0.08, 0.0)], rng)
        answers.append(watcher.take(frame).segmentation)
    in_motion = [a for a in answers if a.belief.keyframe.frame.sequence > 0 and a.still_since is None]
    assert in_motion
    assert not any(a.decided for a in in_motion)
    assert answers[-1].decided


def test_two_that_hands_moved_as_one_and_then_apart_are_two_whole_things_without_any_rest() -> None:
    scene = DrawnScene([(0.07, 0.06, 0.03), (0.09, 0.11, 0.03)], textures=[Texture(0), Blank(150.0)])
    watcher, rng = Watcher(), np.random.default_rng(0)
    together, apart = [0.0, 0.0, *0.003 * np.arange(1, 10)], 0.003 * np.arange(1, 10)
    way = [(0.0, y) for y in together] + [(x, together[-1]) for x in apart]
    ids = []
    for sequence, (x, y) in enumerate(way):
        places = [planar(-0.036 - x, y - 0.03), planar(0.046 + x, y - 0.03)]
        frame, label = scene.frame(sequence, looking_down(), places, rng)
        segmentation = watcher.take(frame).segmentation
        assert segmentation.still_since is None or sequence < 2
        ids.append({int(a) for a in np.unique(segmentation.mask) if a})
    assert len(ids[len(together) - 1]) == 1
    one, other = (np.bincount(segmentation.mask[label == i]).argmax() for i in (1, 2))
    assert one != other
    assert intersection_over_union(segmentation.mask == one, label == 1) > 0.9
    assert intersection_over_union(segmentation.mask == other, label == 2) > 0.9


def test_of_boxes_that_stand_flush_the_one_that_is_pushed_has_an_id_before_any_rest() -> None:
    scene = DrawnScene([(0.07, 0.06, 0.03)] * 3)
    watcher, rng = Watcher(), np.random.default_rng(0)
    for sequence, y in enumerate([0.0, 0.0, *0.002 * np.arange(1, 9)]):
        places = [planar(-0.0705, 0.0), planar(0.0, y), planar(0.0705, 0.0)]
        # The camera moves, as on an arm: nothing is decided while it does.
        frame, label = scene.frame(sequence, looking_down(0.5 * y), places, rng)
        segmentation = watcher.take(frame).segmentation
        assert segmentation.belief.keyframe.frame.sequence == 0
        if sequence >= 2:  # from 1.5 pixels on
            assert set(segmentation.bodies[sequence].body) == {0, 1}
        if sequence >= 3:  # and shown from the second frame on
            assert intersection_over_union(segmentation.mask > 0, label == 2) > 0.93
        else:
            assert not segmentation.mask.any()


def test_a_thing_that_leaves_its_place_unseen_in_motion_is_no_reason_to_decide_before_it_rests() -> None:
    # No motion is proposed by groups or searched for: the rest alone says where the box went.
    parameters = SegmentObjsParameters()
    parameters.segment.evidence.search_every = 1e3
    parameters.bfif.grouping.members_min = 100_000
    scene = DrawnScene([(0.03, 0.05, 0.03), (0.03, 0.05, 0.04)])
    watcher, rng = Watcher(bfif=parameters.bfif, segment=parameters.segment), np.random.default_rng(0)
    keyframes = []
    for sequence, y in enumerate([0.0, 0.0, *np.arange(1, 10) * 0.003, *[0.027] * 5]):
        camera = looking_down(0.5 * y if sequence < 9 else 0.0)
        frame, label = scene.frame(sequence, camera, [planar(-0.05 - y, 0.0), planar(0.05 + y, 0.0)], rng)
        segmentation = watcher.take(frame).segmentation
        keyframes.append(segmentation.belief.keyframe.frame.sequence)
    assert keyframes[:11] == [0] * 11
    assert keyframes[-1] > 0
    for i in (1, 2):
        ids = np.unique(segmentation.mask[label == i])
        assert intersection_over_union(segmentation.mask == ids.max(), label == i) > 0.95


def pushed_from_nearby(blind: bool) -> tuple[list, list]:
    """A blank box is pushed by an arm whose camera has come near, and goes back: answers and labels."""
    scene = DrawnScene([(0.06, 0.05, 0.08), (0.06, 0.08, 0.03)], [Blank(150.0), Texture(1)])
    watcher, rng = Watcher(), np.random.default_rng(0)
    cameras = [(0.0, 0.5)] * 2 + [(0.0, 0.4), (0.02, 0.32)] + [(0.02, 0.3)] * 10 + [(0.0, 0.5)] * 4
    steps = [0] * 6 + [1, 2, 3, 4, 5, 6] + [6] * 6
    answers, labels = [], []
    for sequence, ((x, z), step) in enumerate(zip(cameras, steps, strict=True)):
        places = [planar(0.02, 0.002 * step), planar(0.12, 0.0)]
        frame, label = scene.frame(sequence, looking_down(x, 0.002 * step, z), places, rng)
        if blind:  # as a camera that measures from 0.3 m on
            frame = replace(frame, depth=np.where(frame.depth < 0.28, np.float32(0), frame.depth))
        answers.append(watcher.take(frame).segmentation)
        labels.append(label)
    return answers, labels


@pytest.mark.parametrize("blind", [False, True], ids=["with depth", "too near for depth"])
def test_a_blank_body_is_followed_from_nearby_by_how_it_looked_before_it_moved(blind) -> None:
    answers, labels = pushed_from_nearby(blind)
    for answer, label in list(zip(answers, labels, strict=True))[11:]:
        assert intersection_over_union(answer.mask > 0, label == 1) > 0.9


def test_the_keyframe_is_seen_again_once_the_camera_has_come_near_and_until_the_next_rest_decides() -> None:
    answers, _ = pushed_from_nearby(True)
    seen = [None if len(a.views) < 2 else a.views[1].frame.sequence for a in answers]
    # Frame 4 is the first that looks from where frame 5 does; the body moves from frame 6 on.
    assert seen[:6] == [None] * 5 + [5]
    assert set(seen[6:-2]) == {5}
    assert len(answers[-1].views) == 1
    assert answers[-1].belief.keyframe.frame.sequence > 14
