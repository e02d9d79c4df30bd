"""Labels on a graph: what each node says for itself, against borders that cost (a Potts model)."""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix


def potts_labels(
    unary: NDArray[np.float64],
    edges: NDArray[np.intp],
    weight: NDArray[np.float64],
    rounds: int = 30,
) -> NDArray[np.intp]:
    """Labels [N] that nearly minimise sum unary[i, x_i] + sum weight[e] [x_i != x_j].

    Min-sum belief propagation: exact on trees, close on the planar graphs of image pieces.

    Args:
        unary: [N, L], cost of each label at each node.
        edges: [M, 2], pairs of nodes.
        weight: [M], cost of different labels at the two ends, >= 0.
        rounds: of message passing.
    """
    N, M = len(unary), len(edges)
    if M == 0:
        return unary.argmin(1)
    source = np.concatenate([edges[:, 0], edges[:, 1]])
    target = np.concatenate([edges[:, 1], edges[:, 0]])
    back = np.concatenate([np.arange(M, 2 * M), np.arange(M)])
    cap = np.concatenate([weight, weight])[:, None].astype(np.float32)
    unary = unary.astype(np.float32)
    gather = csr_matrix((np.ones(2 * M, np.float32), (target, np.arange(2 * M))), shape=(N, 2 * M))
    message = np.zeros((2 * M, unary.shape[1]), np.float32)
    belief = unary
    for _ in range(rounds):
        outgoing = belief[source] - message[back]
        outgoing -= outgoing.min(axis=1, keepdims=True)
        following = 0.5 * (message + np.minimum(outgoing, cap))
        settled = np.abs(following - message).max() < 1e-2
        message = following
        belief = unary + gather @ message
        if settled:
            break
    return belief.argmin(1)
