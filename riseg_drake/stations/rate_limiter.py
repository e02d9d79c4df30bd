"""What libfranka makes of every command before it goes to the robot: a low pass, and limits of its rates.

By libfranka's own source: `lowpassFilter` (src/lowpass_filter.cpp), `limitRate` (src/rate_limiting.cpp), their
constants (include/franka/rate_limiting.h) and their order (src/control_loop.cpp). The versions for the Panda
(up to 0.9) and for the Franka Research 3 (from 0.10) differ in the constants, and in that speed depends on
position in the latter.
"""

import numpy as np
from numpy.typing import NDArray

from riseg_drake.robot.limits import RobotLimits

TICK = 1e-3
"""Of the robot, s (kDeltaT)."""
ROOM = 1e-3
"""Room to every limit, in its own unit (kLimitEps)."""
LOST_PACKETS = 3
"""Libfranka keeps the Panda as much slower as it gathers speed in this many lost ticks; the FR3 not at all."""


def low_pass_gain(frequency: float) -> float:
    """The share of what is new in the filter's output; `frequency` is the cut-off, Hz."""
    return TICK / (TICK + 1 / (2 * np.pi * frequency))


class RateLimiter:
    """Limits of velocity, acceleration and jerk of the commands to one robot.

    `acceleration` [7], rad/s^2, and `jerk` [7], rad/s^3, are the greatest that come out of it.
    """

    def __init__(self, limits: RobotLimits):
        self._limits = limits
        self.acceleration = limits.acceleration - ROOM
        self.jerk = limits.jerk - ROOM
        lost = LOST_PACKETS if limits.slowing_down is None else 0
        self._velocity_room = ROOM + lost * TICK * self.acceleration

    def velocity_range(self, q: NDArray) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Least and greatest velocity [7], rad/s, that come out of it at q [7], rad."""
        lower, upper = self._limits.velocity_range(q)
        return lower + self._velocity_room, upper - self._velocity_room

    def limit(self, v: NDArray, q_d: NDArray, v_d: NDArray, a_d: NDArray) -> NDArray[np.float64]:
        """The velocity [7], rad/s, of the next tick: `v`, as far as jerk, acceleration and velocity let it.

        `q_d`, rad, `v_d`, rad/s, and `a_d`, rad/s^2, are those of the last tick. The nearer a joint is to
        its greatest speed, the less acceleration is allowed towards it; nothing here brakes ahead of time,
        so that a step of positions is overshot.
        """
        steepness = self.jerk / self.acceleration
        change = TICK * self.jerk
        lower, upper = self.velocity_range(q_d)
        wanted = np.clip((v - v_d) / TICK, a_d - change, a_d + change)
        most = np.minimum(steepness * (upper - v_d), self.acceleration)
        least = np.maximum(steepness * (lower - v_d), -self.acceleration)
        return v_d + TICK * np.maximum(np.minimum(wanted, most), least)
