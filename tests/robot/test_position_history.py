import numpy as np
import pytest

from riseg_drake.robot.position_history import PositionHistory


def filled(times):
    history = PositionHistory()
    for t in times:
        history.add(t, np.full(7, 2 * t), np.full(7, 2.0))
    return history


def test_between_two_the_straight_line_is_taken():
    position, velocity = filled([1.0, 1.01, 1.02]).at(1.0137)
    np.testing.assert_allclose(position, 2 * 1.0137)
    np.testing.assert_allclose(velocity, 2.0)


def test_order_and_repetition_do_not_matter():
    history = filled([1.02, 1.0, 1.01, 1.0, 1.02])
    np.testing.assert_allclose(history.at(1.005)[0], 2.01)
    assert history.newest == 1.02


@pytest.mark.parametrize("time", [0.99, 1.021])
def test_nothing_is_guessed_outside(time):
    assert filled([1.0, 1.02]).at(time) is None


def test_both_ends_are_known():
    history = filled([1.0, 1.02])
    np.testing.assert_allclose(history.at(1.0)[0], 2.0)
    np.testing.assert_allclose(history.at(1.02)[0], 2.04)


def test_the_past_is_forgotten():
    history = filled(np.arange(0, 30, 0.01))
    assert history.at(10.0) is None
    assert history.at(28.0) is not None


def test_a_time_far_ahead_does_not_empty_it_for_good():
    history = filled(np.arange(0, 8, 0.01))
    history.add(3600.0, np.zeros(7), np.zeros(7))
    for t in np.arange(8, 9, 0.01):
        history.add(t, np.full(7, 2 * t), np.full(7, 2.0))
    np.testing.assert_allclose(history.at(8.505)[0], 2 * 8.505)
    assert history.newest < 9


def test_a_clock_that_was_set_back_is_gone_on_with():
    history = filled(np.arange(3600, 3610, 0.01))
    for t in np.arange(0, 1, 0.01):
        history.add(t, np.full(7, 2 * t), np.full(7, 2.0))
    np.testing.assert_allclose(history.at(0.505)[0], 2 * 0.505)
    assert history.newest < 1
