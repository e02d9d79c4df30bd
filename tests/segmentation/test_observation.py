"""Which motions there are, and what they say of neighbours, by hand."""

from types import SimpleNamespace

import numpy as np
import pytest

from riseg_drake.segmentation.observation import (
    ObservationParameters,
    _fewest_motions,
    bond_evidence,
    evidence_of_parts,
    motion_posterior,
    motion_price,
    observe,
)
from tests.segmentation.drawn_scene import DrawnScene, first_compared, looking_down, motion_seen_from, planar

SHARE = np.array([0.8, 0.2])


STAYS, ALONG = 0.8, 0.1


def evidence_between(q, share=SHARE):
    return bond_evidence(q, share, np.array([[0, 1]]), STAYS, ALONG)


@pytest.mark.parametrize("share", [SHARE, np.array([0.5, 0.5]), np.array([0.9, 0.06, 0.04])])
def test_standing_still_together_says_little_and_moving_together_more_however_common_it_is(share):
    still, moves = np.zeros((len(share), 2)), np.zeros((len(share), 2))
    still[0] = moves[1] = 1.0
    assert evidence_between(still, share) == pytest.approx([np.log(1 / STAYS)])
    assert evidence_between(moves, share) == pytest.approx([np.log(1 / ALONG)])


def test_what_may_lie_on_its_neighbour_tells_less_by_going_with_it_and_as_much_by_standing_still():
    still, moves = np.zeros((2, 2)), np.zeros((2, 2))
    still[0] = moves[1] = 1.0
    borders, along = np.array([[0, 1], [0, 1]]), np.array([0.1, 0.6])
    together = bond_evidence(moves, SHARE, borders, STAYS, along)
    assert together == pytest.approx(np.log([1 / 0.1, 1 / 0.6]))
    assert bond_evidence(still, SHARE, borders, STAYS, along) == pytest.approx([np.log(1 / STAYS)] * 2)


CERTAIN = ObservationParameters(outlier=0.0)


def parts_beside_each_other(nats, *, across=False, behind=False, over=False, shown=3.0, given=CERTAIN):
    """Two parts, 0 and 1, of four superpixels in a row, with costs [G, 4]: what they say of each border.

    Both show so many freedoms of a motion."""
    keyframe = SimpleNamespace(
        borders=np.array([[0, 1], [1, 2], [2, 3]]),
        across=np.full(3, across),
        behind=np.full(3, behind),
        over=np.full(3, over),
    )
    seen = SimpleNamespace(nats=np.array(nats), share=SHARE)
    return evidence_of_parts(seen, keyframe, np.array([0, 0, 1, 1]), np.full(3, shown), given)


@pytest.mark.parametrize(("kind", "probability"), [({}, 0.3), ({"over": True}, 0.6), ({"across": True}, 0.01)])
def test_two_parts_that_surely_moved_as_one_are_so_by_what_else_would_have_moved_them_so(kind, probability):
    moved = np.array([[40.0] * 4, [0.0] * 4])
    given = ObservationParameters(outlier=0.0, along=0.3, carried=0.6, across=0.01)
    evidence = parts_beside_each_other(moved, **kind, given=given)
    assert evidence[1] == pytest.approx(np.log(1 / probability))


@pytest.mark.parametrize(
    ("shown", "touching", "apart"), [(3, 1, 1), (2, 1, 1), (1.5, 0.5, 1), (1, 0, 1), (0, 0, 0)]
)
def test_what_both_sides_hardly_show_is_no_coincidence_and_less_of_one_where_they_touch(shown, touching, apart):
    moved = np.array([[40.0] * 4, [0.0] * 4])
    given = ObservationParameters(outlier=0.0, along=0.3, across=0.01)
    told = parts_beside_each_other(moved, shown=shown, given=given)[1]
    assert told == pytest.approx(touching * np.log(1 / 0.3))
    told = parts_beside_each_other(moved, shown=shown, across=True, given=given)[1]
    assert told == pytest.approx(apart * np.log(1 / 0.01))
    # That they moved apart is as sure as ever.
    unlike = np.array([[40.0, 40.0, 0.0, 0.0], [0.0, 0.0, 40.0, 40.0]])
    assert parts_beside_each_other(unlike, shown=shown, given=given)[1] < -20


@pytest.mark.parametrize("apart", ["across", "behind"])
def test_two_parts_that_stand_still_without_touching_say_nothing_of_each_other(apart):
    still = np.array([[0.0] * 4, [40.0] * 4])
    assert parts_beside_each_other(still, **{apart: True}) == pytest.approx(0.0)
    assert parts_beside_each_other(still)[1] == pytest.approx(np.log(1 / 0.8))


def test_superpixels_that_each_say_little_of_their_motion_are_sure_of_it_as_a_part():
    little = np.array([[3.0, 2.0, 1.0, 4.0], [0.0] * 4])
    q = motion_posterior(np.array([[5.0, 5.0], [0.0, 0.0]]), SHARE, outlier=0.0)
    assert parts_beside_each_other(little)[1] == pytest.approx(
        bond_evidence(q, SHARE, np.array([[0, 1]]), 0.8, 0.2)
    )


def test_evidence_is_the_formula_s_for_all_pairs_of_motions():
    rng = np.random.default_rng(4)
    share, q, stays, along = rng.dirichlet(np.ones(4)), rng.dirichlet(np.ones(4), 2).T, 0.7, 0.3
    same = [stays, along, along, along]
    alike = sum(q[k, 0] * q[k, 1] / share[k] for k in range(4))

    def by_chance(a, b):
        return sum(
            q[k, a] * (same[k] if k == j else (1 - same[k]) * share[j] / (1 - share[k])) * q[j, b] / share[j]
            for k in range(4)
            for j in range(4)
        )

    expected = np.log(alike / ((by_chance(0, 1) + by_chance(1, 0)) / 2))
    assert bond_evidence(q, share, np.array([[0, 1]]), stays, along) == pytest.approx([expected])


