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
