"""The graph whose clusters are the moving bodies: who is like whom."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from numpy.typing import NDArray

from riseg_drake.pictures.body_frames import group_colors, pale
from riseg_drake.pictures.panels import INK, show_image

_FAINTEST = 0.02
"""Weaker edges are not drawn."""
_EDGE_ALPHA = 0.22
"""Of an edge between equals; there are thousands."""


def show_similarity_graph(
    axes: Axes, color: NDArray[np.uint8], pixel: NDArray, similarity: NDArray, group: NDArray
) -> None:
    """Body frames as nodes on the image, and an edge the darker, the more alike two twists are.

    Args:
        axes: to draw on.
        color: [H, W, 3], the image at t-1.
        pixel: [K, 2], the seeds (v, u).
        similarity: [K, K], 0 to 1.
        group: [K], 0, 1, ...; -1 for none.
    """
    show_image(axes, pale(color))
    a, b = np.nonzero(np.triu(similarity > _FAINTEST, 1))
    uv = pixel[:, ::-1]
    lines = LineCollection(list(np.stack([uv[a], uv[b]], axis=1)), colors=INK, linewidths=0.7)
    lines.set_alpha(list(_EDGE_ALPHA * similarity[a, b]))
    axes.add_collection(lines)
    axes.scatter(uv[:, 0], uv[:, 1], s=22, c=group_colors(group), edgecolors=INK, linewidths=0.4, zorder=3)


def plot_similarity(axes: Axes, similarity: NDArray, group: NDArray) -> None:
    """The matrix [K, K], its rows and columns sorted by group, whose colours [K] stand along its edges."""
    order = np.argsort(np.where(group < 0, len(group), group), kind="stable")
    K = len(order)
    axes.imshow(similarity[np.ix_(order, order)], cmap="gray_r", vmin=0, vmax=1, interpolation="nearest")
    strip, colors = 0.03 * K, [group_colors(group)[k] for k in order]
    for k, each in enumerate(colors):
        axes.barh(k, -strip, 1.0, left=-0.5, color=each)
        axes.bar(k, -strip, 1.0, bottom=-0.5, color=each)
    axes.set_xlim(-0.5 - strip, K - 0.5)
    axes.set_ylim(K - 0.5, -0.5 - strip)
    axes.set_aspect("equal")
    axes.set_axis_off()