def test_moving_apart_is_as_bad_as_outliers_allow():
    # Costs say nothing with a probability of 2 %: q = (0.98 + 0.016, 0.004) and (0.016, 0.98 + 0.004).
    nats = np.array([[0.0, 100.0], [100.0, 0.0]])
    q = motion_posterior(nats, SHARE, outlier=0.02)
    assert q[:, 0] == pytest.approx([0.996, 0.004])
    assert q[:, 1] == pytest.approx([0.016, 0.984])
    one_body = 0.996 * 0.016 / 0.8 + 0.004 * 0.984 / 0.2
    # Two: the neighbour of a stays still with 0.8 and moves with 0.2; that of b moves along with 0.1.
    beside_a = 0.996 * (0.8 * 0.016 / 0.8 + 0.2 * 0.984 / 0.2) + 0.004 * (0.9 * 0.016 / 0.8 + 0.1 * 0.984 / 0.2)
    beside_b = 0.016 * (0.8 * 0.996 / 0.8 + 0.2 * 0.004 / 0.2) + 0.984 * (0.9 * 0.996 / 0.8 + 0.1 * 0.004 / 0.2)
    expected = np.log(one_body / ((beside_a + beside_b) / 2))
    assert evidence_between(q) == pytest.approx([expected])
    assert expected < -3


@pytest.mark.parametrize("other", [0.0, 50.0, -50.0])
def test_who_says_nothing_is_no_evidence_to_speak_of_whatever_its_neighbour_does(other):
    q = motion_posterior(np.array([[0.0, 0.0], [0.0, other]]), SHARE, outlier=0.0)
    assert q[:, 0] == pytest.approx(SHARE)
    # One body: sum_k q_b(k) = 1. Two: 1 from the one side, and from the other sum_k pi_k rho(l | k) / pi_l.
    move = 0.8 * 0.2 / 0.2 + 0.2 * 0.1 / 0.2
    stay = 0.8 * 0.8 / 0.8 + 0.2 * 0.9 / 0.8
    by_chance = {0.0: 1.0, 50.0: (1 + stay) / 2, -50.0: (1 + move) / 2}[other]
    assert evidence_between(q) == pytest.approx([-np.log(by_chance)], abs=1e-6)


def test_costs_and_commonness_weigh_as_bayes_has_it():
    # Two nats for the rare motion: odds 0.2 e^2 to 0.8.
    q = motion_posterior(np.array([[2.0], [0.0]]), SHARE, outlier=0.0)
    assert q[1, 0] == pytest.approx(0.2 * np.e**2 / (0.2 * np.e**2 + 0.8))


@pytest.mark.renders
@pytest.mark.parametrize(
    ("aside", "is_one"), [(0.0, True), (0.12, False)], ids=["camera stands", "camera moves"]
)
def test_a_pixel_and_a_half_are_a_motion_unless_the_view_is_another_one(aside: float, is_one: bool) -> None:
    # 12 cm aside are 82 pixels; a per cent of that is how much things may seem to move.
    scene, places = (
        DrawnScene([(0.08, 0.07, 0.03), (0.06, 0.08, 0.05)]),
        [planar(-0.07, 0.0), planar(0.06, 0.0)],
    )
    there = [planar(-0.0678, 0.0), places[1]]
    cameras = (looking_down(), looking_down(aside))
    pair, label, _ = scene.pair(cameras, (places, there), np.random.default_rng(0))
    belief, compared = first_compared(pair, label)
    moved = motion_seen_from(cameras[0], places[0], there[0])
    seen = observe(compared, belief.bond, belief.divisions, belief.shown, moved, ObservationParameters())
    assert (len(seen.motions_K) == 2) is is_one


def test_a_motion_that_alone_explains_all_of_a_part_is_kept_though_two_others_explain_half_of_it_each():
    """Nats of a chain of 40 superpixels: half of them fit standing still, half another motion, as well."""
    count, half = 40, np.arange(40) < 20
    nats = np.array([np.where(half, 0.0, 3.0), np.where(half, 3.0, 0.0), np.full(count, 0.2)])
    borders = np.column_stack([np.arange(count - 1), np.arange(1, count)])
    keyframe = SimpleNamespace(count=count, borders=borders, length=np.ones(len(borders)))
    bond, one = np.full(len(borders), 2.0), np.zeros(count, np.intp)
    needed, _ = _fewest_motions(nats, keyframe, bond, one[None], 20.0, ObservationParameters())
    assert 2 in needed
    # As two bodies, each has its own motion.
    two = 1 - half.astype(np.intp)
    needed, motion = _fewest_motions(nats, keyframe, bond, two[None], 20.0, ObservationParameters())
    assert needed == [0, 1]
    np.testing.assert_array_equal(motion, 1 - half)
    # What may be one body, if bonds are weaker than they seem, is asked as well: it was searched for, too.
    needed, _ = _fewest_motions(nats, keyframe, bond, np.array([two, one]), 20.0, ObservationParameters())
    assert 2 in needed


@pytest.mark.parametrize(("shift", "price"), [(0.0, 20.0), (0.25, 30.0), (1.0, 60.0)])
def test_a_motion_costs_more_the_more_the_view_has_changed(shift, price):
    parameters = ObservationParameters(motion_cost=20.0, view_cost=2.0)
    assert motion_price(SimpleNamespace(shift=shift), parameters) == pytest.approx(price)
