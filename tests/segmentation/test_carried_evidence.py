"""What is known of borders, carried to a new keyframe: by hand, on a few superpixels."""

from types import SimpleNamespace

import numpy as np
import pytest

from riseg_drake.geometry.camera import rays
from riseg_drake.geometry.se3 import move_points, translation
from riseg_drake.segmentation.above_table import AboveTableParameters, objects_above_table
from riseg_drake.segmentation.belief import Belief
from riseg_drake.segmentation.carried_evidence import Origin, carried_evidence, were_in_sight
from riseg_drake.segmentation.keyframe import KeyframeParameters, make_keyframe
from riseg_drake.segmentation.noise import MeasurementNoise
from tests.segmentation.drawn_scene import CAMERA, DrawnScene, looking_down, motion_seen_from

NOISE = MeasurementNoise()
NO = np.array(False)
"""None of the borders is of what would have been seen."""


def carried(
    old_borders,
    old_evidence,
    old_body,
    new_borders,
    origin,
    prior=2.0,
    across=None,
    length=None,
    over=False,
    alike=None,
    inherited=None,
):
    """Evidence for new borders; 4 nats would be against what never met, 1 for what was one body. With `alike`,
    how much of it as both sides moved alike; with `inherited`, how much by their bodies."""
    keyframe = SimpleNamespace(
        borders=np.array(old_borders),
        count=len(old_body),
        length=np.ones(len(old_borders)) if length is None else np.array(length),
    )
    evidence = np.array(old_evidence, float)
    was = np.full(len(evidence), 2.0)
    of_it = np.zeros(len(evidence)) if alike is None else np.array(alike)
    of_bodies = np.zeros(len(evidence)) if inherited is None else np.array(inherited)
    old = Belief(keyframe, was, evidence, of_it, of_bodies, np.array(old_body), *[None] * 5)
    across = np.zeros(len(new_borders), bool) if across is None else np.array(across)
    new = SimpleNamespace(borders=np.array(new_borders), across=across, over=np.full(len(across), over))
    told = carried_evidence(old, new, np.full(len(new_borders), prior), origin, inside=2.0)
    return told[0] if alike is None and inherited is None else told[1 if inherited is None else 2]


def test_what_comes_into_sight_may_be_any_body_with_which_it_was_hidden():
    # 0 moved, 1 stood, 2 has never moved, 3 and 4 are uncovered; 3 would have been seen on 0.
    borders = [[0, 1], [0, 3], [1, 3], [2, 3], [3, 4]]
    body = np.array([5, 6, 0, 0, 0])
    origin = Origin(source=np.array([0, 1, 2, -1, -1]), body=body, in_sight=np.arange(5) == 1)
    evidence = carried([[0, 1]], [-7.0], body[:3], borders, origin)
    assert evidence == pytest.approx([-7.0, -4.0, 0.0, 0.0, 0.0])


def test_of_two_bodies_all_that_was_seen_between_them_is_remembered_wherever_they_meet_now():
    # 0 and 1 were the body 5, 2 and 3 the body 6; what meets now are the ends that did not touch, 0 and 3.
    body = np.array([5, 5, 6, 6])
    origin = Origin(source=np.arange(4), body=body, in_sight=NO)
    met = [[0, 1], [0, 2], [1, 2], [2, 3]]
    evidence = carried(met, [1.0, -1.0, 0.5, 1.0], body, [[0, 3]], origin, length=[1.0, 1.0, 3.0, 1.0])
    assert evidence == pytest.approx([(1 * -1.0 + 3 * 0.5) / 4])
    # What has parted is two, and so is what may lie on the other.
    parted = carried(met, [1.0, -3.0, -1.8, 1.0], body, [[0, 3]], origin, length=[1.0, 1.0, 3.0, 1.0])
    assert parted == pytest.approx([-4.0])
    assert carried(met, [1.0, -1.0, 0.5, 1.0], body, [[0, 3]], origin, over=True) == pytest.approx([-4.0])
    # Bodies that were never near each other are two.
    never = carried([[0, 1], [2, 3]], [1.0, 1.0], body, [[0, 3], [1, 2]], origin, across=[False, True])
    assert never == pytest.approx([-4.0, -4.0])


