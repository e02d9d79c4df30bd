"""What is expected of a push: one chance at a time."""

import numpy as np
import pytest

from riseg_drake.pushing.contact import Contacts, find_contacts
from riseg_drake.pushing.gain import GainParameters, expected_gain, most_to_expect
from riseg_drake.pushing.pusher import Pusher
from riseg_drake.pushing.tried_pushes import KnownScene, TriedPush
from riseg_drake.pushing.validity import ValidityParameters, overlap_after_push
from tests.pushing.bar import BAR

ALONG_X = np.array([[1.0, 0.0]])


@pytest.fixture
def box(drawn):
    """A box of 4 cm at (0.52, 0), alone on the table."""
    drawn.box(0.52, 0.0, 0.04, 0.04, height=0.03)
    return drawn.objects.copy()


def gain_of(drawn, cluster, tried=(), tries=0, heading_W=None):
    """Of the push from the left."""
    table, validity = drawn.map(), ValidityParameters()
    contacts = find_contacts(np.array([[0.5, 0.0]]), ALONG_X, cluster, table, Pusher(BAR), validity)
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


def candidates(**changed):
    """Two pushes of which the first is as good as can be, and of which the second has what is said."""
    best = {
        "b_W": [0.5, 0.0],
        "height": 0.03,
        "face": 1.0,
        "tip_height": 0.008,
        "high_enough": True,
        "only_target": True,
        "beside_target": 0.0,
        "unseen": 0.0,
        "transmitted": 1.0,
    }
    return Contacts(**{name: np.array([good, changed.get(name, good)]) for name, good in best.items()})


def gains(drawn, contacts, directions=((1.0, 0.0), (1.0, 0.0)), overlap=(0.0, 0.0), **scene):
    scene = {"tried": (), "heading_W": None, **scene}
    known = KnownScene(drawn.map(), scene["tried"], scene["heading_W"])
    return expected_gain(
        contacts,
        np.array(directions),
        np.array(overlap),
        drawn.objects.copy(),
        0,
        known,
        ValidityParameters(),
        GainParameters(),
    )


@pytest.mark.parametrize(
    ("changed", "factor"),
    [
        ({"beside_target": 0.25}, 0.75),
        ({"transmitted": 0.4}, 0.4),
        ({"face": 0.25}, 1 - 0.2 * 0.75),
        ({"unseen": 0.5}, 1 - 0.3 * 0.5),
        ({"face": 0.0, "unseen": 1.0, "transmitted": 0.5}, 0.8 * 0.7 * 0.5),
    ],
)
def test_chances_multiply(drawn, box, changed, factor):
    best, other = gains(drawn, candidates(**changed))
    assert other / best == pytest.approx(factor)


def test_a_crowd_counts_by_the_mean_of_what_is_met_after_the_push_and_after_twice_as_far(drawn, box):
    # Nothing is met after 4 cm; what is said of 2 cm counts by half, against 30 % that may be met.
    best, other = gains(drawn, candidates(), overlap=(0.0, 0.12))
    assert other / best == pytest.approx(np.exp(-0.06 / 0.3))


def test_a_thing_is_as_narrow_as_it_is_along_the_push_a_cell_included(drawn):
    drawn.box(0.52, 0.0, 0.0401, 0.0201, height=0.05)  # 21 and 11 cells of 2 mm
    along, across = gains(drawn, candidates(), directions=((1.0, 0.0), (0.0, 1.0)))
    assert along / across == pytest.approx((0.042 / 0.05) / (0.022 / 0.05), rel=1e-3)


@pytest.mark.parametrize("degrees", [30, 90, 150])
def test_turning_is_taken_off_by_its_share_of_half_a_turn_whichever_way(drawn, box, degrees):
    for sign in (1, -1):
        turn = np.radians(sign * degrees)
        ahead, turned = gains(
            drawn,
            candidates(),
            directions=((1.0, 0.0), (np.cos(turn), np.sin(turn))),
            heading_W=np.array([1.0, 0.0]),
        )
        assert turned / ahead == pytest.approx(1 - 0.3 * degrees / 180)


@pytest.mark.parametrize(("aside", "made"), [(0.014, False), (0.018, True)])
def test_within_16_mm_a_push_that_changed_nothing_is_the_same(drawn, box, aside, made):
    # 1 - exp(-(0.016 / 0.035)^2 / 2) is a tenth; what is farther away is worth by how new it is.
    tried = [TriedPush(np.array([0.5, aside, 0.02]), ALONG_X[0], changed=False)]
    gain = gains(drawn, candidates(), tried=tried)[0]
    new = 1 - np.exp(-0.5 * (aside / 0.035) ** 2)
    assert gain == pytest.approx(gains(drawn, candidates())[0] * new if made else 0.0)


def test_of_several_tried_pushes_the_one_most_alike_counts(drawn, box):
    tried = [TriedPush(np.array([0.5, aside, 0.02]), ALONG_X[0], changed=True) for aside in (0.05, -0.03, 0.2)]
    gain = gains(drawn, candidates(), tried=tried)[0]
    expected = 1 - np.exp(-0.5 * (0.03 / 0.035) ** 2)
    assert gain / gains(drawn, candidates())[0] == pytest.approx(expected)


def test_half_of_the_things_of_ten_square_centimetres_are_objects_and_each_push_halves_that():
    parameters = GainParameters()
    assert most_to_expect(1e-3, 0, parameters) == pytest.approx(0.5)
    assert most_to_expect(3e-3, 1, parameters) == pytest.approx(0.375)
    assert most_to_expect(3e-3, 2, parameters) == 0.0
