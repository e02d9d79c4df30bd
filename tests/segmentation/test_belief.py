"""What is kept of bodies when the keyframe changes."""

from types import SimpleNamespace

import numpy as np
import pytest

from riseg_drake.geometry.se3 import exp_se3, inverse
from riseg_drake.segmentation.belief import (
    BeliefParameters,
    Bodies,
    Origin,
    _most_seen,
    carried_evidence,
    completed,
    rebased,
)


def test_how_bodies_had_moved_when_the_reference_was_taken_is_told_since_the_new_keyframe():
    X_WO, X_WN = (
        exp_se3(np.array([0.1, 0.2, 0.0, 0.0, 0.0, 0.6])),
        exp_se3(np.array([0.0, -0.1, 0.3, 0.1, 0.0, 0.5])),
    )
    rng = np.random.default_rng(0)
    # Poses in W of two bodies, of which the second stood still, at the old keyframe, then, and at the new one.
    X_WB = [exp_se3(0.1 * rng.normal(size=6)) for _ in range(3)]
    since_old = [inverse(X_WO) @ X @ inverse(X_WB[0]) @ X_WO for X in X_WB]
    body = np.array([4, 4, 7])
    then = Bodies(body, np.array([1, 1, 0]), np.array([np.eye(4), since_old[1]]), 8)
    now = Bodies(body, np.array([1, 1, 0]), np.array([np.eye(4), since_old[2]]), 8)
    old = SimpleNamespace(frame=SimpleNamespace(X_WC=X_WO), area=np.array([5, 5, 5]))
    new = SimpleNamespace(frame=SimpleNamespace(X_WC=X_WN), count=4)
    following = SimpleNamespace(keyframe=new, body=np.array([7, 4, 0, 4]), next_id=8)
    told = rebased(then, now, old, following)
    expected = inverse(X_WN) @ X_WB[1] @ inverse(X_WB[2]) @ X_WN  # from the new keyframe back to then
    for superpixel, motion in enumerate([np.eye(4), expected, np.eye(4), expected]):
        np.testing.assert_allclose(told.motions_K[told.motion[superpixel]], motion, atol=1e-12)
    at_the_keyframe = rebased(now, now, old, following)
    for X in at_the_keyframe.motions_K:
        np.testing.assert_allclose(X, np.eye(4), atol=1e-12)


def carried(
    old_borders, old_evidence, old_body, new_borders, origin, prior=2.0, across=None, length=None, over=False
):
    """Evidence for new borders; 4 nats would be against what never met, 1 for what was one body."""
    keyframe = SimpleNamespace(
        borders=np.array(old_borders),
        count=len(old_body),
        length=np.ones(len(old_borders)) if length is None else np.array(length),
    )
    evidence = np.array(old_evidence, float)
    was = np.full(len(evidence), 2.0)
    old = SimpleNamespace(keyframe=keyframe, prior=was, evidence=evidence, body=old_body)
    across = np.zeros(len(new_borders), bool) if across is None else np.array(across)
    new = SimpleNamespace(borders=np.array(new_borders), across=across, over=np.full(len(across), over))
    return carried_evidence(old, new, np.full(len(new_borders), prior), origin, BeliefParameters(inside=2.0))


def test_what_a_body_uncovers_is_not_that_body_and_may_be_one_that_stood_beside_it():
    # 0 moved, 1 stood, 2 has never moved, 3 and 4 are uncovered.
    borders = [[0, 1], [0, 3], [1, 3], [2, 3], [3, 4]]
    body = np.array([5, 6, 0, 0, 0])
    origin = Origin(source=np.array([0, 1, 2, -1, -1]), body=body, moved=np.arange(5) == 0)
    evidence = carried([[0, 1]], [-7.0], body[:3], borders, origin)
    assert evidence == pytest.approx([-7.0, -4.0, 0.0, 0.0, 0.0])


