"""Body frames in space while their body moves: from above as a plot, and as triads in Meshcat."""

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray
from pydrake.geometry import Cylinder, Meshcat, Rgba
from pydrake.math import RigidTransform, RotationMatrix

from riseg_drake.pictures.object_colors import hex_color

_AXIS_COLORS = (hex_color(6), hex_color(3), hex_color(5))
"""Of x, y and z: vermilion, bluish green, blue."""


def plot_moving_frames(
    axes: Axes, corners_W0: NDArray, corners_W1: NDArray, X_WB0: NDArray, X_WB1: NDArray, color: str
) -> None:
    """A body and frames on it before and after a motion, seen from above.

    Args:
        axes: to draw on.
        corners_W0: [N, 2 or more], the body's outline before, m.
        corners_W1: the same after.
        X_WB0: [K, 4, 4], the frames before.
        X_WB1: [K, 4, 4], the frames after.
        color: of the body, `#rrggbb`.
    """
    for corners, line, fill in ((corners_W0, "--", "00"), (corners_W1, "-", "30")):
        axes.fill(corners[:, 0], corners[:, 1], fc=color + fill, ec=color, ls=line, lw=1.2)
    length = 0.12 * np.ptp(corners_W0[:, :2])
    for X_WB, alpha in ((X_WB0, 0.35), (X_WB1, 1.0)):
        start = X_WB[:, :2, 3]
        for k, axis_color in enumerate(_AXIS_COLORS):
            end = start + length * X_WB[:, :2, k]
            x, y = np.stack([start, end], axis=-1).transpose(1, 2, 0)
            axes.plot(x, y, color=axis_color, alpha=alpha, lw=1.6, solid_capstyle="round")
    way = X_WB1[:, :2, 3] - X_WB0[:, :2, 3]
    x, y = X_WB0[:, :2, 3].T
    axes.quiver(x, y, *way.T, angles="xy", scale_units="xy", scale=1, width=0.004, color="black", zorder=4)
    axes.set_aspect("equal")


def set_triad(meshcat: Meshcat, path: str, X_PB: NDArray, length: float) -> None:
    """The three axes of a frame B at X_PB [4, 4] as rods of that length, m; P is that of the path's parent."""
    meshcat.SetTransform(path, RigidTransform(X_PB))
    for k, (name, color) in enumerate(zip("xyz", _AXIS_COLORS, strict=True)):
        direction = np.eye(3)[k]
        rod = RigidTransform(RotationMatrix.MakeFromOneVector(direction, 2), 0.5 * length * direction)
        red, green, blue = (value / 255 for value in bytes.fromhex(color[1:]))
        meshcat.SetObject(f"{path}/{name}", Cylinder(0.04 * length, length), Rgba(red, green, blue))
        meshcat.SetTransform(f"{path}/{name}", rod)
