"""IsValidPush: a push that is valid, and the same push with one criterion failing at a time."""

import numpy as np
import pytest

from riseg_drake.pushing.pusher import Pusher
from riseg_drake.pushing.validity import ValidityParameters, is_valid_push, overlap_after_push
from tests.pushing.bar import BAR

ALONG_X = np.array([[1.0, 0.0]])
B = np.array([[0.48, 0.0]])
CENTER = np.array([0.5, 0.0])


def judge(drawn, cluster, center_W=CENTER):
    return is_valid_push(B, ALONG_X, center_W, cluster, drawn.map(), Pusher(BAR), ValidityParameters())


@pytest.fixture
def box(drawn):
    """A box of 4 cm, alone on the table; the push comes from the left."""
    drawn.box(0.5, 0.0, 0.04, 0.04)
    return drawn.objects.copy()


def criteria(validity):
    return [bool(c[0]) for c in (validity.center_on_object, validity.accessible, validity.moves_alone)]


def test_push_of_a_lone_box_is_valid(drawn, box):
    validity = judge(drawn, box)
    assert validity.valid.all()


def test_center_beside_the_object_fails_the_first_criterion_alone(drawn, box):
    hole = np.linalg.norm(drawn.centres() - CENTER, axis=-1) < 0.01
    drawn.objects[hole] = False
    validity = judge(drawn, box & ~hole)
    assert criteria(validity) == [False, True, True]


def test_obstacle_where_the_end_effector_would_stand_fails_the_second_criterion_alone(drawn, box):
    drawn.box(0.455, 0.012, 0.01, 0.01)
    validity = judge(drawn, box)
    assert criteria(validity) == [True, False, True]


def test_obstacle_ahead_of_the_object_fails_the_third_criterion_alone(drawn, box):
    drawn.box(0.545, 0.0, 0.04, 0.04)
    validity = judge(drawn, box)
    assert criteria(validity) == [True, True, False]


@pytest.mark.parametrize(("gap", "valid"), [(0.010, True), (0.005, False)])
def test_threshold_of_the_third_criterion_is_three_tenths(drawn, box, gap, valid):
    # Pushed by 2 cm, the 4 cm box covers 2 cm - gap of its neighbour: 1/4 or 3/8 of itself.
    drawn.box(0.52 + gap + 0.03, 0.0, 0.06, 0.08)
    validity = judge(drawn, box)
    assert validity.overlap[0] == pytest.approx((0.02 - gap) / 0.04, abs=0.06)
    assert bool(validity.valid[0]) is valid


def test_overlap_counts_other_objects_only(drawn, box):
    directions = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]])
    assert (overlap_after_push(directions, box, drawn.map(), 0.02) == 0.0).all()


def test_area_the_end_effector_needs_turns_with_the_push(drawn, box):
    drawn.box(0.455, 0.012, 0.01, 0.01)
    b_W, direction_W = np.array([[0.5, -0.02]]), np.array([[0.0, 1.0]])
    validity = is_valid_push(b_W, direction_W, CENTER, box, drawn.map(), Pusher(BAR), ValidityParameters())
    assert validity.valid.all()
