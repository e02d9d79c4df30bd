"""Labels on a graph: what each node says for itself, against borders that cost (a Potts model)."""

import numpy as np
from numpy.typing import NDArray

from riseg_drake.kernels.messages import pass_messages

_LEAST_CHANGE = 0.01
"""A message that changes by less is at its end."""


def potts_labels(
    unary: NDArray[np.float32],
    edges: NDArray[np.intp],
    weight: NDArray[np.float64],
    message: NDArray[np.float32] | None = None,
    rounds: int = 30,
) -> tuple[NDArray[np.intp], NDArray[np.float32]]:
    """Labels x [N] that nearly minimise sum unary[x_i, i] + sum weight[e] [x_i != x_j].

    Min-sum belief propagation: exact on trees, close on the planar graphs of image pieces.

    Args:
        unary: [L, N], cost of each label at each node.
        edges: [M, 2], pairs of nodes.
        weight: [M], what different labels at both ends cost, >= 0.
        message: [L, 2 M] to start from, of a problem much like this one; nothing said yet if None.
        rounds: of message passing, at most.

    Returns:
        x, and the messages at the end.
    """
    message = np.zeros((len(unary), 2 * len(edges)), np.float32) if message is None else message
    passed = np.array(message.T, np.float32, order="C")
    costs = np.array(unary.T, np.float32, order="C")
    borders = np.ascontiguousarray(edges, np.intp)
    belief = pass_messages(costs, borders, weight.astype(np.float32), passed, rounds, _LEAST_CHANGE)
    return belief.argmin(1), passed.T
