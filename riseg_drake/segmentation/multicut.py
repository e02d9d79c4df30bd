"""The partition of a weighted graph that maximises the summed log-odds inside its parts: the multicut problem.

Greedy additive edge contraction (Keuper et al., Efficient decomposition of image and mesh graphs by lifted
multicuts, ICCV 2015): the two parts with the strongest bond are joined, again and again, until no bond speaks
for joining. Nobody says how many parts there are.
"""

import numpy as np
from numpy.typing import NDArray

from riseg_drake.kernels.contraction import contract


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
    pair = np.sort(edges, axis=1) @ [nodes, 1]
    each, which = np.unique(pair, return_inverse=True)
    cost = np.zeros((nodes, 1)) if nats is None or len(nats) < 2 else np.array(nats.T, np.float64, order="C")
    once = np.stack(np.divmod(each, nodes), axis=1)
    bond = np.asarray(np.bincount(which, weight, len(each)), np.float64)
    stands_for = contract(nodes, once, bond, cost, free)
    return np.unique(stands_for, return_inverse=True)[1]
