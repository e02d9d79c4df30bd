"""What the Panda's joints can do."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


def _row(*values: float) -> NDArray[np.float64]:
    array = np.array(values, np.float64)
    array.flags.writeable = False
    return array


@dataclass(frozen=True, eq=False)
class PandaLimits:
    """Limits of the seven joints, each [7] and read-only; rates and torques hold in both directions."""

    position_lower: NDArray[np.float64]
    """rad"""
    position_upper: NDArray[np.float64]
    """rad"""
    velocity: NDArray[np.float64]
    """rad/s"""
    acceleration: NDArray[np.float64]
    """rad/s^2"""
    jerk: NDArray[np.float64]
    """rad/s^3"""
    effort: NDArray[np.float64]
    """N m"""

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


PANDA_LIMITS = PandaLimits(
    position_lower=_row(-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973),
    position_upper=_row(2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973),
    velocity=_row(2.175, 2.175, 2.175, 2.175, 2.61, 2.61, 2.61),
    acceleration=_row(15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0),
    jerk=_row(7500.0, 3750.0, 5000.0, 6250.0, 7500.0, 10000.0, 10000.0),
    effort=_row(87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0),
)
"""Franka Control Interface documentation, "Robot and interface specifications", constants for Panda."""
