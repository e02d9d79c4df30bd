"""Would a stream of commands be smooth enough for a Panda? Judged as it was planned, by its stamps.

Stricter than drake-franka-driver, on purpose. There a rate limiter stands between the commands and the robot
(`limit_rate`, see rate_limiter.py), so that a step makes the arm jerk and overshoot, but hardly ever stops it;
other drivers have none, and a client that needs one has planned something that the arm cannot do.
"""

import numpy as np
from numpy.typing import NDArray

from riseg_drake.robot.limits import RobotLimits
from riseg_drake.stations.rate_limiter import TICK

_WINDOW = 0.025  # s; acceleration is judged by the mean speeds in two of them, one after the other
_LONG_WINDOW = 0.1  # s; speed is judged by its mean in one of these
_LONGEST_PREDICTION = 0.05  # s; after a longer gap no more deviation is forgiven
_LONGEST_HELD = 0.04  # s; after a longer gap a stream may also begin anew at rest, ...
_NEAR = 0.003  # rad; ... this near to where the arm is held: the last command before the gap may be lost


class StreamJudge:
    """Knows the targets of the last tenth of a second and says what is wrong with the next one.

    `jitter` is by how much a stamp may be off the time that it was planned for, s; `step` a discontinuity
    that is always forgiven, rad (for velocities 20 times this, rad/s).
    """

    def __init__(self, limits: RobotLimits, is_velocity: bool, jitter: float, step: float):
        self._limits = limits
        self._is_velocity = is_velocity
        self._jitter, self._step = jitter, step
        self._stream: list[tuple[int, NDArray]] = []  # stamps in us, and targets
        self._missed = False
        self._unknown_until = 0  # us

    def begin(self) -> None:
        """The arm holds still: a new stream must begin there."""
        self._stream = []

    def miss(self) -> None:
        """Nobody listened for some time: what comes next is taken as it is, until its speed is known again."""
        self._stream, self._missed = [], True

    def judge(self, target: NDArray, utime: int, held: NDArray, longest_gap: float, q: NDArray) -> str:
        """What is wrong with a target [7] stamped `utime`, us, after `held` [7]; "" if nothing is.

        `q` [7] is where the robot sets itself, rad.

        In libfranka's words, without their `joint_motion_generator_`. A gap longer than `longest_gap`, s, or
        the first target of all, begins a new stream at rest.
        """
        if self._missed:
            self._missed, self._unknown_until = False, utime + int(1e6 * _LONG_WINDOW)
        reason = self._compare(target, utime, held, longest_gap, q) if utime > self._unknown_until else ""
        if not reason:
            earliest = utime - int(2e6 * _LONG_WINDOW)
            self._stream = [item for item in self._stream if earliest <= item[0] < utime] + [(utime, target)]
        return reason

    def _compare(self, target: NDArray, utime: int, held: NDArray, longest_gap: float, q: NDArray) -> str:
        gap = np.inf if not self._stream else max((utime - self._stream[-1][0]) / 1e6, TICK)
        reason = self._break(target, gap, q) if gap <= longest_gap else "velocity_discontinuity"
        if reason and gap > _LONGEST_HELD:  # the arm has been braking since, or stood still
            resting = np.zeros(7) if self._is_velocity else held + np.clip(target - held, -_NEAR, _NEAR)
            self._stream = [(utime - int(1e6 * age), resting) for age in (2 * _LONG_WINDOW, 0.005)]
            reason = self._break(target, 0.005, q)
        return reason

    def _break(self, target: NDArray, gap: float, q: NDArray) -> str:
        return self._velocity_break(target, gap, q) if self._is_velocity else self._position_break(target, gap)

    def _velocity_break(self, v: NDArray, gap: float, q: NDArray) -> str:
        """What is wrong with a velocity [7] that comes `gap` s after the last at q; "" if nothing is."""
        lower, upper = self._limits.velocity_range(q)
        if ((v < lower) | (v > upper)).any():
            return "velocity_limits_violation"
        most = self._limits.acceleration * (min(gap, _LONGEST_PREDICTION) + self._jitter)
        jump = np.abs(v - self._stream[-1][1]) > most + 20 * self._step
        return "acceleration_discontinuity" if jump.any() else ""

    def _position_break(self, q: NDArray, gap: float) -> str:
        """What is wrong with a position [7] that comes `gap` s after the last; "" if nothing is."""
        jitter = self._jitter
        q1, q2, q3, q4 = (self._planned_before(age) for age in (0, _WINDOW, 2 * _WINDOW, _LONG_WINDOW))
        v, v_earlier = (q1 - q2) / _WINDOW, (q2 - q3) / _WINDOW
        change = np.abs(v - v_earlier)
        forgiven = (
            self._limits.acceleration * min(gap, _LONGEST_PREDICTION) ** 2
            + change * gap  # the mean speed of a window lags behind while it grows
            + 2 * jitter * np.abs(v)
            + self._step
        )
        if (np.abs(q - q1 - v * gap) > forgiven).any():
            return "velocity_discontinuity"
        if not self._limits.contains(q):
            return "position_limits_violation"
        most = self._limits.acceleration * (_WINDOW + jitter) + 2 * jitter / _WINDOW * np.abs(v) + 0.02
        if (change > most).any():
            return "acceleration_discontinuity"
        lower, upper = self._limits.velocity_range(q4)  # where the joint was farthest from where it goes
        mean = (q1 - q4) / (_LONG_WINDOW + 2 * jitter)
        if ((mean < lower) | (mean > upper)).any():
            return "velocity_limits_violation"
        return ""

    def _planned_before(self, age: float) -> NDArray:
        """Where the stream was `age` s before its last command, [7]."""
        when = self._stream[-1][0] - 1e6 * age
        later = self._stream[-1]
        for earlier in reversed(self._stream[:-1]):
            if earlier[0] <= when:
                share = (when - earlier[0]) / (later[0] - earlier[0])
                return earlier[1] + share * (later[1] - earlier[1])
            later = earlier
        return later[1]
