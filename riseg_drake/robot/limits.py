"""What the joints of each robot can do."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


def _row(*values: float) -> NDArray[np.float64]:
    array = np.array(values, np.float64)
    array.flags.writeable = False
    return array


@dataclass(frozen=True, eq=False)
class SlowingDown:
    """How the greatest speed falls towards the end of a joint's range; rows of [7], read-only.

    At a distance d, rad, from the end that it moves towards it is sqrt(2 deceleration d) - offset, rad/s.
    """

    deceleration: NDArray[np.float64]
    """rad/s^2"""
    offset: NDArray[np.float64]
    """rad/s"""

    def speed(self, distance: NDArray) -> NDArray[np.float64]:
        """The greatest speed, rad/s, at distances [..., 7], rad, from the end; 0 within some milliradians."""
        return np.maximum(np.sqrt(2 * self.deceleration * np.maximum(distance, 0)) - self.offset, 0)


@dataclass(frozen=True, eq=False)
class RobotLimits:
    """Limits of the seven joints, each [7] and read-only; rates and torques hold in both directions."""

    position_lower: NDArray[np.float64]
    """rad"""
    position_upper: NDArray[np.float64]
    """rad"""
    velocity: NDArray[np.float64]
    """rad/s, amid the range."""
    acceleration: NDArray[np.float64]
    """rad/s^2"""
    jerk: NDArray[np.float64]
    """rad/s^3"""
    effort: NDArray[np.float64]
    """N m"""
    slowing_down: SlowingDown | None = None
    """Towards the ends of the range; None where speed does not depend on position."""

    @property
    def position_middle(self) -> NDArray[np.float64]:
        """Middle of each joint's range, rad, [7]."""
        return (self.position_lower + self.position_upper) / 2

    def room(self, q: NDArray) -> NDArray[np.float64]:
        """How far q [..., 7] is from the nearer end of each joint's range, rad; negative outside."""
        return np.minimum(q - self.position_lower, self.position_upper - q)

    def contains(self, q: NDArray, margin: float = 0.0) -> bool:
        """Whether every joint of q [7] keeps `margin` rad to both ends of its range."""
        return bool((self.room(q) >= margin).all())

    def velocity_range(self, q: NDArray) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Least and greatest velocity, rad/s, each [..., 7], of joints at q [..., 7], rad.

        Both are concave in size along each joint: between two positions they are largest in size in between.
        """
        if self.slowing_down is None:
            fastest = np.full(np.shape(q), self.velocity)
            return -fastest, fastest
        room = np.array([q - self.position_lower, self.position_upper - q])
        downwards, upwards = np.minimum(self.slowing_down.speed(room), self.velocity)
        return -downwards, upwards


def check_start_position(start_position: Sequence[float], limits: RobotLimits, margin: float = 0.0) -> None:
    """Raise ValueError where joint angles [7], rad, keep no `margin` to the ends; empty ones are none."""
    for index, q in enumerate(start_position):
        lower, upper = limits.position_lower[index] + margin, limits.position_upper[index] - margin
        if not lower <= q <= upper:
            raise ValueError(
                f"start_position is {q:g} for joint {index + 1}; expected {lower:g} to {upper:g} rad"
            )


PANDA_LIMITS = RobotLimits(
    position_lower=_row(-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973),
    position_upper=_row(2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973),
    velocity=_row(2.175, 2.175, 2.175, 2.175, 2.61, 2.61, 2.61),
    acceleration=_row(15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0),
    jerk=_row(7500.0, 3750.0, 5000.0, 6250.0, 7500.0, 10000.0, 10000.0),
    effort=_row(87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0),
)
"""Franka Control Interface documentation, "Robot and interface specifications", constants for Panda."""

FR3_LIMITS = RobotLimits(
    position_lower=_row(-2.7501, -1.7918, -2.9065, -3.0481, -2.8101, 0.5409, -3.0196),
    position_upper=_row(2.7501, 1.7918, 2.9065, -0.1458, 2.8101, 4.5205, 3.0196),
    velocity=_row(2.62, 2.62, 2.62, 2.62, 5.26, 4.18, 5.26),
    acceleration=_row(*[10.0] * 7),
    jerk=_row(*[5000.0] * 7),
    effort=_row(87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0),
    slowing_down=SlowingDown(
        deceleration=_row(6.0, 2.585, 3.5, 4.0, 17.0, 5.5, 17.0),
        offset=_row(0.30, 0.20, 0.20, 0.30, 0.35, 0.35, 0.35),
    ),
)
"""The same page, constants for Franka Research 3, with its position based velocity limits."""

ROBOTS = {"panda": PANDA_LIMITS, "fr3": FR3_LIMITS}
"""By the name that a scenario gives a robot (`station.panda.robot`)."""
