"""The partition of a weighted graph that maximises the summed log-odds inside its parts: the multicut problem.

Greedy additive edge contraction (Keuper et al., Efficient decomposition of image and mesh graphs by lifted
multicuts, ICCV 2015): the two parts with the strongest bond are joined, again and again, until no bond speaks
for joining. Nobody says how many parts there are.
"""

import heapq
from operator import add

import numpy as np
from numpy.typing import NDArray


def multicut(
    nodes: int,
    edges: NDArray[np.intp],
    weight: NDArray[np.float64],
    nats: NDArray[np.float64] | None = None,
    free: float = 0.0,
) -> NDArray[np.intp]:
    """The part 0.. of each node [nodes], for edges [M, 2] with the log-odds [M] that their two ends are one.

    With `nats` [G, nodes], how badly each of G motions explains each node, two parts that no motion explains
    together as well as each is by its own lose what that costs, but for the first `free` nats.
    """
    bonds: list[dict[int, float]] = [{} for _ in range(nodes)]
    for a, b, w in zip(edges[:, 0].tolist(), edges[:, 1].tolist(), weight.tolist(), strict=True):
        bonds[a][b] = bonds[b][a] = bonds[a].get(b, 0.0) + w
    # Lists, not arrays: there are few motions, and a thousand pairs are asked one by one.
    cost = None if nats is None or len(nats) < 2 else nats.T.tolist()
    lowest = None if cost is None else [min(each) for each in cost]
    size = [1] * nodes  # in nodes; a part whose size is the same is the same part
    # What a pair of parts gains: at first its bond, and what remains of it once its motions were looked at.
    queue = [(-w, a, b, 0, 0) for a in range(nodes) for b, w in bonds[a].items() if a < b and w > 0]
    heapq.heapify(queue)
    refused: list[set[int]] = [set() for _ in range(nodes)]
    parent = np.arange(nodes)
    while queue:
        negative, a, b, size_a, size_b = heapq.heappop(queue)
        w = bonds[a].get(b)
        if w is None:
            continue  # one of the two is part of another by now
        if (size_a, size_b) != (size[a], size[b]):
            if size_a == 0 and w != -negative:
                continue  # their bond has changed
            lost = -1.0
            if cost is not None and lowest is not None:
                lost = min(map(add, cost[a], cost[b])) - lowest[a] - lowest[b] - free
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
        if cost is not None and lowest is not None:
            cost[a] = list(map(add, cost[a], cost[b]))
            lowest[a] = min(cost[a])
        del bonds[a][b]
        for c, w in bonds[b].items():
            if c == a:
                continue
            del bonds[c][b]
            total = bonds[a].get(c, 0.0) + w
            bonds[a][c] = bonds[c][a] = total
            if total > 0:
                heapq.heappush(queue, (-total, min(a, c), max(a, c), 0, 0))
        bonds[b] = {}
        for c in refused[a] | refused[b]:  # as parts grow their motions may turn out to be one
            if bonds[a].get(c, 0.0) > 0:
                heapq.heappush(queue, (-bonds[a][c], min(a, c), max(a, c), 0, 0))
        refused[a] = set()
    while not np.array_equal(parent, parent[parent]):
        parent = parent[parent]
    return np.unique(parent, return_inverse=True)[1]


def loss(cost_a: NDArray[np.float64], cost_b: NDArray[np.float64]) -> NDArray[np.float64]:
    """What it costs pairs of parts to have one motion, nats [...], by how badly each explains each [G, ...]."""
    shared: NDArray[np.float64] = (cost_a + cost_b).min(0) - cost_a.min(0) - cost_b.min(0)
    return shared