def test_of_two_bodies_all_that_was_seen_between_them_is_remembered_wherever_they_meet_now():
    # 0 and 1 were the body 5, 2 and 3 the body 6; what meets now are the ends that did not touch, 0 and 3.
    body = np.array([5, 5, 6, 6])
    origin = Origin(source=np.arange(4), body=body, moved=np.ones(4, bool))
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
    origin = Origin(source=np.array([0, -1, -1]), body=body, moved=np.ones(3, bool))
    evidence = carried([[0, 1], [1, 2]], [1.0, 1.0], body, [[0, 1], [0, 2]], origin, -1.5, [True, False])
    assert evidence + -1.5 == pytest.approx([1.0, -0.5])


def test_what_is_uncovered_takes_the_id_of_most_of_its_part_and_what_was_known_keeps_its_own():
    part = np.array([0, 0, 0, 1, 1, 2, 2])
    body = np.array([4, 0, 0, 5, 0, 6, 0])
    known = np.array([True, True, False, True, False, True, False])
    area = np.array([30, 10, 10, 10, 11, 11, 10])
    np.testing.assert_array_equal(completed(body, known, part, area), [4, 0, 4, 5, 0, 6, 6])


def test_a_border_is_remembered_by_both_its_sides_whichever_way_round_and_whatever_its_number():
    # Five superpixels in a new order: 4 was 0, 3 was 1, and so on; each old border has evidence of its own.
    old_borders = [[0, 1], [0, 2], [1, 3], [2, 3], [2, 4], [3, 4]]
    evidence = np.array([1.0, -2.0, 3.0, -4.0, 5.0, -6.0])
    origin = Origin(source=np.arange(5)[::-1], body=np.zeros(5, int), moved=np.zeros(5, bool))
    new_borders = sorted(sorted(4 - side for side in border) for border in old_borders)
    told = carried(old_borders, evidence, np.zeros(5, int), new_borders, origin)
    expected = [evidence[old_borders.index(sorted(4 - side for side in border))] for border in new_borders]
    assert told == pytest.approx(expected)


def test_what_was_one_superpixel_is_one_and_what_was_not_a_border_is_by_its_bodies():
    # 0 and 1 were one; 1 and 2 never touched, and are bodies 5 and 6; 2 and 3 never touched and are body 6.
    origin = Origin(np.array([0, 0, 1, 2]), np.array([5, 5, 6, 6]), np.ones(4, bool))
    told = carried([[0, 3]], [9.0], np.array([5, 6, 6, 0]), [[0, 1], [1, 2], [2, 3]], origin)
    assert told == pytest.approx([2.0, -4.0, 1.0])


def test_a_gap_that_was_seen_once_is_remembered_when_it_has_closed():
    origin = Origin(np.array([0, 1]), np.zeros(2, int), np.zeros(2, bool))
    for prior, remembered in ((2.0, 3.0), (2.5, 2.5), (1.0, 3.0)):  # it was 2 in the old picture
        told = carried([[0, 1]], [3.0], np.zeros(2, int), [[0, 1]], origin, prior=prior)
        assert told == pytest.approx([remembered])


def test_what_was_known_of_no_body_says_nothing_of_what_comes_into_sight():
    origin = Origin(np.array([0, -1, -1]), np.zeros(3, int), np.zeros(3, bool))
    assert carried([[0, 1]], [3.0], np.zeros(2, int), [[1, 2]], origin) == pytest.approx([0.0])


def test_the_value_that_a_superpixel_shows_most_is_told():
    label = np.array([[0, 0, 0, 1], [0, 0, 1, 1], [-1, 2, 2, 2]])
    image = np.zeros((4, 6), int)
    image[1:, 2:] = [[7, 7, 3, 9], [7, 3, 9, 0], [5, 0, 0, 4]]
    keyframe = SimpleNamespace(
        superpixels=SimpleNamespace(label=label), region=(slice(1, 4), slice(2, 6)), count=3
    )
    assert _most_seen(keyframe, image).tolist() == [7, 9, 0]
