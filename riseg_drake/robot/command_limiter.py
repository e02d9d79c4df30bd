"""From wishes to commands that a real arm accepts: one small step every 5 ms, whatever is wished for.

The commands are samples of one trajectory that is twice continuously differentiable, with constant jerk or
Ruckig's between two samples. So velocity, acceleration and jerk as differences of the commands themselves,
which is how the arm judges them, are means of the trajectory's and keep its limits.

A wish near to where the trajectory is, such as the next point of a planned path, is followed by a linear
law, which does not chatter; Ruckig, fastest within limits, brings the trajectory there from anywhere else.
A step is only taken if the arm can come to rest after it within the joints' ranges, and on the way there is
nowhere faster than it may be at that position: that stop is kept ready, and is all that happens when there
is nothing to follow, or nothing that may be.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from ruckig import (
    ControlInterface,
    InputParameter,
    Result,
    Ruckig,
    Synchronization,
    Trajectory,
)

from riseg_drake.robot.limits import RobotLimits

_TINY = 1e-3  # rad; no target is taken for one beyond a range for less
_CREEP = 1e-3  # rad/s; Ruckig wants some speed, also where a joint has none towards the end of its range
_LOOKS = 12  # at most, at the speeds of a stop


LONGEST_STOP = 0.25
"""A stop must be possible in this time, s: 0.3 s less some periods in which its cause is noticed."""
LEAST_MARGIN, MOST_MARGIN = 0.005, 0.5
"""Of room to the ends of the joints' ranges, rad: stops go beyond theirs by micrometres, arms follow within
milliradians; and with more than half a radian joints 4 and 6 would hardly turn."""


@dataclass
class CommandLimits:
    """Shares of the robot's limits that commands may use, more than 0 and at most 1."""

    velocity: float = 0.35
    acceleration: float = 0.4
    jerk: float = 0.25
    stop_acceleration: float = 0.8
    """While the arm comes to a stop; more than in motion, so that it stops soon."""
    stop_jerk: float = 0.5
    position_margin: float = 0.03
    """Room that commands keep to the ends of the joints' ranges, rad; less than planned paths do."""

    def __post_init__(self) -> None:
        self.check()

    def check(self) -> None:
        """Raise ValueError for shares that no robot grants; also called after a scenario was read."""
        for name in ("velocity", "acceleration", "jerk", "stop_acceleration", "stop_jerk"):
            share = getattr(self, name)
            if not 0 < share <= 1:
                raise ValueError(
                    f"{name} is {share:g}; expected a share of the arm's limit, more than 0 and at most 1"
                )
        for name in ("acceleration", "jerk"):
            share, stop = getattr(self, name), getattr(self, f"stop_{name}")
            if not stop >= share:
                raise ValueError(
                    f"stop_{name} is {stop:g}; at least {name}, {share:g}, so that a stop is soon over"
                )
        if not LEAST_MARGIN <= self.position_margin <= MOST_MARGIN:
            raise ValueError(
                f"position_margin is {self.position_margin:g}; expected {LEAST_MARGIN:g} to {MOST_MARGIN:g} rad"
            )

    def longest_stop(self, robot: RobotLimits) -> float:
        """No stop takes longer than this, s: from full speed, and full acceleration the wrong way."""
        v, a = self.velocity * robot.velocity, self.acceleration * robot.acceleration
        a_stop, j_stop = self.stop_acceleration * robot.acceleration, self.stop_jerk * robot.jerk
        turning = a / j_stop
        faster = v + a * turning / 2
        return float(np.max(turning + faster / a_stop + a_stop / j_stop))


class Target(NamedTuple):
    """What to be at one period from now: joint angles, rad, and their first two derivatives, each [7]."""

    position: NDArray[np.float64]
    velocity: NDArray[np.float64]
    acceleration: NDArray[np.float64]


