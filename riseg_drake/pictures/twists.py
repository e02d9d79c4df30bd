"""Spatial twists as plots: six numbers each, with what is not known about them."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Ellipse
from numpy.typing import NDArray

from riseg_drake.pictures.body_frames import group_colors
from riseg_drake.pictures.panels import INK

UNITS = np.array([180 / np.pi] * 3 + [1e3] * 3)
"""Degrees and millimetres, in which twists are shown."""
NAMES = (
    r"$\omega_x$ [°]",
    r"$\omega_y$ [°]",
    r"$\omega_z$ [°]",
    r"$v_x$ [mm]",
    r"$v_y$ [mm]",
    r"$v_z$ [mm]",
)
_SPREAD = 0.7
"""Of the members of one component, side by side, as a share of the distance to the next."""


def plot_twists(axes: Axes, V_S: NDArray, group: NDArray, covariance: NDArray | None = None) -> None:
    """The six components of twists [K, 6], side by side, each twist in its group's colour.

    Args:
        axes: to draw on.
        V_S: [K, 6], [omega; v], radian and metre per pair.
        group: [K], 0, 1, ...; -1 for none.
        covariance: [K, 6, 6]; a bar of one standard deviation each way, none if None.
    """
    order = np.argsort(group, kind="stable")
    beside = _SPREAD * (np.arange(len(V_S)) / max(len(V_S) - 1, 1) - 0.5)
    shown, colors = (V_S * UNITS)[order], [group_colors(group)[k] for k in order]
    axes.axhline(0, color=INK, lw=0.5)
    for k in range(6):
        if covariance is not None:
            sigma = np.sqrt(covariance[order, k, k]) * UNITS[k]
            axes.vlines(k + beside, shown[:, k] - sigma, shown[:, k] + sigma, colors, lw=0.8, alpha=0.6)
        axes.scatter(k + beside, shown[:, k], s=9, c=colors, lw=0, zorder=3)
    axes.set_xticks(range(6), NAMES)
    axes.set_xlim(-0.6, 5.6)


def plot_twist_ellipses(
    axes: Axes, V_S: NDArray, group: NDArray, covariance: NDArray, components: tuple[int, int]
) -> None:
    """Two components of each twist as a dot in an ellipse of one standard deviation.

    Args:
        axes: to draw on.
        V_S: [K, 6], [omega; v], radian and metre per pair.
        group: [K], 0, 1, ...; -1 for none.
        covariance: [K, 6, 6].
        components: which two of the six, 0 to 5.
    """
    which = list(components)
    scale = UNITS[which]
    for V, C, color in zip(V_S[:, which] * scale, covariance, group_colors(group), strict=True):
        eigenvalue, axis = np.linalg.eigh(C[np.ix_(which, which)] * np.outer(scale, scale))
        width, height = 2 * np.sqrt(np.maximum(eigenvalue, 0))
        angle = np.degrees(np.arctan2(axis[1, 0], axis[0, 0]))
        axes.add_patch(Ellipse(tuple(V), width, height, angle=angle, fc=color + "22", ec=color + "aa", lw=0.8))
    x, y = (V_S[:, which] * scale).T
    axes.scatter(x, y, s=7, c=group_colors(group), lw=0, zorder=3)
    axes.autoscale_view()
    axes.set_xlabel(NAMES[which[0]], fontsize=9, color=INK)
    axes.set_ylabel(NAMES[which[1]], fontsize=9, color=INK)
