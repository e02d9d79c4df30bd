"""Min-sum belief propagation on a graph, `segmentation.potts`."""

import numpy as np
from numpy.typing import NDArray

from riseg_drake.kernels.compiled import compiled


@compiled
def pass_messages(
    unary: NDArray[np.float32],
    edges: NDArray[np.intp],
    weight: NDArray[np.float32],
    message: NDArray[np.float32],
    rounds: int,
    least_change: float,
) -> NDArray[np.float32]:
    """The beliefs [N, L] after messages were passed along all edges, all at once, a number of times.

    Args:
        unary: [N, L], cost of each label at each node.
        edges: [M, 2], pairs of nodes.
        weight: [M], what different labels at both ends cost.
        message: [2 M, L], renewed in place: to the second node of each edge, then to the first of each.
        rounds: how often, at most.
        least_change: by which a message must change for another round.
    """
    M, labels, half = len(edges), unary.shape[1], np.float32(0.5)
    belief, before, outgoing = unary.copy(), np.empty_like(message), np.empty(labels, np.float32)
    for k in range(2 * M):
        belief[edges[k % M, 1 - k // M]] += message[k]
    for _ in range(rounds):
        before[:] = message
        change = np.float32(0)
        for k in range(2 * M):
            source, twin = edges[k % M, k // M], (k + M) % (2 * M)
            least = np.float32(np.inf)
            for x in range(labels):
                outgoing[x] = belief[source, x] - before[twin, x]
                least = min(least, outgoing[x])
            for x in range(labels):
                # Half a step: messages that all change at once may swing for ever.
                step = half * (min(outgoing[x] - least, weight[k % M]) - before[k, x])
                message[k, x] += step
                change = max(change, abs(step))
        belief[:] = unary
        for k in range(2 * M):
            for x in range(labels):
                belief[edges[k % M, 1 - k // M], x] += message[k, x]
        if change < least_change:
            break
    return belief
