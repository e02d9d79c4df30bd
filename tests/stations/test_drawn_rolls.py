"""What rolls on a table is one thing, and what stands still beside it none; one of many drawn scenes."""

import numpy as np
import pytest
from pydrake.math import RigidTransform

from riseg_drake.stations.object_models import find_models
from tests.stations.drawn_reversals import FOLDERS, standing
from tests.stations.drawn_rolls import is_one, outcome, rolled


def test_a_can_that_rolls_goes_as_far_as_its_side_and_stays_on_the_table():
    (can,) = (model for model in find_models(FOLDERS) if model.name == "can_soda_lying")
    start = standing(can, np.array([0.5, 0.1]), 0.7)
    end = rolled(can, start, 0.5)
    heights = [(X.rotation().matrix() @ can.corners.T)[2] + X.translation()[2] for X in (start, end)]
    np.testing.assert_allclose([h.min() for h in heights], 0.0, atol=1e-3)
    turn = (
        RigidTransform(end.rotation().multiply(start.rotation().inverse()), [0, 0, 0]).rotation().ToAngleAxis()
    )
    assert abs(turn.angle()) == pytest.approx(0.5)
    assert turn.axis()[2] == pytest.approx(0.0, abs=1e-9)
    middles = [X.multiply(can.corners.mean(0)) for X in (start, end)]
    way = middles[1] - middles[0]
    radius = np.ptp(heights[0]) / 2
    assert np.linalg.norm(way[:2]) == pytest.approx(0.5 * radius, rel=0.02)
    # What lay below the middle goes backwards: the upper side leads.
    assert np.cross(turn.axis() * turn.angle(), [0, 0, radius]) @ way > 0


@pytest.mark.renders
def test_two_that_roll_are_one_each_and_what_stands_still_is_none():
    rolling, found_still = outcome(23)
    assert [is_one(ids) for _, _, ids in rolling] == [True, True]
    assert len({a for _, _, ids in rolling for a in ids}) == 2
    assert found_still == []
