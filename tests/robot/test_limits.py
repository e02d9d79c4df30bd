import numpy as np
import pytest

from riseg_drake.robot.limits import FR3_LIMITS, PANDA_LIMITS


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


def test_the_fr3_is_slower_near_the_end_it_moves_towards_and_only_there():
    q = FR3_LIMITS.position_middle.copy()
    lowest, highest = FR3_LIMITS.velocity_range(q)
    np.testing.assert_array_equal(highest, FR3_LIMITS.velocity)
    np.testing.assert_array_equal(lowest, -FR3_LIMITS.velocity)
    q[0] = 2.7501 - 0.12
    q[5] = 0.5409 + 0.11
    lowest, highest = FR3_LIMITS.velocity_range(q)
    # Worked by hand: sqrt(2 * 6 * 0.12) - 0.30 and sqrt(2 * 5.5 * 0.11) - 0.35.
    assert highest[0] == pytest.approx(0.9)
    assert lowest[0] == -2.62
    assert lowest[5] == pytest.approx(-0.75)
    assert highest[5] == 4.18


def test_no_speed_is_left_at_and_beyond_an_end_and_all_of_it_away_from_there():
    lowest, highest = FR3_LIMITS.velocity_range(
        np.stack([FR3_LIMITS.position_upper, FR3_LIMITS.position_upper + 1])
    )
    assert (highest == 0).all()
    np.testing.assert_array_equal(lowest, np.stack([-FR3_LIMITS.velocity] * 2))


def test_the_pandas_speed_does_not_depend_on_position():
    lowest, highest = PANDA_LIMITS.velocity_range(PANDA_LIMITS.position_upper)
    np.testing.assert_array_equal(highest, PANDA_LIMITS.velocity)
    np.testing.assert_array_equal(lowest, -PANDA_LIMITS.velocity)
