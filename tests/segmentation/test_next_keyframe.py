"""What is believed of a keyframe by what was believed of the one before."""

from types import SimpleNamespace

import numpy as np
import pytest

from riseg_drake.geometry.se3 import translation
from riseg_drake.segmentation import next_keyframe as module
from riseg_drake.segmentation.belief import Belief, BeliefParameters
from riseg_drake.segmentation.bodies import Bodies
from riseg_drake.segmentation.next_keyframe import _most_seen, completed, next_belief
from riseg_drake.segmentation.observation import Observation
from riseg_drake.segmentation.propagation import UNKNOWN

STILL_AND_MOVED = np.array([np.eye(4), translation(np.array([0.02, 0, 0]))])


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


@pytest.mark.parametrize(
    ("watched", "once", "evidence", "alike", "arrives"),
    [
        # It adds up to no more than 12 nats either way, and what moved alike before and now counts once.
        (True, True, [12.0, -12.0, 1.0], [2.0, 1.0, 0.75], False),
        (True, False, [12.0, -12.0, 1.25], [2.0, 0.0, 0.25], False),
        (False, True, [11.5, -11.5, 1.0], [0.5, 1.0, 0.75], True),
    ],
)
def test_a_new_keyframe_knows_its_superpixels_by_what_the_old_ones_carry_and_what_is_remembered(
    monkeypatch, watched, once, evidence, alike, arrives
):
    """Four superpixels: the old 0, body 5, which moved, 1, which stood, 7 of memory, and nothing; 2 is gone."""
    of_the_old = np.tile(np.array([1, 2, 0, UNKNOWN], np.uint16), (2, 1))
    remembered = np.tile(np.array([0, 9, 7, UNKNOWN], np.uint16), (2, 1))
    old = Belief(
        SimpleNamespace(count=3, borders=np.array([[0, 1], [0, 2], [1, 2]])),
        np.zeros(3),
        np.array([11.5, -11.5, 1.0]),
        np.array([0.5, 1.0, 0.75]),
        np.zeros(3),
        np.array([0, 1, 0]),
        6,
        np.zeros((6, 6)),
        np.arange(3),
        np.full(3, 3.0),
        np.arange(3)[None],
    )
    ids = np.array([5, 0, 6])
    bodies = Bodies(ids, np.array([1, 0, 1]), STILL_AND_MOVED, 8, np.zeros((8, 8)), ids)
    new = SimpleNamespace(
        superpixels=SimpleNamespace(label=np.tile(np.arange(4), (2, 1))),
        region=(slice(0, 2), slice(0, 4)),
        count=4,
        area=np.array([2, 2, 3, 2]),
        edges="edges",
        borders="borders",
        pixels_per_metre=1.0,
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
        return np.array([0.5]), np.array([0.25]), np.array([0.125])

    def in_sight(old, new, source, motion, motions_K):
        assert motions_K is STILL_AND_MOVED
        return old, new, source.tolist(), motion[:2].tolist(), list(range(len(motions_K)))

    def parts_by(keyframe, bond, parameters, known):
        given["known"] = known
        return parts

    # The last superpixel is of the same part as the one before, or a part of its own that came since.
    parts = np.array([0, 1, 2, 3 if arrives else 2])

    def come(old, new):
        given["come"] = (old, new)
        return np.full(4, arrives)

    monkeypatch.setattr(module, "have_come", come)
    monkeypatch.setattr(module, "carry_superpixels", carry)
    monkeypatch.setattr(module, "make_keyframe", keyframe)
    monkeypatch.setattr(module, "border_prior", lambda *_: np.array([1.0]))
    monkeypatch.setattr(module, "carried_evidence", evidence_for)
    monkeypatch.setattr(module, "were_in_sight", in_sight)
    monkeypatch.setattr(module, "partition", parts_by)
    monkeypatch.setattr(module, "freedoms_shown", lambda *given: given)
    said, strangers = np.array([2.0, -2.0, 0.25]), np.zeros(3, bool)
    seen = Observation(*[None] * 3, said, *[None] * 2, strangers) if watched else None
    belief = next_belief(old, seen, bodies, frame, None, remembered, None, BeliefParameters(once=once))
    assert given["label"] == [1, 2, 3]
    assert given["come"] == (old.keyframe, new)
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
    assert (belief.prior.tolist(), belief.evidence.tolist(), belief.next_id) == ([1.0], [0.5], 8 + arrives)
    assert (belief.alike.tolist(), belief.inherited.tolist()) == ([0.25], [0.125])
    edges, gray, part, borders = belief.shown
    assert (edges, gray, part.tolist(), borders) == ("edges", "gray", parts.tolist(), "borders")
    # What nothing is known of is of the part that it is in, or, if all of that came, a body of its own; what
    # stood there before did not come.
    assert belief.body.tolist() == [5, 0, 7, 8 if arrives else 7]
    assert belief.told.shape == (8 + arrives, 8 + arrives)
    assert belief.finer.shape == (3, 4)
