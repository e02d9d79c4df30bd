"""What one motion could not explain together is remembered as two, by ids, wherever they are."""

import numpy as np
import pytest

from riseg_drake.segmentation.told_apart import identity_costs, moving_apart, with_lost

BODY = np.array([1, 1, 0, 2, 2, 3])
AREA = np.array([10, 30, 50, 20, 20, 40])


def told(*pairs, count=4):
    matrix = np.zeros((count, count))
    for a, b, nats in pairs:
        matrix[a, b] = matrix[b, a] = nats
    return matrix


def test_all_of_a_body_costs_what_was_told_and_each_superpixel_its_share():
    costs = identity_costs(told((1, 2, 80.0)), BODY, AREA)
    # To be body 1 costs body 2 its 80 nats, half for each of two that are as large; and the other way round.
    np.testing.assert_allclose(costs, [[0, 0, 0, 40, 40, 0], [20, 60, 0, 0, 0, 0]])


def test_of_ids_that_were_told_apart_from_none_nothing_is_asked():
    assert identity_costs(told(), BODY, AREA).shape == (0, 6)
    # One of the two is out of sight: to be it costs the other all the same, but nobody can be it.
    costs = identity_costs(told((1, 2, 80.0)), np.array([0, 0, 0, 2, 2, 3]), AREA)
    np.testing.assert_array_equal(costs, np.zeros((1, 6)))


@pytest.mark.parametrize(
    ("motions", "remembered"), [([1, 2], 80.0), ([0, 1], 80.0), ([0, 0], 80.0), ([1, 1], 0.0)]
)
def test_only_what_moves_as_one_may_have_been_one(motions, remembered):
    motion = np.array([motions[0]] * 3 + [motions[1]] * 2 + [0])
    np.testing.assert_array_equal(
        moving_apart(told((1, 2, 80.0), (1, 3, 9.0)), BODY, motion), told((1, 2, remembered), (1, 3, 9.0))
    )


def test_what_one_motion_costs_two_bodies_beyond_what_is_free_is_remembered():
    # Standing still costs body 2 2 x 40 nats, the motion costs body 1 2 x 35, and body 3 says nothing.
    nats = np.array([[0.0, 0, 0, 40, 40, 0], [35, 35, 0, 0, 0, 0]])
    after = with_lost(told(), BODY, BODY, 4, nats, AREA, free=60.0)
    np.testing.assert_array_equal(after, told((1, 2, 10.0)))
    # It is the most that any push said, not the sum.
    after = with_lost(after, BODY, BODY, 4, nats, AREA, free=60.0)
    np.testing.assert_array_equal(after, told((1, 2, 10.0)))
    np.testing.assert_array_equal(with_lost(told(), BODY, BODY, 4, nats, AREA, free=70.0), told())


def test_what_falls_off_a_body_has_a_part_in_what_that_was_told_and_what_is_out_of_sight_keeps_all():
    silent = np.zeros((2, 6))
    following = np.array([1, 4, 0, 2, 2, 3])
    before = told((1, 2, 80.0), (2, 3, 7.0))
    after = with_lost(before, BODY, following, 5, silent, AREA, free=60.0)
    np.testing.assert_array_equal(after, told((1, 2, 20.0), (4, 2, 60.0), (2, 3, 7.0), count=5))
    gone = np.array([0, 0, 0, 2, 2, 3])
    np.testing.assert_array_equal(with_lost(before, gone, gone, 4, silent, AREA, free=60.0), before)


def test_what_has_not_moved_is_told_apart_from_nothing():
    nats = np.array([[0.0, 0, 0, 400, 400, 0], [400, 400, 400, 0, 0, 0]])
    after = with_lost(told(), np.zeros(6, int), BODY, 4, nats, AREA, free=60.0)
    np.testing.assert_array_equal(after[0], 0)
    assert after[1, 2] == 740.0
