import numpy as np
import pytest

from riseg_drake.robot.command_playout import CommandPlayout

START, PERIOD = 1_700_000_000.0, 0.005
COAST = 0.02
Q = np.linspace(-0.5, 0.5, 7)
HERE = np.ones(7)


def parabola(t):
    return Q + 0.3 * t * Q + 0.7 * t**2 * Q, 0.3 * Q + 1.4 * t * Q, 1.4 * Q


EVEN = np.arange(0, 0.1, PERIOD)


def played(is_velocity, times=EVEN):
    playout = CommandPlayout(is_velocity)
    for t in times:
        playout.add(START + t, parabola(t)[int(is_velocity)], HERE)
    return playout


@pytest.mark.parametrize("times", [EVEN, np.cumsum(0.004 + 0.003 * np.arange(20) % 0.007)])
def test_a_parabola_of_joint_angles_comes_out_as_it_is_from_even_and_uneven_stamps(times):
    playout = played(False, times)
    for t in np.linspace(times[2] + 1e-4, times[-3], 50):
        target = playout.at(START + t)
        for found, true, tolerance in zip(target, parabola(t), (1e-7, 1e-5, 1e-2), strict=True):
            np.testing.assert_allclose(found, true, atol=tolerance)


def test_velocities_sum_up_to_the_path_from_where_the_arm_is():
    playout = played(True)
    for t in np.linspace(0.001, 0.09, 50):
        target = playout.at(START + t)
        q, v, a = parabola(t)
        np.testing.assert_allclose(target.position, HERE + q - Q, atol=1e-7)
        np.testing.assert_allclose(target.velocity, v, atol=1e-6)
        np.testing.assert_allclose(target.acceleration, a, atol=1e-3)


@pytest.mark.parametrize("is_velocity", [False, True])
def test_its_motion_goes_on_for_as_long_as_coasting_lasts_and_then_nothing_is_known(is_velocity):
    playout = played(is_velocity)
    end = START + 0.095
    last = playout.at(end)
    coasting = playout.at(end + COAST - 1e-6)
    np.testing.assert_allclose(coasting.position, last.position + COAST * last.velocity, atol=1e-6)
    assert playout.at(end + COAST + 1e-6) is None
    assert playout.moves()


def test_commands_that_stand_still_are_no_motion_and_are_held():
    playout = CommandPlayout(False)
    assert playout.at(START) is None
    for k in range(5):
        playout.add(START + k * PERIOD, Q, HERE)
    assert not playout.moves()
    np.testing.assert_array_equal(playout.at(START + 0.03).position, Q)


def test_a_command_that_is_not_newer_changes_nothing():
    playout = played(False)
    playout.add(START + 0.05, 9 * HERE, HERE)
    assert playout.newest == START + 0.095
    np.testing.assert_allclose(playout.at(START + 0.05).position, parabola(0.05)[0], atol=1e-7)
