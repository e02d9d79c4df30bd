"""What the arm does along the path of a push."""

import numpy as np
import pytest
from pydrake.trajectories import PiecewisePolynomial

from riseg_drake.pushing.arm_path import ArmPhase, PushPath

KNOTS = np.arange(21.0).reshape(3, 7).T  # 0..6 at 0 s, 7..13 at 1 s, 14..20 at 4 s
PATH = PushPath(PiecewisePolynomial.FirstOrderHold([0.0, 1.0, 4.0], KNOTS), push_start=1.0, push_end=3.0)


def test_it_lasts_as_long_as_its_trajectory():
    assert PATH.duration == 4.0


@pytest.mark.parametrize(("time", "first"), [(-1.0, 0.0), (0.0, 0.0), (0.5, 3.5), (4.0, 14.0), (9.0, 14.0)])
def test_before_its_start_and_beyond_its_end_it_stands(time, first):
    np.testing.assert_allclose(PATH.position(time), first + np.arange(7))


@pytest.mark.parametrize(
    ("time", "phase"),
    [
        (0.0, ArmPhase.APPROACH),
        (0.999, ArmPhase.APPROACH),
        (1.0, ArmPhase.PUSH),
        (2.999, ArmPhase.PUSH),
        (3.0, ArmPhase.RETREAT),
        (9.0, ArmPhase.RETREAT),
    ],
)
def test_a_phase_begins_at_its_time(time, phase):
    assert PATH.phase(time) is phase
