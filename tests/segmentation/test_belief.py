"""What frames add to the evidence of borders, by hand."""

from types import SimpleNamespace

import numpy as np
import pytest

from riseg_drake.segmentation.belief import Belief, BeliefParameters
from riseg_drake.segmentation.observation import Observation


def belief(evidence, alike, inherited=(0.0, 0.0)):
    keyframe = SimpleNamespace(borders=np.array([[0, 1], [1, 2]]))
    known = (np.array(values) for values in ([2.0, -1.0], evidence, alike, inherited))
    return Belief(keyframe, *known, *[None] * 6)


def seen(evidence, strangers=(False, False, False)):
    return Observation(*[None] * 3, np.array(evidence), *[None] * 2, np.array(strangers))


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
    for k, frame in enumerate(([1.0, 0.5], [1.5, 0.25], [-3.0, -3.0], [1.0, 0.5])):
        told = told.with_evidence(seen(frame), parameters)
        np.testing.assert_allclose(told.evidence, evidence[k])
        np.testing.assert_allclose(told.bond, told.prior + evidence[k])
        if alike is not None:
            np.testing.assert_allclose(told.alike, alike[k])


@pytest.mark.parametrize(("nats", "most"), [(9.0, 12.0), (-9.0, -12.0)])
def test_evidence_adds_up_to_no_more_than_twelve_nats_either_way(nats, most):
    told = belief([0.0, most / 2], [0.0, 0.0])
    told = told.with_evidence(seen([nats, nats]), BeliefParameters())
    np.testing.assert_allclose(told.evidence, [nats, most])


@pytest.mark.parametrize(
    ("stranger", "evidence", "inherited"),
    [(0, [3.5, -6.0], [0.0, -4.0]), (1, [3.5, -2.0], [0.0, 0.0]), (2, [1.0, -2.0], [-2.5, 0.0])],
)
def test_of_what_is_no_part_of_its_body_nothing_is_known_but_what_was_seen_of_it(stranger, evidence, inherited):
    told = belief([1.0, -5.0], [0.0, 0.0], [-2.5, -4.0])
    told = told.with_evidence(seen([0.0, -1.0], np.arange(3) == stranger), BeliefParameters())
    np.testing.assert_allclose(told.evidence, evidence)
    np.testing.assert_allclose(told.inherited, inherited)
