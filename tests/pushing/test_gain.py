"""What is expected of a push: one chance at a time."""

import numpy as np
import pytest

from riseg_drake.pushing.contact import find_contacts
from riseg_drake.pushing.gain import GainParameters, expected_gain
from riseg_drake.pushing.pusher import Pusher
from riseg_drake.pushing.tried_pushes import KnownScene, TriedPush
from riseg_drake.pushing.validity import ValidityParameters, overlap_after_push

ALONG_X = np.array([[1.0, 0.0]])


@pytest.fixture
def box(drawn):
    """A box of 4 cm at (0.52, 0), alone on the table."""
    drawn.box(0.52, 0.0, 0.04, 0.04, height=0.03)
    return drawn.objects.copy()


def gain_of(drawn, cluster, tried=(), tries=0, heading_W=None):
    """Of the push from the left."""
    table, validity = drawn.map(), ValidityParameters()
    contacts = find_contacts(np.array([[0.5, 0.0]]), ALONG_X, cluster, table, Pusher(), validity)
    overlap = overlap_after_push(ALONG_X, cluster, table, validity.d_push)
    (gain,) = expected_gain(
        contacts,
        ALONG_X,
        overlap,
        cluster,
        tries,
        KnownScene(table, tried, heading_W),
        validity,
        GainParameters(),
    )
    return gain


def test_a_lone_thing_is_worth_the_chance_that_it_is_an_object(drawn, box):
    assert gain_of(drawn, box) == pytest.approx(16 / (16 + 10), abs=0.03)


def test_a_sliver_is_worth_little(drawn):
    drawn.box(0.52, 0.0, 0.04, 0.008)
    assert gain_of(drawn, drawn.objects.copy()) < 0.3


def test_each_push_that_left_it_halves_it_and_two_are_enough(drawn, box):
    alone = gain_of(drawn, box)
    assert gain_of(drawn, box, tries=1) == pytest.approx(alone / 2)
    assert gain_of(drawn, box, tries=2) == 0.0


def test_what_would_be_pushed_onto_others_is_worth_less(drawn, box):
    alone = gain_of(drawn, box)
    drawn.box(0.57, 0.0, 0.04, 0.04)  # after 2 cm a quarter of the box lies on it, after 4 cm three quarters
    assert gain_of(drawn, box) == pytest.approx(alone * np.exp(-0.5 / 0.3), rel=0.15)


def test_what_moves_along_beside_it_is_worth_less(drawn):
    drawn.box(0.52, 0.0, 0.04, 0.02, height=0.03)
    narrow = drawn.objects.copy()
    alone = gain_of(drawn, narrow)
    drawn.box(0.52, 0.02, 0.04, 0.02, height=0.03)  # 7.5 mm of the 3.5 cm that the bar with its margin needs
    assert gain_of(drawn, narrow) == pytest.approx(alone * (1 - 7.5 / 35), rel=0.1)


def test_a_tall_narrow_thing_is_worth_less(drawn):
    low = gain_of(drawn, drawn.box(0.52, 0.0, 0.04, 0.04, height=0.04).objects.copy())
    tall = gain_of(drawn, drawn.box(0.52, 0.0, 0.04, 0.04, height=0.12).objects.copy())
    assert tall == pytest.approx(low / 3, rel=0.1)


def test_turning_the_camera_costs(drawn, box):
    ahead, back = (gain_of(drawn, box, heading_W=np.array([x, 0.0])) for x in (1.0, -1.0))
    assert back == pytest.approx(0.7 * ahead)


def test_the_same_push_is_refused_only_where_it_changed_nothing(drawn, box):
    nearly = np.array([0.5, 0.012, 0.02])
    in_vain = gain_of(drawn, box, [TriedPush(nearly, ALONG_X[0], changed=False)])
    brought = gain_of(drawn, box, [TriedPush(nearly, ALONG_X[0], changed=True)])
    assert in_vain == 0.0
    assert 0.0 < brought < 0.2 * gain_of(drawn, box)
