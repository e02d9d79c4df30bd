"""The kernel beside the same in plain Python, with a heap and a dictionary for each part."""

import heapq

import numpy as np
import pytest

from riseg_drake.kernels.contraction import contract


def shared(cost, ends):
    """The least cost [Q] of each question's answers."""
    return np.array([answers.min() for answers in np.split(cost, ends[:-1])])


def contract_in_python(nodes, edges, weight, cost, ends, free):
    bonds = [{} for _ in range(nodes)]
    for (a, b), w in zip(edges.tolist(), weight.tolist(), strict=True):
        bonds[a][b] = bonds[b][a] = w
    size, parent = [1] * nodes, np.arange(nodes)
    queue = [(-w, a, b, 0, 0) for a in range(nodes) for b, w in bonds[a].items() if a < b and w > 0]
    heapq.heapify(queue)
    refused = [set() for _ in range(nodes)]
    while queue:
        negative, a, b, size_a, size_b = heapq.heappop(queue)
        if b not in bonds[a]:
            continue
        w = bonds[a][b]
        if (size_a, size_b) != (size[a], size[b]):
            if size_a == 0 and w != -negative:
                continue
            each = shared(cost[a] + cost[b], ends) - shared(cost[a], ends) - shared(cost[b], ends) - free
            lost = np.maximum(each, 0).sum()
            if lost > 0:
                if w > lost:
                    heapq.heappush(queue, (lost - w, a, b, size[a], size[b]))
                else:
                    refused[a].add(b)
                    refused[b].add(a)
                continue
        if len(bonds[a]) < len(bonds[b]):
            a, b = b, a
        parent[b] = a
        size[a] += size[b]
        cost[a] += cost[b]
        del bonds[a][b]
        for c, w in bonds[b].items():
            if c != a:
                del bonds[c][b]
                bonds[a][c] = bonds[c][a] = bonds[a].get(c, 0.0) + w
                if bonds[a][c] > 0:
                    heapq.heappush(queue, (-bonds[a][c], min(a, c), max(a, c), 0, 0))
        bonds[b] = {}
        for c in refused[a] | refused[b]:
            if bonds[a].get(c, 0.0) > 0:
                heapq.heappush(queue, (-bonds[a][c], min(a, c), max(a, c), 0, 0))
        refused[a] = set()
    while not np.array_equal(parent, parent[parent]):
        parent = parent[parent]
    return parent


def partition(parent):
    return np.unique(parent, return_inverse=True)[1]


@pytest.mark.parametrize("motions", [1, 3, 5])
@pytest.mark.parametrize("seed", range(12))
def test_it_contracts_what_plain_python_contracts(seed, motions):
    rng = np.random.default_rng(seed)
    nodes = 60
    p_NQ = rng.uniform(size=(nodes, 2))
    near = np.linalg.norm(p_NQ[:, None] - p_NQ, axis=2) < 0.25
    edges = np.argwhere(np.triu(near, 1))
    weight = rng.normal(0.3, 1.5, len(edges))
    # Two bodies side by side, each explained by one of the motions, with noise.
    cost = np.zeros((nodes, motions))
    ends, free = (
        (np.array([3, 5]), np.array([4.0, 1.0])) if motions == 5 else (np.array([motions]), np.array([4.0]))
    )
    if motions >= 3:
        right = p_NQ[:, 0] > 0.5
        cost[:, 0], cost[:, 1] = np.where(right, 3.0, 0.0), np.where(right, 0.0, 3.0)
        cost += rng.uniform(0, 1, cost.shape)
    if motions == 5:
        # And a second question, to which what lies above has another answer.
        above = p_NQ[:, 1] > 0.5
        cost[:, 3], cost[:, 4] = np.where(above, 0.5, 0.0), np.where(above, 0.0, 0.5)
    expected = contract_in_python(nodes, edges, weight.copy(), cost.copy(), ends, free)
    found = contract(nodes, edges, weight, cost, ends, free)
    np.testing.assert_array_equal(partition(found), partition(expected))


def test_three_parts_share_what_two_edges_said_of_them():
    # 0 and 1 hold most; 2 is bound to 0 by +2 and kept from 1 by -1: together +1.
    weight = np.array([3.0, 2.0, -1.0])
    edges = np.array([[0, 1], [0, 2], [1, 2]])
    nothing_asked = np.zeros((3, 0)), np.zeros(0, np.intp), np.zeros(0)
    np.testing.assert_array_equal(partition(contract(3, edges, weight, *nothing_asked)), [0, 0, 0])
    weight = np.array([3.0, 2.0, -2.5])
    np.testing.assert_array_equal(partition(contract(3, edges, weight, *nothing_asked)), [0, 0, 1])
