"""About which axes a thing is a body of revolution: turned about one of them, it merely rolls."""

import numpy as np
from numpy.typing import NDArray

ROUND = 0.08
"""Share of its greatest radius by which a body of revolution may be out of round: an octagon is by 0.076."""
_ROUND_ABOUT = np.linspace(0.0, 2.0 * np.pi, 72, endpoint=False)
_UPWARDS = np.radians([-60.0, -40.0, -20.0, 0.0, 20.0, 40.0, 60.0])


def axes_of_revolution(points: NDArray, candidates: NDArray) -> NDArray:
    """Those of some axes through a body's centre of mass about which its hull is one of revolution.

    It is where, however steep one looks, the hull reaches as far out on all sides. What decides is the shape,
    as a cube has the moments of inertia of a ball.

    Args:
        points: [n, 3], m, whose convex hull holds the body, from its centre of mass.
        candidates: [m, 3], unit vectors; one along another that was taken is left out.

    Returns:
        Unit vectors [k, 3]: none for most things, one for a can, three for a ball.
    """
    axes: list[NDArray] = []
    for axis in candidates:
        if not any(abs(axis @ known) > 0.99 for known in axes) and _out_of_round(points, axis) < ROUND:
            axes.append(axis)
    return np.array(axes[:3]).reshape(-1, 3)


def _out_of_round(points: NDArray, axis: NDArray) -> float:
    """The difference between the furthest and the nearest that a hull reaches, by its greatest radius."""
    x = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    x /= np.linalg.norm(x)
    out = np.outer(np.cos(_ROUND_ABOUT), x) + np.outer(np.sin(_ROUND_ABOUT), np.cross(axis, x))  # [72, 3]
    reach = np.array(
        [(points @ (np.cos(up) * out + np.sin(up) * axis).T).max(axis=0) for up in _UPWARDS]  # [7, 72]
    )
    radius = float((points @ out.T).max())
    return float(np.ptp(reach, axis=1).max()) / radius
