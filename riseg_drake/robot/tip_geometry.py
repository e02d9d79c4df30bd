"""What the command path needs to know of the arm's shape, as plain functions of its joint angles."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class TipGeometry:
    """Where the tip is and how it moves, and so what pushes against it."""

    position: Callable[[NDArray], NDArray[np.float64]]
    """q [7] -> p_WE [3], m."""
    jacobian: Callable[[NDArray], NDArray[np.float64]]
    """q [7] -> J [6, 7] with V_WE = J dq/dt."""

    def force(self, q: NDArray, torque: NDArray) -> float:
        """Size of the force at the tip, N, that explains external torques [7] best."""
        wrench = np.linalg.lstsq(self.jacobian(q).T, torque, rcond=0.02)[0]
        return float(np.linalg.norm(wrench[3:]))
