"""What frames add to the evidence of borders, by hand."""

import numpy as np
import pytest

from riseg_drake.segmentation.belief import Belief, BeliefParameters


def belief(evidence, alike):
    return Belief(None, np.array([2.0, -1.0]), np.array(evidence), np.array(alike), *[None] * 6)


@pytest.mark.parametrize(
    ("once", "evidence", "alike"),
    [
        # Moving alike counts as the most that a push says, 1.5 and 0.5; moving apart counts each time.
        (
            True,
            [[1.0, 0.5], [1.5, 0.5], [-1.5, -2.5], [-1.5, -2.5]],
            [[1.0, 0.5], [1.5, 0.5], [1.5, 0.5], [1.5, 0.5]],
        ),
        (False, [[1.0, 0.5], [2.5, 0.75], [-0.5, -2.25], [0.5, -1.75]], None),
    ],
)
def test_moving_alike_counts_once_and_moving_apart_each_time(once, evidence, alike):
    told, parameters = belief([0.0, 0.0], [0.0, 0.0]), BeliefParameters(once=once)
    for k, seen in enumerate(([1.0, 0.5], [1.5, 0.25], [-3.0, -3.0], [1.0, 0.5])):
        told = told.with_evidence(np.array(seen), parameters)
        np.testing.assert_allclose(told.evidence, evidence[k])
        np.testing.assert_allclose(told.bond, told.prior + evidence[k])
        if alike is not None:
            np.testing.assert_allclose(told.alike, alike[k])


@pytest.mark.parametrize(("seen", "most"), [(9.0, 12.0), (-9.0, -12.0)])
def test_evidence_adds_up_to_no_more_than_twelve_nats_either_way(seen, most):
    told = belief([0.0, most / 2], [0.0, 0.0])
    told = told.with_evidence(np.full(2, seen), BeliefParameters())
    np.testing.assert_allclose(told.evidence, [seen, most])
