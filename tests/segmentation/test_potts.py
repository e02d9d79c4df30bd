"""Belief propagation against all labellings, tried one by one."""

from itertools import product

import numpy as np
import pytest

from riseg_drake.segmentation.potts import PottsGraph, potts_labels


def energy(label: np.ndarray, unary: np.ndarray, edges: np.ndarray, weight: np.ndarray) -> float:
    apart = label[edges[:, 0]] != label[edges[:, 1]]
    return float(unary[np.arange(len(unary)), label].sum() + weight[apart].sum())


def least_energy(unary: np.ndarray, edges: np.ndarray, weight: np.ndarray) -> float:
    nodes, labels = unary.shape
    every = (np.array(label) for label in product(range(labels), repeat=nodes))
    return min(energy(label, unary, edges, weight) for label in every)


def found_labels(unary: np.ndarray, edges: np.ndarray, weight: np.ndarray) -> np.ndarray:
    label, _ = potts_labels(unary.T.astype(np.float32), PottsGraph(len(unary), edges, weight))
    return label


def grid(height: int, width: int) -> np.ndarray:
    number = np.arange(height * width).reshape(height, width)
    across = np.stack([number[:, :-1].ravel(), number[:, 1:].ravel()], axis=1)
    down = np.stack([number[:-1].ravel(), number[1:].ravel()], axis=1)
    return np.concatenate([across, down])


@pytest.mark.parametrize("draw", range(6))
@pytest.mark.parametrize("kind", ["chain", "tree"])
def test_on_a_tree_no_labelling_is_better(kind: str, draw: int) -> None:
    rng = np.random.default_rng(draw)
    unary = rng.uniform(0, 4, (6, 3))
    parents = np.arange(5) if kind == "chain" else np.array([rng.integers(i + 1) for i in range(5)])
    edges = np.stack([parents, np.arange(1, 6)], axis=1)
    weight = rng.uniform(0, 3, 5)
    found = energy(found_labels(unary, edges, weight), unary, edges, weight)
    assert found == pytest.approx(least_energy(unary, edges, weight), abs=0.01)


def test_on_a_small_grid_hardly_any_labelling_is_better() -> None:
    excess = []
    for draw in range(10):
        rng = np.random.default_rng(draw)
        unary, edges = rng.uniform(0, 4, (9, 2)), grid(3, 3)
        weight = rng.uniform(0, 2, len(edges))
        found = energy(found_labels(unary, edges, weight), unary, edges, weight)
        excess.append(found / least_energy(unary, edges, weight) - 1)
    assert np.median(excess) < 1e-6
    assert max(excess) < 0.1


def test_borders_that_cost_nothing_leave_each_node_its_own_choice() -> None:
    unary = np.random.default_rng(0).uniform(0, 4, (30, 4))
    edges = grid(5, 6)
    np.testing.assert_array_equal(found_labels(unary, edges, np.zeros(len(edges))), unary.argmin(1))
    np.testing.assert_array_equal(found_labels(unary, edges[:0], np.zeros(0)), unary.argmin(1))


@pytest.mark.parametrize("edges", [np.stack([np.arange(29), np.arange(1, 30)], 1), grid(5, 6)])
def test_borders_that_cost_more_than_everything_leave_one_label(edges: np.ndarray) -> None:
    unary = np.random.default_rng(1).uniform(0, 1, (30, 3))
    unary[:, 1] -= 0.2
    assert unary.sum(0).argmin() == 1
    np.testing.assert_array_equal(found_labels(unary, edges, np.full(len(edges), 1e3)), 1)


def test_a_node_with_nothing_to_say_follows_the_stronger_border() -> None:
    unary = np.array([[0.0, 9.0], [1.0, 1.0], [9.0, 0.0]])
    edges = np.array([[0, 1], [1, 2]])
    np.testing.assert_array_equal(found_labels(unary, edges, np.array([2.0, 1.0])), [0, 0, 1])
    np.testing.assert_array_equal(found_labels(unary, edges, np.array([1.0, 2.0])), [0, 1, 1])