def test_a_gap_that_opens_in_the_picture_of_one_body_does_not_speak_against_it():
    body = np.array([5, 5, 5])
    origin = Origin(source=np.array([0, -1, -1]), body=body, in_sight=np.ones(2, bool))
    evidence = carried([[0, 1], [1, 2]], [1.0, 1.0], body, [[0, 1], [0, 2]], origin, -1.5, [True, False])
    assert evidence + -1.5 == pytest.approx([1.0, -0.5])


def test_a_border_is_remembered_by_both_its_sides_whichever_way_round_and_whatever_its_number():
    # Five superpixels in a new order: 4 was 0, 3 was 1, and so on; each old border has evidence of its own.
    old_borders = [[0, 1], [0, 2], [1, 3], [2, 3], [2, 4], [3, 4]]
    evidence = np.array([1.0, -2.0, 3.0, -4.0, 5.0, -6.0])
    origin = Origin(source=np.arange(5)[::-1], body=np.zeros(5, int), in_sight=NO)
    new_borders = sorted(sorted(4 - side for side in border) for border in old_borders)
    told = carried(old_borders, evidence, np.zeros(5, int), new_borders, origin)
    expected = [evidence[old_borders.index(sorted(4 - side for side in border))] for border in new_borders]
    assert told == pytest.approx(expected)


def test_what_was_one_superpixel_is_one_and_what_was_not_a_border_is_by_its_bodies():
    # 0 and 1 were one; 1 and 2 never touched, and are bodies 5 and 6; 2 and 3 never touched and are body 6.
    origin = Origin(np.array([0, 0, 1, 2]), np.array([5, 5, 6, 6]), NO)
    told = carried([[0, 3]], [9.0], np.array([5, 6, 6, 0]), [[0, 1], [1, 2], [2, 3]], origin)
    assert told == pytest.approx([2.0, -4.0, 1.0])


def test_half_of_what_pictures_say_of_a_border_is_what_earlier_ones_said():
    origin = Origin(np.array([0, 1]), np.zeros(2, int), NO)
    # The old picture said 2, and motion 3; the new one is believed as much as the old: 3 + (2 + it) / 2.
    for prior, remembered in ((2.0, 3.0), (2.5, 2.75), (-1.5, 4.75)):
        told = carried([[0, 1]], [3.0], np.zeros(2, int), [[0, 1]], origin, prior=prior)
        assert told == pytest.approx([remembered])


@pytest.mark.parametrize(("prior", "remembered"), [(2.0, 0.125), (2.5, -0.125), (1.0, 0.625)])
def test_what_pictures_said_between_two_bodies_is_remembered_wherever_they_meet_now(prior, remembered):
    # 0 and 1 were the body 5, 2 and 3 the body 6; 0 and 3 did not touch. The old picture said 2 of each border.
    body = np.array([5, 5, 6, 6])
    origin = Origin(source=np.arange(4), body=body, in_sight=NO)
    met = [[0, 1], [0, 2], [1, 2], [2, 3]]
    told = carried(met, [1.0, -1.0, 0.5, 1.0], body, [[0, 3]], origin, prior, length=[1.0, 1.0, 3.0, 1.0])
    assert told == pytest.approx([remembered])


def test_what_was_known_of_no_body_says_nothing_of_what_comes_into_sight():
    origin = Origin(np.array([0, -1, -1]), np.zeros(3, int), NO)
    assert carried([[0, 1]], [3.0], np.zeros(2, int), [[1, 2]], origin) == pytest.approx([0.0])


def test_that_both_sides_moved_alike_is_remembered_of_a_border_and_of_all_borders_of_two_bodies():
    # 0 and 1 were the body 5, 2 and 3 the body 6; 0 and 3 meet now, 1 and 2 still do, 4 is uncovered.
    body = np.array([5, 5, 6, 6])
    origin = Origin(np.array([0, 1, 2, 3, -1]), np.array([5, 5, 6, 6, 0]), np.ones(4, bool))
    met, new = [[0, 1], [0, 2], [1, 2], [2, 3]], [[0, 3], [1, 2], [0, 1], [3, 4]]
    told = carried(
        met, [9.0, 9.0, 9.0, 9.0], body, new, origin, length=[1, 1, 3, 1], alike=[1.2, 0.4, 0.8, 0.2]
    )
    assert told == pytest.approx([(1 * 0.4 + 3 * 0.8) / 4, 0.8, 1.2, 0.0])


