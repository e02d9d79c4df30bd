"""How fast the arm's motions are planned: slower than what its commands may be, unless a scenario says so."""

from dataclasses import replace

from riseg_drake.app.scenario import Scenario
from riseg_drake.app.scenario_file import ScenarioError
from riseg_drake.pushing.push_path import PlannedSpeed
from riseg_drake.pushing.push_planning import PushPlanningParameters
from riseg_drake.pushing.time_law import SpeedLimits
from riseg_drake.stations.hardware import HardwareStationConfig

SHARES = SpeedLimits(velocity=0.8, acceleration=0.6, jerk=0.4)
"""Of what commands may use. The rest is for catching up after a pause; jerk is what a path through poses knows
least exactly."""


def planned_limits(scenario: Scenario) -> SpeedLimits:
    """Shares of the robot's limits for the planned motions of a scenario."""
    otherwise = SpeedLimits()
    if isinstance(scenario.station, HardwareStationConfig):
        command = scenario.station.command.limits
        otherwise = SpeedLimits(
            SHARES.velocity * command.velocity,
            SHARES.acceleration * command.acceleration,
            SHARES.jerk * command.jerk,
        )
    return scenario.push.path.limits.limits(otherwise)


def push_parameters(scenario: Scenario) -> PushPlanningParameters:
    """Those of a scenario, with `planned_limits` in them."""
    limits = planned_limits(scenario)
    speed = PlannedSpeed(limits.velocity, limits.acceleration, limits.jerk)
    return replace(scenario.push, path=replace(scenario.push.path, limits=speed))


def check_limits(scenario: Scenario) -> None:
    """Raise ScenarioError unless the arm can stop in time, and paths are slower than what it may be sent."""
    command = scenario.hardware.command
    try:
        command.check(scenario.hardware.panda.limits)
    except ValueError as error:
        raise ScenarioError(f"station.command: {error}") from None
    limits = planned_limits(scenario)
    for name in ("velocity", "acceleration", "jerk"):
        planned, allowed = getattr(limits, name), getattr(command.limits, name)
        if planned > allowed:
            raise ScenarioError(
                f"push.path.limits.{name} is {planned}, more than the {allowed} that "
                f"station.command.limits.{name} lets through"
            )
