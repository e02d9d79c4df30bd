from itertools import product

import numpy as np
import pytest

from riseg_drake.segmentation.multicut import multicut


def value(part, edges, weight):
    return sum(w for (a, b), w in zip(edges, weight, strict=True) if part[a] == part[b])


def test_five_nodes_by_hand_fall_into_two_parts():
    # 0-1-2 hold together, 3-4 hold together, and between 2 and 3 it is said that they do not.
    edges = np.array([[0, 1], [1, 2], [2, 3], [3, 4]])
    np.testing.assert_array_equal(multicut(5, edges, np.array([2.0, 1.0, -0.5, 3.0])), [0, 0, 0, 1, 1])


def test_many_weak_noes_outweigh_one_strong_yes():
    # Two pairs, bound by one border of +1 and kept apart by three of -0.5: joined they would lose half a nat.
    edges = np.array([[0, 1], [2, 3], [0, 2], [0, 3], [1, 2], [1, 3]])
    weight = np.array([5.0, 5.0, 1.0, -0.5, -0.5, -0.5])
    np.testing.assert_array_equal(multicut(4, edges, weight), [0, 0, 1, 1])
    np.testing.assert_array_equal(multicut(4, edges, weight + np.array([0, 0, 0.6, 0, 0, 0])), [0, 0, 0, 0])


def test_a_node_without_borders_is_a_part_of_its_own():
    np.testing.assert_array_equal(multicut(3, np.array([[0, 2]]), np.array([1.0])), [0, 1, 0])
    np.testing.assert_array_equal(multicut(2, np.empty((0, 2), int), np.empty(0)), [0, 1])


def test_no_weight_is_no_reason_to_join():
    np.testing.assert_array_equal(multicut(2, np.array([[0, 1]]), np.array([0.0])), [0, 1])


@pytest.mark.parametrize("seed", range(30))
def test_joining_or_parting_any_two_parts_is_never_better(seed):
    rng = np.random.default_rng(seed)
    nodes = 7
    edges = np.array([(a, b) for a in range(nodes) for b in range(a + 1, nodes) if rng.uniform() < 0.6])
    weight = rng.normal(size=len(edges))
    part = multicut(nodes, edges, weight)
    found = value(part, edges, weight)
    for a, b in product(range(part.max() + 1), repeat=2):
        assert value(np.where(part == a, b, part), edges, weight) <= found + 1e-12
    every = np.array(list(product(range(4), repeat=nodes)))
    best = ((every[:, edges[:, 0]] == every[:, edges[:, 1]]) @ weight).max()
    assert found >= 0.75 * best


def test_parts_do_not_depend_on_the_order_of_the_borders():
    rng = np.random.default_rng(1)
    edges = np.array([(a, b) for a in range(12) for b in range(a + 1, 12) if rng.uniform() < 0.3])
    weight = rng.normal(size=len(edges))
    order = rng.permutation(len(edges))
    np.testing.assert_array_equal(multicut(12, edges, weight), multicut(12, edges[order], weight[order]))


ROW = np.array([[0, 1], [1, 2], [2, 3], [3, 4], [4, 5]])


def test_two_parts_that_no_one_motion_explains_are_two_though_nothing_is_seen_at_their_border():
    # Nodes 0 and 5 saw two motions; all between saw nothing, and every border says that it is inside.
    nats = np.array([[0.0, 0, 0, 0, 0, 9.0], [9.0, 0, 0, 0, 0, 0.0]])
    weight = np.array([3.0, 3.0, 1.0, 3.0, 3.0])
    np.testing.assert_array_equal(multicut(6, ROW, weight), [0] * 6)
    np.testing.assert_array_equal(multicut(6, ROW, weight, [(nats, 7.5)]), [0, 0, 0, 1, 1, 1])
    # 9 nats are lost, of which 8.5 are free; the half that is left is less than the weakest bond.
    np.testing.assert_array_equal(multicut(6, ROW, weight, [(nats, 8.5)]), [0] * 6)


def test_a_motion_that_explains_both_costs_nothing():
    nats = np.array([[0.0, 0, 0, 9.0, 9.0, 9.0], [9.0, 9.0, 9.0, 0, 0, 0], [1.0, 0, 0, 0, 0, 1.0]])
    np.testing.assert_array_equal(multicut(6, ROW, np.ones(5), [(nats[:2], 0.0)]), [0, 0, 0, 1, 1, 1])
    np.testing.assert_array_equal(multicut(6, ROW, np.ones(5), [(nats, 2.0)]), [0] * 6)


def test_what_was_refused_is_asked_again_when_parts_have_grown():
    # 1 and 2 disagree by themselves; with 0 and 3, which saw a third motion, both have that.
    nats = np.array([[0.0, 0.0, 5.0, 0.0], [0.0, 5.0, 0.0, 0.0], [0.0, 2.0, 2.0, 0.0]])
    nats[:2, [0, 3]] = 20.0
    edges = np.array([[0, 1], [1, 2], [2, 3]])
    np.testing.assert_array_equal(multicut(4, edges, np.array([2.5, 3.0, 2.5]), [(nats, 0.0)]), [0] * 4)


@pytest.mark.parametrize("seed", range(10))
def test_without_motions_or_with_one_it_is_the_same(seed):
    rng = np.random.default_rng(seed)
    edges = np.array([(a, b) for a in range(8) for b in range(a + 1, 8) if rng.uniform() < 0.5])
    weight = rng.normal(size=len(edges))
    expected = multicut(8, edges, weight)
    np.testing.assert_array_equal(multicut(8, edges, weight, [(np.zeros((1, 8)), 0.0)]), expected)
    np.testing.assert_array_equal(multicut(8, edges, weight, [(np.zeros((3, 8)), 0.0)]), expected)


def test_two_questions_are_asked_apart_and_what_both_cost_adds_up():
    # Two nodes whose border says 5. One answer to the first question costs 5, to the second 3; 2 are free.
    edges, weight = np.array([[0, 1]]), np.array([5.0])
    first, second = np.array([[0.0, 5.0], [5.0, 0.0]]), np.array([[0.0, 3.0], [3.0, 0.0]])
    np.testing.assert_array_equal(multicut(2, edges, weight, [(first, 2.0)]), [0, 0])  # 3 of 5
    np.testing.assert_array_equal(multicut(2, edges, weight, [(first, 2.0), (second, 2.0)]), [0, 0])  # 4 of 5
    np.testing.assert_array_equal(multicut(2, edges, weight, [(first, 2.0), (second, 0.9)]), [0, 1])  # 5.1
    # One question with the answers of both would be answered by the best of four.
    np.testing.assert_array_equal(multicut(2, edges, weight, [(np.vstack([first, second]), 0.0)]), [0, 0])
