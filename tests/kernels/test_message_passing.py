"""Messages on a graph against the same rounds in numpy, to 1e-3 nats."""

import numpy as np
import pytest

from riseg_drake.kernels.message_passing import passed_messages
from riseg_drake.segmentation.potts import PottsGraph


def in_numpy(unary, graph, message, rounds, settled):
    """Beliefs [N, L] and messages [E, L]."""
    message = message.astype(float)
    belief = unary + np.add.reduceat(message, graph.first, axis=0)
    for _ in range(rounds):
        sent = belief[graph.source] - message[graph.twin]
        sent = np.minimum(sent - sent.min(1, keepdims=True), graph.weight[:, None])
        change = 0.5 * (sent - message)
        message = message + change
        belief = unary + np.add.reduceat(message, graph.first, axis=0)
        if np.abs(change).max() < settled:
            break
    return belief, message


def problem(labels: int, seed: int) -> tuple[np.ndarray, PottsGraph]:
    rng = np.random.default_rng(seed)
    edges = np.array([(i, j) for i in range(40) for j in range(i) if rng.uniform() < 0.1])
    unary = rng.uniform(0, 4, (45, labels)).astype(np.float32)
    return unary, PottsGraph(45, edges, rng.uniform(0, 2, len(edges)))


@pytest.mark.parametrize("labels", [1, 2, 9])
@pytest.mark.parametrize(("rounds", "settled"), [(0, 0.0), (1, 0.0), (2, 0.0), (30, 0.0), (200, 0.01)])
def test_beliefs_and_messages_are_those_of_numpy(labels: int, rounds: int, settled: float) -> None:
    unary, graph = problem(labels, seed=labels)
    start = np.random.default_rng(3).uniform(0, 1, (len(graph.source), labels)).astype(np.float32)
    given = start.copy()
    arrays = (unary, graph.source, graph.twin, graph.weight, graph.first, start)
    belief, message = passed_messages(*arrays, rounds, settled)
    expected_belief, expected_message = in_numpy(unary, graph, start, rounds, settled)
    np.testing.assert_allclose(belief, expected_belief, atol=1e-3)
    np.testing.assert_allclose(message, expected_message, atol=1e-3)
    np.testing.assert_array_equal(start, given)


def test_once_messages_have_settled_no_round_follows() -> None:
    unary, graph = problem(3, seed=5)
    nothing = np.zeros((len(graph.source), 3), np.float32)
    arrays = (unary, graph.source, graph.twin, graph.weight, graph.first, nothing)
    (_, once), (_, often) = (passed_messages(*arrays, rounds, 10.0) for rounds in (1, 50))
    np.testing.assert_array_equal(once, often)
    assert np.abs(once - passed_messages(*arrays, 2, 0.0)[1]).max() > 0.1
