"""What is kept of bodies when the keyframe changes."""

from types import SimpleNamespace

import numpy as np
import pytest

from riseg_drake.geometry.se3 import exp_se3, inverse, translation
from riseg_drake.segmentation import belief as module
from riseg_drake.segmentation.belief import (
    Belief,
    BeliefParameters,
    Bodies,
    _most_seen,
    bodies_of,
    completed,
    next_belief,
    rebased,
)
from riseg_drake.segmentation.observation import Observation, ObservationParameters
from riseg_drake.segmentation.propagation import UNKNOWN


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


def test_what_is_uncovered_takes_the_id_of_most_of_its_part_and_what_was_known_keeps_its_own():
    part = np.array([0, 0, 0, 1, 1, 2, 2])
    body = np.array([4, 0, 0, 5, 0, 6, 0])
    known = np.array([True, True, False, True, False, True, False])
    area = np.array([30, 10, 10, 10, 11, 11, 10])
    np.testing.assert_array_equal(completed(body, known, part, area), [4, 0, 4, 5, 0, 6, 6])


def test_the_value_that_a_superpixel_shows_most_is_told():
    label = np.array([[0, 0, 0, 1], [0, 0, 1, 1], [-1, 2, 2, 2]])
    image = np.zeros((4, 6), int)
    image[1:, 2:] = [[7, 7, 3, 9], [7, 3, 9, 0], [5, 0, 0, 4]]
    keyframe = SimpleNamespace(
        superpixels=SimpleNamespace(label=label), region=(slice(1, 4), slice(2, 6)), count=3
    )
    assert _most_seen(keyframe, image).tolist() == [7, 9, 0]


STILL_AND_MOVED = np.array([np.eye(4), translation(np.array([0.02, 0, 0]))])


def a_row_of_four(body, next_id=3, across=(False, False, False), area=(100, 100, 100, 100)):
    """A belief of four superpixels in a row, of which the first two move and the others stand still."""
    keyframe = SimpleNamespace(
        count=4,
        borders=np.array([[0, 1], [1, 2], [2, 3]]),
        length=np.array([10.0, 20.0, 10.0]),
        area=np.array(area),
        across=np.array(across),
        pixels_per_metre=1.0,
    )
    belief = Belief(
        keyframe=keyframe,
        prior=np.array([2.0, -1, 2]),
        evidence=np.zeros(3),
        alike=np.zeros(3),
        body=np.array(body),
        next_id=next_id,
        part=np.arange(4),
        shown=np.full(3, 3.0),
        finer=np.zeros((0, 4), int),
    )
    nats = np.array([[50.0, 50, 0, 0], [0, 0, 50, 50]])
    said = np.array([0.1, -0.2, 0.3])
    seen = Observation(STILL_AND_MOVED, np.array([1, 1, 0, 0]), nats, said, np.ones(4), np.full(2, 0.5))
    return belief, seen


def told(belief, seen, before=None):
    return bodies_of(belief, seen, before, BeliefParameters(), ObservationParameters())


def test_what_has_no_one_motion_speaks_against_the_border_between_its_parts_by_its_length():
    seen, bodies = told(*a_row_of_four([0, 0, 0, 0]))
    # One motion costs both parts 100 nats, of which 60 are free: 40 over 20 pixels of border.
    np.testing.assert_allclose(seen.evidence, [0.1, -0.2 - 2.0, 0.3])
    assert (bodies.motion.tolist(), bodies.body.tolist(), bodies.next_id) == ([1, 1, 0, 0], [3, 3, 0, 0], 4)
    np.testing.assert_array_equal(bodies.motions_K, STILL_AND_MOVED)


@pytest.mark.parametrize(("area", "kept"), [((100, 100, 101, 99), 1), ((100, 100, 100, 100), 0)])
def test_what_has_moved_before_by_more_than_half_of_its_area_is_a_body_though_it_stands_still(area, kept):
    _, bodies = told(*a_row_of_four([0, 0, 1, 0], area=area))
    assert bodies.body.tolist() == [3, 3, kept, kept]


@pytest.mark.parametrize(
    ("before", "next_id", "ids", "following"),
    [
        ([5, 5, 0, 0], 3, [5, 5, 0, 0], 6),  # it is what it was in the frame before
        ([0, 0, 0, 7], 3, [8, 8, 0, 0], 9),  # 7 is gone, and nobody else's
        ([0, 0, 0, 7], 9, [9, 9, 0, 0], 10),
    ],
)
def test_ids_are_those_of_the_frame_before_and_new_ones_nobodys(before, next_id, ids, following):
    before = Bodies(np.array(before), np.zeros(4, int), STILL_AND_MOVED, 99)
    _, bodies = told(*a_row_of_four([0, 0, 0, 0], next_id), before)
    assert (bodies.body.tolist(), bodies.next_id) == (ids, following)


