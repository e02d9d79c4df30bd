"""What a segmentation says of its ids."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from riseg_drake.segmentation.partition import Margins
from riseg_drake.segmentation.propagation import UNKNOWN
from riseg_drake.segmentation.segmentation import Segmentation, nothing_segmented

LABEL = np.array([[0, UNKNOWN, 3], [7, 7, 9]], np.uint16)


def sure(by):
    """Margins that are as wide to both sides."""
    return Margins(by, by)


def test_the_mask_has_the_ids_and_nothing_of_what_has_not_moved():
    assert Segmentation(0, LABEL).mask.tolist() == [[0, 0, 3], [7, 7, 9]]


def test_what_is_in_doubt_by_less_than_the_settled_margin_is_not_in_the_settled_mask():
    seen = Segmentation(0, LABEL, margins=sure({3: 1.9, 7: 2.0, 9: 2.1}), settled=2.0)
    assert seen.settled_mask.tolist() == [[0, 0, 0], [7, 7, 9]]


def test_an_id_that_no_rest_has_decided_on_is_in_doubt_but_not_one_that_comes_back_into_view():
    seen = Segmentation(0, LABEL, margins=sure({3: 2.5}), settled=2.0)
    assert seen.settled_mask.tolist() == [[0, 0, 3], [0, 0, 0]]
    assert replace(seen, memory={7: None}).settled_mask.tolist() == [[0, 0, 3], [7, 7, 0]]
    assert replace(seen, memory={3: None}, margins=sure({3: 1.9})).settled_mask.tolist() == [
        [0, 0, 0],
        [0, 0, 0],
    ]


def test_where_nothing_tells_of_doubt_as_in_the_paper_every_id_is_settled():
    assert Segmentation(0, LABEL).settled_mask.tolist() == [[0, 0, 3], [7, 7, 9]]


def test_confidence_is_a_half_at_half_the_settled_margin_and_rises_with_it():
    seen = Segmentation(0, LABEL, margins=sure({3: 1.0, 7: 2.0, 9: 0.0}), settled=2.0)
    # log(p / (1 - p)) = 2 margin - settled.
    assert seen.confidence == pytest.approx({3: 0.5, 7: 1 / (1 + np.exp(-2)), 9: 1 / (1 + np.exp(2))})
    assert seen.untouched_confidence == pytest.approx(1 / (1 + np.exp(2)))


def test_ids_are_those_of_the_newest_bodies_of_the_mask_and_of_what_is_remembered():
    belief = SimpleNamespace(body=np.array([0, 4, 5]), next_id=8)
    bodies = {3: SimpleNamespace(body=np.array([0, 1])), 8: SimpleNamespace(body=np.array([0, 6, 6]))}
    assert Segmentation(9, LABEL, belief=belief).object_ids == (3, 4, 5, 7, 9)
    assert Segmentation(9, LABEL, belief=belief, bodies=bodies).object_ids == (3, 6, 7, 9)
    assert Segmentation(9, LABEL, memory={2: None}).object_ids == (2, 3, 7, 9)


def test_what_no_rest_has_decided_on_is_an_object_only_where_the_mask_shows_it():
    belief = SimpleNamespace(body=np.array([0, 4, 5]), next_id=6)
    bodies = {8: SimpleNamespace(body=np.array([4, 6, 9]))}  # of 6 and 9 the mask shows 9 alone
    assert Segmentation(9, LABEL, belief=belief, bodies=bodies).object_ids == (3, 4, 7, 9)


def test_before_the_first_frame_there_is_an_empty_mask():
    before = nothing_segmented((2, 3))
    assert before.sequence == -1
    assert before.mask.tolist() == [[0, 0, 0]] * 2
    assert before.object_ids == ()