class CommandLimiter:
    """The trajectory of the commands, advanced by one period at a time. Knows no clock.

    `position`, `velocity`, `acceleration` are where it is now, each [7]; it begins at rest.
    A period is 0.005 s if nothing else is said.
    """

    BANDWIDTH = 60.0
    """How fast the linear law closes a gap, rad/s: within some 50 ms."""

    def __init__(
        self,
        position: NDArray,
        robot: RobotLimits,
        period: float = 0.005,
        limits: CommandLimits | None = None,
    ):
        limits = limits or CommandLimits()
        self._robot = robot
        self._period = period
        self._velocity_share = limits.velocity
        self._acceleration_limit = limits.acceleration * robot.acceleration
        self._jerk_limit = limits.jerk * robot.jerk
        self._lower = robot.position_lower + limits.position_margin
        self._upper = robot.position_upper - limits.position_margin
        self._otg = Ruckig(7, period)
        self._way = InputParameter(7)
        self._way.max_acceleration = list(self._acceleration_limit)
        self._way.max_jerk = list(self._jerk_limit)
        self._braking = _braking(limits.stop_acceleration * robot.acceleration, limits.stop_jerk * robot.jerk)
        self._acceleration_change = limits.stop_jerk * robot.jerk
        self._calm_braking = _braking(self._acceleration_limit, self._jerk_limit)
        self.restart(position)

    def restart(self, position: NDArray) -> None:
        """Be at rest at `position` [7], rad: for the first command, which is where the arm is."""
        self.position = np.array(position, np.float64)
        self.velocity = np.zeros(7)
        self.acceleration = np.zeros(7)
        self.held_back = False
        """Whether the last wish led out of the joints' ranges; the arm stays within, or comes to a stop."""
        self._stop, self._stopped_for, self._is_calm = self._stop_from_here(self._braking), 0.0, False

    def go_on_from(self, position: NDArray, velocity: NDArray, acceleration: NDArray) -> None:
        """Be in motion, each [7], where somebody else has taken the trajectory meanwhile."""
        limit = self._acceleration_limit
        self.position, self.velocity = np.array(position, np.float64), np.array(velocity, np.float64)
        self.acceleration = np.clip(acceleration, -limit, limit)
        self._stop, self._stopped_for, self._is_calm = self._stop_from_here(self._braking), 0.0, False

    @property
    def at_rest(self) -> bool:
        """Whether nothing moves, to well below what a position can be told."""
        return bool(np.abs(self.velocity).max() < 1e-6 and np.abs(self.acceleration).max() < 1e-3)

    @property
    def rest_position(self) -> NDArray[np.float64]:
        """Where the arm would come to rest if it stopped now, rad [7]."""
        return np.array(self._stop.at_time(self._stop.duration)[0])

    def follow(self, target: Target) -> NDArray[np.float64]:
        """Advance by one period towards a target; returns the command, rad [7]."""
        target, leads_out = self._within_ranges(target)
        candidate = self._follow_linearly(target) or self._approach(target)
        stop = None if candidate is None else self._stop_from(*candidate, self._braking)
        if candidate is None or stop is None or not self._ends_in_ranges(stop):
            self.held_back = True
        elif self._is_slow_enough(stop):
            self.position, self.velocity, self.acceleration = candidate
            self._stop, self._stopped_for, self._is_calm = stop, 0.0, False
            self.held_back = leads_out
            return self.position
        return self.stop()

    def stop(self) -> NDArray[np.float64]:
        """Advance by one period of coming to rest; returns the command, rad [7]."""
        if self._is_calm:  # it was no more than a pause until now
            self._stop, self._stopped_for, self._is_calm = self._stop_from_here(self._braking), 0.0, False
        return self._go_on_with_stop()

    def pause(self) -> NDArray[np.float64]:
        """The same as calmly as motions end, where that is soon enough; returns the command, rad [7]."""
        if self._stopped_for == 0.0 and not self._is_calm:
            calm = self._stop_from_here(self._calm_braking)
            if calm.duration <= LONGEST_STOP and self._ends_in_ranges(calm) and self._is_slow_enough(calm):
                self._stop, self._is_calm = calm, True
        return self._go_on_with_stop()

    def _go_on_with_stop(self) -> NDArray[np.float64]:
        self._stopped_for += self._period
        if self._stopped_for >= self._stop.duration:
            self.position = self.rest_position
            self.velocity, self.acceleration = np.zeros(7), np.zeros(7)
        else:
            self.position, self.velocity, self.acceleration = map(
                np.array, self._stop.at_time(self._stopped_for)[:3]
            )
        return self.position

    def _velocity_range(self, position: NDArray) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Least and greatest velocity, rad/s, each [..., 7], at `position` [..., 7], rad."""
        lowest, highest = self._robot.velocity_range(position)
        return self._velocity_share * lowest, self._velocity_share * highest

    def _within_ranges(self, target: Target) -> tuple[Target, bool]:
        """The nearest target in the joints' ranges, still in the joints that had to be moved; whether any had.

        A joint that was put beyond its margin by hand may come back from there.
        """
        lower, upper = np.minimum(self._lower, self.position), np.maximum(self._upper, self.position)
        position = np.minimum(np.maximum(target.position, lower), upper)
        inside = position == target.position
        leads_out = bool(np.abs(position - target.position).max() > _TINY)
        return Target(position, target.velocity * inside, target.acceleration * inside), leads_out

    def _follow_linearly(self, target: Target) -> tuple[NDArray, NDArray, NDArray] | None:
        """The state after one period of the jerk that brings the target, None if that breaks a limit."""
        T, w = self._period, self.BANDWIDTH
        # Errors against where one gets to without jerk: their decay is that of three equal poles.
        free_velocity = self.velocity + T * self.acceleration
        free_position = self.position + T * self.velocity + T**2 / 2 * self.acceleration
        jerk = (
            w**3 * (target.position - free_position)
            + 3 * w**2 * (target.velocity - free_velocity)
            + 3 * w * (target.acceleration - self.acceleration)
        )
        acceleration = self.acceleration + T * jerk
        velocity = free_velocity + T**2 / 2 * jerk
        position = free_position + T**3 / 6 * jerk
        lowest, highest = self._velocity_range(position)
        # The speed that is still gathered while the acceleration is taken back.
        coming = velocity + acceleration * np.abs(acceleration) / (2 * self._jerk_limit)
        if (
            (np.abs(jerk) > self._jerk_limit).any()
            or (np.abs(acceleration) > self._acceleration_limit).any()
            or (np.minimum(velocity, coming) < lowest).any()
            or (np.maximum(velocity, coming) > highest).any()
        ):
            return None
        return position, velocity, acceleration

    def _approach(self, target: Target) -> tuple[NDArray, NDArray, NDArray] | None:
        """The state after one period of Ruckig's fastest way to the target, None where it finds none."""
        # Between here and there a joint may be at least as fast as at the slower of both ends.
        lowest, highest = self._velocity_range(np.stack([self.position, target.position]))
        lowest, highest = np.minimum(lowest.max(axis=0), -_CREEP), np.maximum(highest.min(axis=0), _CREEP)
        self._way.min_velocity, self._way.max_velocity = lowest.tolist(), highest.tolist()
        self._way.current_position = self.position.tolist()
        self._way.current_velocity = self.velocity.tolist()
        self._way.current_acceleration = self.acceleration.tolist()
        self._way.target_position = target.position.tolist()
        # A little less, since Ruckig wants a target that could be left again.
        self._way.target_velocity = np.clip(target.velocity, 0.999 * lowest, 0.999 * highest).tolist()
        self._way.target_acceleration = [0.0] * 7
        way = Trajectory(7)
        # Not `update`, which takes an input that did not change for one that it has answered already.
        if self._otg.calculate(self._way, way) not in (Result.Working, Result.Finished):
            return None
        position, velocity, acceleration = way.at_time(self._period)[:3]
        return np.array(position), np.array(velocity), np.array(acceleration)

    def _stop_from_here(self, braking: InputParameter) -> Trajectory:
        return self._stop_from(self.position, self.velocity, self.acceleration, braking)

    def _stop_from(
        self, position: NDArray, velocity: NDArray, acceleration: NDArray, braking: InputParameter
    ) -> Trajectory:
        braking.current_position = position.tolist()
        braking.current_velocity = velocity.tolist()
        braking.current_acceleration = acceleration.tolist()
        stop = Trajectory(7)
        result = self._otg.calculate(braking, stop)
        if result not in (Result.Working, Result.Finished):
            raise RuntimeError(f"no stop from {position}, {velocity}, {acceleration}: {result}")
        return stop

    def _ends_in_ranges(self, stop: Trajectory) -> bool:
        """Whether a stop ends in the joints' ranges, or not further outside than it began.

        On its way there it goes beyond both by micrometres at most, which is what the margin is for.
        """
        start, end = np.array(stop.at_time(0.0)[0]), np.array(stop.at_time(stop.duration)[0])
        lower, upper = np.minimum(self._lower, start), np.maximum(self._upper, start)
        return bool(((lower - 1e-9 <= end) & (end <= upper + 1e-9)).all())

    def _is_slow_enough(self, stop: Trajectory) -> bool:
        """Whether no joint is anywhere on the way of a stop faster than it may be there."""
        if self._robot.slowing_down is None:  # the laws that made the step have kept to that
            return True
        if self._is_slow_at_both_ends(stop):
            return True
        commands = np.unique(np.linspace(0, np.ceil(stop.duration / self._period), _LOOKS).round())
        times = np.minimum(self._period * commands, stop.duration)
        position, velocity = np.array([stop.at_time(time)[:2] for time in times]).swapaxes(0, 1)
        lowest, highest = self._velocity_range(position)
        return bool(((lowest <= velocity) & (velocity <= highest)).all())

    def _is_slow_at_both_ends(self, stop: Trajectory) -> bool:
        """Whether no joint gets faster than it may be where the stop begins and ends; between it may be faster.

        That settles most stops, which are slow and far from the ends of the ranges, at a tenth of the effort.
        """
        start, velocity, acceleration = stop.at_time(0.0)[:3]
        end = stop.at_time(stop.duration)[0]
        gathered = np.square(acceleration) / (2 * self._acceleration_change)
        fastest = np.abs(velocity) + gathered
        lowest, highest = self._velocity_range(np.array([start, end]))
        return bool((fastest < np.minimum(highest.min(axis=0), -lowest.max(axis=0))).all())


def _braking(acceleration: NDArray, jerk: NDArray) -> InputParameter:
    """Coming to rest with at most these, rad/s^2 and rad/s^3, each [7]."""
    braking = InputParameter(7)
    braking.control_interface = ControlInterface.Velocity
    braking.synchronization = Synchronization.Phase  # straight on, where that is possible
    braking.max_acceleration, braking.max_jerk = list(acceleration), list(jerk)
    braking.target_velocity = [0.0] * 7
    return braking
