"""The emulated arm's clock and its status, with a plant that says what it is told to."""

from types import SimpleNamespace

import numpy as np
import pytest

from riseg_drake.stations import emulated_arm
from riseg_drake.stations.emulated_arm import EmulatedArm
from riseg_drake.stations.panda_robot import MOVE

START_US = 5_000_000
Q, V, TORQUE, CONTACT = (np.arange(7.0) + 10 * k for k in range(1, 5))


@pytest.fixture
def arm(monkeypatch):
    """An arm whose physics takes a step every five ticks, and what was asked of it."""
    made = EmulatedArm.__new__(EmulatedArm)
    asked = SimpleNamespace(driver=[], physics=[], desired=[], missed=0)

    def miss():
        asked.missed += 1

    desired = SimpleNamespace(get_mutable_value=lambda: SimpleNamespace(SetFromVector=asked.desired.append))
    robot = SimpleNamespace(q_d=Q + 0.5, v_d=V + 0.5, a_d=V + 0.25, mode=MOVE)
    made.driver = SimpleNamespace(tick=asked.driver.append, miss=miss, robot=robot)
    made.plant = SimpleNamespace(
        get_generalized_contact_forces_output_port=lambda arm: SimpleNamespace(Eval=lambda context: CONTACT),
        get_net_actuation_output_port=lambda arm: SimpleNamespace(Eval=lambda context: TORQUE),
        GetPositions=lambda context, arm=None: Q,
        GetVelocities=lambda context, arm: V,
    )
    made._ticks_a_step, made._ticks, made._start_us = 5, 0, START_US
    made._noise, made._rng = np.array([[1e-3], [2e-3]]), np.random.default_rng(7)
    made._arm = made._context = made._simulator = None
    made._desired = SimpleNamespace(GetMutableData=lambda: desired)
    made._external = np.zeros(7)
    monkeypatch.setattr(emulated_arm, "advance", lambda simulator, time: asked.physics.append(time))
    return made, asked


def test_every_tick_is_a_millisecond_for_the_driver_and_every_fifth_a_step_of_the_physics(arm):
    made, asked = arm
    for _ in range(13):
        made.tick()
    assert asked.driver == [START_US + 1000 * k for k in range(1, 14)]
    assert asked.physics == pytest.approx([0.005, 0.010])
    np.testing.assert_array_equal(asked.desired, [np.concatenate([Q + 0.5, V + 0.5])] * 2)
    assert (made.wall_us, made.state_us) == (START_US + 13_000, START_US + 10_000)


def test_time_that_is_skipped_passes_on_the_wall_and_the_driver_misses_it(arm):
    made, asked = arm
    made.tick()
    made.skip(40_000)
    made.tick()
    assert asked.missed == 1
    assert asked.driver == [START_US + 1000, START_US + 42_000]
    assert made.status().robot_utime == 2000  # the robot's own clock has no gaps


def test_outside_torque_is_what_the_arm_does_to_the_world_and_comes_with_a_time_constant_of_ten_steps(arm):
    made, _ = arm
    for _ in range(15):
        made.tick()
    # A first-order filter by a tenth of what is missing: 1 - 0.9^k after k steps.
    np.testing.assert_allclose(made.status().joint_torque_external, -(1 - 0.9**3) * CONTACT)


def test_a_status_is_the_last_step_carried_on_at_its_velocity_with_noise_of_its_own_on_both(arm):
    made, _ = arm
    for _ in range(8):
        made.tick()
    noise = np.random.default_rng(7).standard_normal((2, 7))
    status = made.status()
    assert (status.utime, status.robot_utime, status.num_joints) == (START_US + 8000, 8000, 7)
    np.testing.assert_allclose(status.joint_position, Q + 0.003 * V + 1e-3 * noise[0])
    np.testing.assert_allclose(status.joint_velocity, V + 2e-3 * noise[1])
    np.testing.assert_array_equal(status.joint_position_desired, Q + 0.5)
    np.testing.assert_array_equal(status.joint_velocity_desired, V + 0.5)
    np.testing.assert_array_equal(status.joint_acceleration_desired, V + 0.25)
    np.testing.assert_array_equal(status.joint_torque, TORQUE)
    np.testing.assert_array_equal(status.joint_torque_desired, TORQUE)
    assert (status.control_command_success_rate, status.robot_mode) == (1.0, MOVE)
    made.driver.robot.mode = MOVE + 1
    assert made.status().control_command_success_rate == 0.0
