"""The simulated world behind an emulated Panda driver: moves as its robot does, and measures itself."""

import numpy as np
from drake import lcmt_panda_status
from numpy.typing import NDArray
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from riseg_drake.stations.panda_driver import PandaDriver, PandaDriverConfig
from riseg_drake.stations.panda_robot import MOVE
from riseg_drake.stations.physics import advance
from riseg_drake.stations.simulated import SimulatedStationConfig, add_world, start_position

TICK_US = 1000
"""One tick of the robot, microseconds."""

_FILTER = 0.1  # share of each tick's torque in the filtered external torque: a time constant of 10 ms


class EmulatedArm:
    """A Panda with its table and objects, one millisecond a `tick`, on a clock of its own.

    `driver` decides what the arm does. Raises ValueError (SceneError) for settings that cannot be.
    """

    def __init__(self, config: SimulatedStationConfig, driver: PandaDriverConfig, seed: int, wall_us: int):
        # The physics takes the steps that it takes in `riseg run`; joints go on evenly in between.
        self._ticks_a_step = max(1, round(1e6 * config.time_step / TICK_US))
        builder = DiagramBuilder()
        world = add_world(builder, config, seed, 1e-6 * TICK_US * self._ticks_a_step)
        self.plant = world.plant
        self.driver = PandaDriver(driver, np.array(start_position(config)), config.panda.limits)
        self._noise = np.array([[driver.position_noise], [driver.velocity_noise]])
        self._rng = np.random.default_rng([seed, 3])
        self._arm = world.panda.arm
        port = self.plant.get_desired_state_input_port(self._arm)
        builder.ExportInput(port, "desired_state")
        diagram = builder.Build()
        self._simulator = Simulator(diagram)
        root = self._simulator.get_mutable_context()
        self._desired = diagram.GetInputPort("desired_state").FixValue(root, self._desired_state())
        self._context = self.plant.GetMyMutableContextFromRoot(root)
        self._external = np.zeros(7)
        self._start_us, self._ticks = wall_us, 0

    @property
    def state_us(self) -> int:
        """The wall time of the last step of the physics, to which `positions` belong, microseconds."""
        return self.wall_us - TICK_US * (self._ticks % self._ticks_a_step)

    @property
    def wall_us(self) -> int:
        """The wall time of the last tick, microseconds."""
        return self._start_us + TICK_US * self._ticks

    def skip(self, microseconds: int) -> None:
        """Let wall time pass in which nothing happened, and nobody listened."""
        self._start_us += microseconds
        self.driver.miss()

    def tick(self) -> None:
        """One millisecond."""
        self._ticks += 1
        self.driver.tick(self.wall_us)
        if self._ticks % self._ticks_a_step:
            return
        self._desired.GetMutableData().get_mutable_value().SetFromVector(self._desired_state())
        advance(self._simulator, 1e-6 * TICK_US * self._ticks)
        port = self.plant.get_generalized_contact_forces_output_port(self._arm)
        self._external += _FILTER * (port.Eval(self._context) - self._external)

    def positions(self) -> NDArray[np.float64]:
        """Positions [num_positions] of the plant, in its order: what a camera's picture depends on."""
        return np.array(self.plant.GetPositions(self._context))

    def status(self) -> lcmt_panda_status:
        """What a driver publishes at this tick."""
        robot, plant, context = self.driver.robot, self.plant, self._context
        torque = plant.get_net_actuation_output_port(self._arm).Eval(context)
        message = lcmt_panda_status()
        message.utime = self.wall_us
        message.robot_utime = TICK_US * self._ticks
        message.num_joints = 7
        velocity = plant.GetVelocities(context, self._arm)
        since = 1e-6 * (self.wall_us - self.state_us)
        position_error, velocity_error = self._noise * self._rng.standard_normal((2, 7))
        message.joint_position = plant.GetPositions(context, self._arm) + since * velocity + position_error
        message.joint_velocity = velocity + velocity_error
        message.joint_position_desired = robot.q_d
        message.joint_velocity_desired = robot.v_d
        message.joint_acceleration_desired = robot.a_d
        message.joint_torque = torque
        message.joint_torque_desired = torque
        # libfranka tells what the arm does to the world, Drake what the world does to the arm.
        message.joint_torque_external = -self._external
        message.control_command_success_rate = float(robot.mode == MOVE)
        message.robot_mode = robot.mode
        return message  # control_mode stays 0: the driver never sets it

    def _desired_state(self) -> NDArray[np.float64]:
        return np.concatenate([self.driver.robot.q_d, self.driver.robot.v_d])