def test_inside_one_body_nothing_is_remembered_as_alike_but_of_its_own_borders():
    origin = Origin(np.array([0, 0, 1]), np.array([5, 5, 5]), NO)
    told = carried([[0, 1]], [3.0], np.array([5, 5]), [[0, 1], [1, 2], [0, 2]], origin, alike=[1.5])
    assert told == pytest.approx([0.0, 1.5, 1.5])


def test_what_is_known_of_bodies_alone_is_kept_apart_until_a_border_was_seen():
    # 0 and 1 are the body 5, 2 and 3 the body 6, 4 is uncovered; 1 and 2 meet still, by 3 nats of their bodies.
    origin = Origin(np.array([0, 1, 2, 3, -1]), np.array([5, 5, 6, 6, 0]), np.ones(5, bool))
    met, new = [[0, 1], [1, 2], [2, 3]], [[0, 1], [1, 2], [0, 3], [1, 3], [3, 4]]
    told = carried(met, [1.0, -5.0, 1.0], np.array([5, 5, 6, 6]), new, origin, inherited=[0.0, -3.0, 0.0])
    # Where both meet now, all of it is by their bodies, as it is of what would have been seen.
    assert told == pytest.approx([0.0, -3.0, -4.0, -4.0, -4.0])


NEW = 3
"""Label of what is new."""
SLAB, PLATE = (0.16, 0.06, 0.02), (0.06, 0.061, 0.02)


def at(x, z=0.0):
    """X_WB of a box."""
    return translation(np.array([x, 0, z]))


def keyframe_of(frame, label):
    above = objects_above_table(frame, AboveTableParameters())
    return make_keyframe(frame, above, NOISE, KeyframeParameters(), label)


@pytest.mark.parametrize("camera", [0.0, -0.05])
@pytest.mark.parametrize(
    ("before", "now", "number", "where", "seen_beside"),
    [
        # Off the slab, on which it lay: what that uncovers lay under it, as the slab stands. With the plate it
        # would have been 5 cm to the left, where the slab itself was seen.
        ([at(0), at(0.03, 0.02)], [at(0), at(0.08, 0.02)], 1, (0.0, 0.05), {1: False, 2: True}),
        # The same where the slab is pulled from below.
        ([at(0), at(0.03, 0.02)], [at(-0.05), at(0.03, 0.02)], 1, (-0.05, 0.0), {1: False, 2: True}),
        # Put beside the slab: as one with that it would have been there before.
        ([at(0), at(0.9)], [at(0), at(0.111)], 2, (0.0, 0.2), {1: True}),
    ],
    ids=["pushed off", "pulled away", "put there"],
)
def test_what_is_new_was_hidden_with_its_own_body_and_would_have_been_seen_with_another(
    before, now, number, where, seen_beside, camera
):
    """A plate on a slab. New is what the `number`-th of them shows at some x, m, that lay under the other."""
    scene, X_WK, X_WN = DrawnScene([SLAB, PLATE]), looking_down(), looking_down(camera)
    old = keyframe_of(*scene.frame(0, X_WK, before))
    frame, label = scene.frame(1, X_WN, now)
    p_WQ = move_points(X_WN, (rays(CAMERA) * frame.depth[..., None]).astype(float))
    label[(label == number) & (where[0] < p_WQ[..., 0]) & (p_WQ[..., 0] < where[1])] = NEW
    new = keyframe_of(frame, label)
    inside = new.superpixels.label >= 0
    body = np.zeros((new.count, NEW + 1), int)
    np.add.at(body, (new.superpixels.label[inside], label[new.region][inside]), 1)
    body = body.argmax(1)
    is_new, motion = body == NEW, np.where(body == NEW, 99, body)
    moved = (motion_seen_from(X_WK, *poses) for poses in zip(before, now, strict=True))
    motions_K = np.array([np.eye(4), *moved])
    told = were_in_sight(old, new, np.where(is_new, -1, 0), motion, motions_K)
    a, b = new.borders.T
    one_is_new = is_new[a] != is_new[b]
    assert not told[~one_is_new].any()
    beside = np.where(is_new[a], body[b], body[a])
    for other, seen in seen_beside.items():
        mine = told[one_is_new & (beside == other)]
        assert len(mine) >= 5
        assert (mine == seen).all()
