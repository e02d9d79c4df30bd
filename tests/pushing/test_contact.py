import numpy as np
import pytest

from riseg_drake.pushing.contact import find_contacts
from riseg_drake.pushing.pusher import Pusher
from riseg_drake.pushing.validity import ValidityParameters
from tests.pushing.bar import BAR

ALONG_X = np.array([[1.0, 0.0]])


def contact_of(drawn, cluster, boundary_W):
    return find_contacts(
        np.array([boundary_W]), ALONG_X, cluster, drawn.map(), Pusher(BAR), ValidityParameters()
    )


def test_bar_touches_what_protrudes_within_its_width(drawn):
    drawn.box(0.52, 0.0, 0.04, 0.04).box(0.495, 0.012, 0.011, 0.006)  # a nose, 1 cm long, off centre
    contact = contact_of(drawn, drawn.objects.copy(), [0.5, 0.0])
    assert contact.b_W[0] == pytest.approx([0.49, 0.0], abs=0.002)
    assert contact.face[0] < 0.4


def test_bar_meets_a_face_with_all_its_width(drawn):
    drawn.box(0.52, 0.0, 0.04, 0.04)
    contact = contact_of(drawn, drawn.objects.copy(), [0.5, 0.0])
    assert contact.b_W[0] == pytest.approx([0.5, 0.0], abs=0.002)
    assert contact.face[0] > 0.95


@pytest.mark.parametrize(
    ("height", "tip"), [(0.10, 0.008), (0.015, 0.00675), (0.010, 0.0045), (0.005, 0.00225)]
)
def test_tip_is_below_the_middle_of_low_objects(drawn, height, tip):
    drawn.box(0.52, 0.0, 0.04, 0.04, height=height)
    contact = contact_of(drawn, drawn.objects.copy(), [0.5, 0.0])
    assert contact.high_enough[0]
    assert contact.tip_height[0] == pytest.approx(tip)


def test_thing_too_low_for_the_bar_is_not_touched(drawn):
    drawn.box(0.52, 0.0, 0.04, 0.04, height=0.004)
    assert not contact_of(drawn, drawn.objects.copy(), [0.5, 0.0]).high_enough[0]


@pytest.mark.parametrize(
    ("x", "segmented", "clear"),
    [(0.495, False, False), (0.507, True, False), (0.507, False, True), (0.55, True, True)],
    ids=["before the contact", "known, beside the stroke", "unknown, beside the stroke", "beyond"],
)
def test_bar_may_meet_only_what_it_is_to_push(drawn, x, segmented, clear):
    drawn.box(0.52, -0.01, 0.04, 0.03)
    cluster = drawn.objects.copy()
    drawn.box(x, 0.012, 0.006, 0.006, segmented=segmented)
    contact = contact_of(drawn, cluster, [0.5, 0.0])
    assert bool(contact.only_target[0]) is clear


def pushed_through(drawn, gap, through):
    """What arrives at a box of 4 cm of a push by way of another one, `through` deep and `gap` before it."""
    drawn.box(0.52, 0.0, 0.04, 0.04)
    target = drawn.objects.copy()
    edge = 0.5 - gap
    table = drawn.box(edge - through / 2, 0.0, through, 0.04).map()
    boundary_W = np.array([[edge - through, 0.0]])
    contacts = find_contacts(
        boundary_W, ALONG_X, table.objects, table, Pusher(BAR), ValidityParameters(), target=target
    )
    assert contacts.b_W[0] == pytest.approx(boundary_W[0], abs=0.003)
    return contacts.transmitted[0]


@pytest.mark.parametrize(("gap", "through", "share"), [(0, 0.03, 0.5), (0.01, 0.03, 0.25), (0.02, 0.03, 0)])
def test_gaps_and_things_between_take_their_share_of_a_push(drawn, gap, through, share):
    assert pushed_through(drawn, gap, through) == pytest.approx(share, abs=0.06)


def test_all_of_a_push_arrives_at_what_is_touched(drawn):
    drawn.box(0.52, 0.0, 0.04, 0.04)
    assert contact_of(drawn, drawn.objects.copy(), [0.5, 0.0]).transmitted[0] == 1.0
