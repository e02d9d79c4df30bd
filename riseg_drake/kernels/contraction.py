"""Greedy additive edge contraction, `segmentation.multicut`."""

from heapq import heapify, heappop, heappush

import numpy as np
from numpy.typing import NDArray

from riseg_drake.kernels.compiled import compiled


@compiled("void(float64[::1], intp[::1], float64[::1])")
def _find_lowest(cost: NDArray[np.float64], ends: NDArray[np.intp], lowest: NDArray[np.float64]) -> None:
    """The least cost [Q] of each question's answers [G]."""
    start = 0
    for q in range(len(ends)):
        lowest[q] = np.inf
        for g in range(start, ends[q]):
            lowest[q] = min(lowest[q], cost[g])
        start = ends[q]


@compiled("intp[::1](intp, intp[:, ::1], float64[::1], float64[:, ::1], intp[::1], float64[::1])")
def contract(
    nodes: int,
    edges: NDArray[np.intp],
    weight: NDArray[np.float64],
    cost: NDArray[np.float64],
    ends: NDArray[np.intp],
    free: NDArray[np.float64],
) -> NDArray[np.intp]:
    """For each node [nodes] one that stands for its part.

    Args:
        nodes: how many.
        edges: [M, 2], pairs of nodes, each once.
        weight: [M], log-odds that both ends are one; renewed in place.
        cost: [nodes, G], how badly each of G answers explains each node, nats; renewed in place.
        ends: [Q], rising: the answers before each belong to one question, of which a part has one answer.
        free: [Q], nats that it may cost two parts to have one answer to each of them.
    """
    # Edge e has two ends, 2 e and 2 e + 1; `at` says at which part, and each part has a list of its ends.
    at, after = edges.copy().ravel(), np.full(2 * len(weight), -1)
    first, degree = np.full(nodes, -1), np.zeros(nodes, np.intp)
    size, parent = np.ones(nodes, np.intp), np.arange(nodes)
    # Edges of which one end has grown, or may be asked again once it does.
    gone, again = np.zeros(len(weight), np.bool_), np.zeros(len(weight), np.bool_)
    beside, lowest = np.full(nodes, -1), np.zeros((nodes, len(ends)))
    for a in range(nodes):
        _find_lowest(cost[a], ends, lowest[a])
    # What a pair of parts gains: at first its bond, with sizes 0, and what remains of it once its motions were
    # looked at, with the sizes of both: a part whose size is the same is the same part.
    queue = [(0.0, 0, 0, 0, 0, 0)]
    queue.pop()
    for e in range(len(weight)):
        for end in (2 * e, 2 * e + 1):
            after[end] = first[at[end]]
            first[at[end]] = end
            degree[at[end]] += 1
        if weight[e] > 0:
            queue.append((-weight[e], min(at[2 * e], at[2 * e + 1]), max(at[2 * e], at[2 * e + 1]), e, 0, 0))
    heapify(queue)
    while len(queue):
        negative, a, b, e, size_a, size_b = heappop(queue)
        if gone[e] or min(at[2 * e], at[2 * e + 1]) != a or max(at[2 * e], at[2 * e + 1]) != b:
            continue  # one of the two is part of another by now
        if size_a != size[a] or size_b != size[b]:
            if size_a == 0 and weight[e] != -negative:
                continue  # their bond has changed
            lost, start = 0.0, 0
            for q in range(len(ends)):
                shared = np.inf
                for g in range(start, ends[q]):
                    shared = min(shared, cost[a, g] + cost[b, g])
                lost += max(0.0, shared - lowest[a, q] - lowest[b, q] - free[q])
                start = ends[q]
            if lost > 0:
                if weight[e] > lost:
                    heappush(queue, (lost - weight[e], a, b, e, size[a], size[b]))
                else:
                    again[e] = True
                continue
        if degree[a] < degree[b]:
            a, b = b, a
        parent[b] = a
        size[a] += size[b]
        for g in range(cost.shape[1]):
            cost[a, g] += cost[b, g]
        _find_lowest(cost[a], ends, lowest[a])
        gone[e] = True
        # The edges of b become those of a, or join those that a has.
        end, first[a], degree[a] = first[a], -1, 0
        while end >= 0:
            following = after[end]
            if not gone[end // 2]:
                beside[at[end ^ 1]] = end
                after[end], first[a] = first[a], end
                degree[a] += 1
            end = following
        end, first[b] = first[b], -1
        while end >= 0:
            following, c = after[end], at[end ^ 1]
            if not gone[end // 2]:
                if beside[c] >= 0:
                    gone[end // 2] = True
                    degree[c] -= 1
                    weight[beside[c] // 2] += weight[end // 2]
                    end = beside[c]
                else:
                    at[end] = a
                    after[end], first[a] = first[a], end
                    degree[a] += 1
                again[end // 2] = True
            end = following
        end = first[a]
        while end >= 0:
            c = at[end ^ 1]
            beside[c] = -1
            if again[end // 2]:
                again[end // 2] = False
                if weight[end // 2] > 0:
                    heappush(queue, (-weight[end // 2], min(a, c), max(a, c), end // 2, 0, 0))
            end = after[end]
    for a in range(nodes):
        while parent[a] != parent[parent[a]]:
            parent[a] = parent[parent[a]]
    return parent
