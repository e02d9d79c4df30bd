"""A rigid motion and then a small screw, `segmentation.alignment`."""

import numpy as np
from numpy.typing import NDArray

from riseg_drake.kernels.compiled import compiled

_SMALL_ANGLE = 1e-4
"""rad; below it the closed forms lose digits and their series are exact to 1e-16."""


@compiled("float64[:, ::1](float64[::1], float64[::1], float64[:, ::1])")
def screwed(V: NDArray[np.float64], centre: NDArray[np.float64], X: NDArray[np.float64]) -> NDArray[np.float64]:
    """The motion X [4, 4], and after it the twist V = [omega; v] [6] about a centre [3] over unit time."""
    out = X.copy()
    omega, v = V[:3], V[3:]
    squared = (omega**2).sum()
    a, b, c = 1 - squared / 6, 0.5 - squared / 24, 1 / 6 - squared / 120
    if squared > _SMALL_ANGLE**2:
        angle = np.sqrt(squared)
        a, b = np.sin(angle) / angle, (1 - np.cos(angle)) / squared
        c = (1 - a) / squared
    # Rodrigues' formula, on each column; the last one is a point.
    for k in range(4):
        p = X[:3, k] - centre if k == 3 else X[:3, k].copy()
        first = np.cross(omega, p)
        out[:3, k] = p + a * first + b * np.cross(omega, first)
    first = np.cross(omega, v)
    out[:3, 3] += v + b * first + c * np.cross(omega, first) + centre
    return out
