"""The partition of a weighted graph that maximises the summed log-odds inside its parts: the multicut problem.

Greedy additive edge contraction (Keuper et al., Efficient decomposition of image and mesh graphs by lifted
multicuts, ICCV 2015): the two parts with the strongest bond are joined, again and again, until no bond speaks
for joining. Nobody says how many parts there are.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from riseg_drake.kernels.contraction import contract


def multicut(
    nodes: int,
    edges: NDArray[np.intp],
    weight: NDArray[np.float64],
    questions: Sequence[tuple[NDArray[np.float64], float]] = (),
) -> NDArray[np.intp]:
    """The part 0.. of each node [nodes], for edges [M, 2] with the log-odds [M] that their two ends are one.

    Of each of the `questions` a part has one answer: given how badly each of G answers explains each node
    [G, nodes], in nats, two parts that none explains together as well as each is by its own lose what that
    costs, but for the first so many nats.
    """
    pair = np.sort(edges, axis=1) @ [nodes, 1]
    each, which = np.unique(pair, return_inverse=True)
    asked = [(nats, free) for nats, free in questions if len(nats) > 1]
    cost = np.concatenate([nats.T for nats, _ in asked] or [np.zeros((nodes, 0))], axis=1)
    once = np.stack(np.divmod(each, nodes), axis=1)
    bond = np.asarray(np.bincount(which, weight, len(each)), np.float64)
    stands_for = contract(
        nodes,
        once,
        bond,
        np.ascontiguousarray(cost, np.float64),
        np.cumsum([len(nats) for nats, _ in asked], dtype=np.intp),
        np.array([free for _, free in asked], np.float64),
    )
    return np.unique(stands_for, return_inverse=True)[1]
