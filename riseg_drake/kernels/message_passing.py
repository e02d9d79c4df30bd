"""Min-sum belief propagation with a Potts model, `segmentation.potts`."""

import numpy as np
from numpy.typing import NDArray

from riseg_drake.kernels.compiled import compiled


@compiled(
    "UniTuple(float32[:, ::1], 2)(float32[:, ::1], intp[::1], intp[::1], float32[::1], intp[::1],"
    "float32[:, ::1], intp, float32)"
)
def passed_messages(
    unary: NDArray[np.float32],
    source: NDArray[np.intp],
    twin: NDArray[np.intp],
    weight: NDArray[np.float32],
    first: NDArray[np.intp],
    message: NDArray[np.float32],
    rounds: int,
    settled: float,
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Beliefs [N, L] and messages [E, L] after some rounds, all messages changing by half a step in each.

    All at once and by whole steps they might swing for ever.

    Args:
        unary: [N, L], cost of each label at each node.
        source: [E], the node that each message comes from; sorted by the node that it goes to.
        twin: [E], the message that travels the other way.
        weight: [E], what different labels at both ends cost.
        first: [N], where the messages to each node begin.
        message: [E, L], to start from.
        rounds: at most.
        settled: messages that change by less have settled.
    """
    nodes, labels = unary.shape
    half = np.float32(0.5)
    belief, outgoing, following = unary.copy(), np.empty(labels, np.float32), message.copy()
    message = message.copy()
    for turn in range(rounds + 1):
        for n in range(nodes):
            end = first[n + 1] if n + 1 < nodes else len(source)
            for k in range(labels):
                belief[n, k] = unary[n, k]
            for e in range(first[n], end):
                for k in range(labels):
                    belief[n, k] += message[e, k]
        if turn == rounds:
            break
        most = np.float32(0)
        for e in range(len(source)):
            s, t, w = source[e], twin[e], weight[e]
            for k in range(labels):
                outgoing[k] = belief[s, k] - message[t, k]
            least = outgoing[0]
            for k in range(1, labels):
                if outgoing[k] < least:
                    least = outgoing[k]
            for k in range(labels):
                sent = outgoing[k] - least
                change = half * ((sent if sent < w else w) - message[e, k])
                following[e, k] = message[e, k] + change
                change = abs(change)
                if change > most:
                    most = change
        message, following = following, message
        if most < settled:
            rounds = turn + 1
    return belief, message
