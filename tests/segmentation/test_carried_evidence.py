"""What is known of borders, carried to a new keyframe: by hand, on a few superpixels."""

from types import SimpleNamespace

import numpy as np
import pytest

from riseg_drake.segmentation.carried_evidence import KnownBorders, Origin, carried_evidence


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
):
    """Evidence for new borders; 4 nats would be against what never met, 1 for what was one body. With `alike`,
    how much of it as both sides moved alike."""
    keyframe = SimpleNamespace(
        borders=np.array(old_borders),
        count=len(old_body),
        length=np.ones(len(old_borders)) if length is None else np.array(length),
    )
    evidence = np.array(old_evidence, float)
    was = np.full(len(evidence), 2.0)
    of_it = np.zeros(len(evidence)) if alike is None else np.array(alike)
    old = KnownBorders(keyframe, was, evidence, of_it, old_body)
    across = np.zeros(len(new_borders), bool) if across is None else np.array(across)
    new = SimpleNamespace(borders=np.array(new_borders), across=across, over=np.full(len(across), over))
    told = carried_evidence(old, new, np.full(len(new_borders), prior), origin, inside=2.0)
    return told[0] if alike is None else told[1]


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


def test_that_both_sides_moved_alike_is_remembered_of_a_border_and_of_all_borders_of_two_bodies():
    # 0 and 1 were the body 5, 2 and 3 the body 6; 0 and 3 meet now, 1 and 2 still do, 4 is uncovered.
    body = np.array([5, 5, 6, 6])
    origin = Origin(np.array([0, 1, 2, 3, -1]), np.array([5, 5, 6, 6, 0]), np.ones(5, bool))
    met, new = [[0, 1], [0, 2], [1, 2], [2, 3]], [[0, 3], [1, 2], [0, 1], [3, 4]]
    told = carried(
        met, [9.0, 9.0, 9.0, 9.0], body, new, origin, length=[1, 1, 3, 1], alike=[1.2, 0.4, 0.8, 0.2]
    )
    assert told == pytest.approx([(1 * 0.4 + 3 * 0.8) / 4, 0.8, 1.2, 0.0])


def test_inside_one_body_nothing_is_remembered_as_alike_but_of_its_own_borders():
    origin = Origin(np.array([0, 0, 1]), np.array([5, 5, 5]), np.ones(3, bool))
    told = carried([[0, 1]], [3.0], np.array([5, 5]), [[0, 1], [1, 2], [0, 2]], origin, alike=[1.5])
    assert told == pytest.approx([0.0, 1.5, 1.5])
