"""The partition of a weighted graph that maximises the summed log-odds inside its parts: the multicut problem.

Greedy additive edge contraction (Keuper et al., Efficient decomposition of image and mesh graphs by lifted
multicuts, ICCV 2015): the two parts with the strongest bond are joined, again and again, until no bond speaks
for joining. Nobody says how many parts there are.
"""

import heapq

import numpy as np
from numpy.typing import NDArray


def multicut(nodes: int, edges: NDArray[np.intp], weight: NDArray[np.float64]) -> NDArray[np.intp]:
    """The part 0.. of each node [nodes], for edges [M, 2] with the log-odds [M] that their two ends are one."""
    bonds: list[dict[int, float]] = [{} for _ in range(nodes)]
    for a, b, w in zip(edges[:, 0].tolist(), edges[:, 1].tolist(), weight.tolist(), strict=True):
        bonds[a][b] = bonds[b][a] = bonds[a].get(b, 0.0) + w
    queue = [(-w, a, b) for a in range(nodes) for b, w in bonds[a].items() if a < b and w > 0]
    heapq.heapify(queue)
    parent = np.arange(nodes)
    while queue:
        negative, a, b = heapq.heappop(queue)
        if bonds[a].get(b) != -negative:
            continue  # one of the two is part of another by now, or their bond has changed
        if len(bonds[a]) < len(bonds[b]):
            a, b = b, a
        parent[b] = a
        del bonds[a][b]
        for c, w in bonds[b].items():
            if c == a:
                continue
            del bonds[c][b]
            total = bonds[a].get(c, 0.0) + w
            bonds[a][c] = bonds[c][a] = total
            if total > 0:
                heapq.heappush(queue, (-total, min(a, c), max(a, c)))
        bonds[b] = {}
    while not np.array_equal(parent, parent[parent]):
        parent = parent[parent]
    return np.unique(parent, return_inverse=True)[1]
