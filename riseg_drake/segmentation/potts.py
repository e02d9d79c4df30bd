"""Labels on a graph: what each node says for itself, against borders that cost (a Potts model)."""

import numpy as np
from numpy.typing import NDArray

from riseg_drake.kernels.message_passing import passed_messages

_SETTLED = 1e-2
"""Nats; messages that change by less have settled."""


class PottsGraph:
    """N nodes and the borders between them, in the order in which messages travel."""

    def __init__(self, nodes: int, edges: NDArray[np.intp], weight: NDArray[np.float64]) -> None:
        """Borders [M, 2] between pairs of nodes, and what different labels at their ends cost [M] (>= 0)."""
        alone = np.setdiff1d(np.arange(nodes), edges)
        both = np.concatenate([edges, edges[:, ::-1], np.stack([alone, alone], axis=1)])
        M = len(edges)
        twin = np.concatenate([np.arange(M, 2 * M), np.arange(M), np.arange(2 * M, len(both))])
        # Sorted by target, so that what arrives at a node is summed over neighbouring places.
        order = np.argsort(both[:, 1], kind="stable")
        place = np.empty(len(order), np.intp)
        place[order] = np.arange(len(order))
        self.source = both[order, 0]
        self.twin = place[twin[order]]
        """The message that travels the other way."""
        self.weight = np.concatenate([weight, weight, np.zeros(len(alone))])[order].astype(np.float32)
        self.first = np.searchsorted(both[order, 1], np.arange(nodes))
        """Where the messages to each node begin; a node without borders has one from itself, worth 0."""


def potts_labels(
    unary: NDArray[np.float32],
    graph: PottsGraph,
    message: NDArray[np.float32] | None = None,
    rounds: int = 30,
) -> tuple[NDArray[np.intp], NDArray[np.float32]]:
    """Labels x [N] that nearly minimise sum unary[x_i, i] + sum weight[e] [x_i != x_j].

    Min-sum belief propagation: exact on trees, close on the planar graphs of image pieces.

    Args:
        unary: [L, N], cost of each label at each node.
        graph: the nodes and what their borders cost.
        message: [messages, L] to start from, of a problem much like this one; nothing said yet if None.
        rounds: of message passing, at most.

    Returns:
        x, and the messages at the end.
    """
    if message is None:
        message = np.zeros((len(graph.source), len(unary)), np.float32)
    belief, message = passed_messages(
        np.ascontiguousarray(unary.T, np.float32),
        graph.source,
        graph.twin,
        graph.weight,
        graph.first,
        message,
        rounds,
        _SETTLED,
    )
    return belief.argmin(1), message