def test_across_a_gap_all_of_both_parts_says_what_they_are_and_elsewhere_each_superpixel(monkeypatch):
    monkeypatch.setattr(module, "evidence_of_parts", lambda *_: np.array([9.0, -3.0, 9.0]))
    seen, _ = told(*a_row_of_four([0, 0, 0, 0], across=(False, True, False)))
    np.testing.assert_allclose(seen.evidence, [0.1, -3.0 - 2.0, 0.3])


@pytest.mark.parametrize(
    ("watched", "once", "evidence", "alike"),
    [
        # It adds up to no more than 12 nats either way, and what moved alike before and now counts once.
        (True, True, [12.0, -12.0, 1.0], [2.0, 1.0, 0.75]),
        (True, False, [12.0, -12.0, 1.25], [2.0, 0.0, 0.25]),
        (False, True, [11.5, -11.5, 1.0], [0.5, 1.0, 0.75]),
    ],
)
def test_a_new_keyframe_knows_its_superpixels_by_what_the_old_ones_carry_and_what_is_remembered(
    monkeypatch, watched, once, evidence, alike
):
    """Four superpixels: the old 0, body 5, which moved, 1, which stood, 7 of memory, and nothing; 2 is gone."""
    of_the_old = np.tile(np.array([1, 2, 0, UNKNOWN], np.uint16), (2, 1))
    remembered = np.tile(np.array([0, 9, 7, UNKNOWN], np.uint16), (2, 1))
    old = Belief(
        SimpleNamespace(count=3),
        np.zeros(3),
        np.array([11.5, -11.5, 1.0]),
        np.array([0.5, 1.0, 0.75]),
        np.array([0, 1, 0]),
        6,
        np.arange(3),
        np.full(3, 3.0),
        np.arange(3)[None],
    )
    bodies = Bodies(np.array([5, 0, 6]), np.array([1, 0, 1]), STILL_AND_MOVED, 8)
    new = SimpleNamespace(
        superpixels=SimpleNamespace(label=np.tile(np.arange(4), (2, 1))),
        region=(slice(0, 2), slice(0, 4)),
        count=4,
        area=np.array([2, 2, 3, 2]),
        edges="edges",
        borders="borders",
    )
    frame = SimpleNamespace(gray="gray")
    given = {}

    def carry(belief, label, moves, *_):
        given.update(label=label.tolist(), moves=moves)
        return of_the_old

    def keyframe(frame, above, noise, parameters, ids):
        given["ids"] = ids
        return new

    def evidence_for(old, keyframe, prior, origin, inside):
        given.update(old=old, origin=origin)
        return np.array([0.5]), np.array([0.25])

    def in_sight(old, new, source, motion, motions_K):
        assert motions_K is STILL_AND_MOVED
        return old, new, source.tolist(), motion[:2].tolist(), list(range(len(motions_K)))

    monkeypatch.setattr(module, "_carry", carry)
    monkeypatch.setattr(module, "make_keyframe", keyframe)
    monkeypatch.setattr(module, "border_prior", lambda *_: np.array([1.0]))
    monkeypatch.setattr(module, "carried_evidence", evidence_for)
    monkeypatch.setattr(module, "were_in_sight", in_sight)
    monkeypatch.setattr(module, "partition", lambda keyframe, bond, parameters: np.array([0, 1, 2, 2]))
    monkeypatch.setattr(module, "freedoms_shown", lambda *given: given)
    seen = Observation(*[None] * 3, np.array([2.0, -2.0, 0.25]), *[None] * 2) if watched else None
    belief = next_belief(old, seen, bodies, frame, None, remembered, None, BeliefParameters(once=once))
    assert given["label"] == [1, 2, 3]
    assert list(given["moves"]) == [1, 3]
    np.testing.assert_array_equal(given["moves"][1], STILL_AND_MOVED[1])
    np.testing.assert_array_equal(given["ids"], np.tile([5, 0, 7, 0], (2, 1)))
    origin = given["origin"]
    assert origin.source.tolist() == [0, 1, -1, -1]
    assert origin.body.tolist() == [5, 0, 7, 0]
    assert origin.in_sight == (old.keyframe, new, [0, 1, -1, -1], [1, 0], [0, 1])
    np.testing.assert_array_equal(given["old"].evidence, evidence)
    np.testing.assert_array_equal(given["old"].alike, alike)
    np.testing.assert_array_equal(given["old"].body, [5, 0, 6])
    assert belief.keyframe is new
    assert (belief.prior.tolist(), belief.evidence.tolist(), belief.next_id) == ([1.0], [0.5], 8)
    assert belief.alike.tolist() == [0.25]
    edges, gray, part, borders = belief.shown
    assert (edges, gray, part.tolist(), borders) == ("edges", "gray", [0, 1, 2, 2], "borders")
    # What nothing is known of is of the part that it is in.
    assert belief.body.tolist() == [5, 0, 7, 7]
    assert belief.finer.shape == (3, 4)
