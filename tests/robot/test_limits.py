import numpy as np
import pytest

from riseg_drake.robot.limits import PANDA_LIMITS


def test_room_is_measured_to_the_nearer_end_and_negative_outside():
    q = PANDA_LIMITS.position_middle.copy()
    q[2] = PANDA_LIMITS.position_upper[2] - 0.1
    q[4] = PANDA_LIMITS.position_lower[4] - 0.2
    room = PANDA_LIMITS.room(q)
    assert room[2] == pytest.approx(0.1)
    assert room[4] == pytest.approx(-0.2)


def test_contains_asks_every_joint_for_the_margin():
    q = PANDA_LIMITS.position_lower + 0.05
    assert PANDA_LIMITS.contains(q, margin=0.04)
    assert not PANDA_LIMITS.contains(q, margin=0.06)


def test_nobody_can_change_the_limits():
    with pytest.raises(ValueError, match="read-only"):
        PANDA_LIMITS.velocity[0] = 9
    assert (PANDA_LIMITS.jerk / PANDA_LIMITS.acceleration == 500).all()
    assert np.all(PANDA_LIMITS.position_lower < PANDA_LIMITS.position_upper)
