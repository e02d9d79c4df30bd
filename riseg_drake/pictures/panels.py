"""Figures of a few panels side by side, all in one look."""

from collections.abc import Sequence
from io import BytesIO

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

INK = "#333333"
WIDTH = 7.8
"""Of a figure, inches."""
_QUALITY = 76


class Picture(Figure):
    """A figure that shows itself in a notebook, as a JPEG: photographs as PNG are ten times as large."""

    def _repr_jpeg_(self) -> bytes:
        file = BytesIO()
        self.savefig(
            file, format="jpeg", pil_kwargs={"quality": _QUALITY, "optimize": True, "progressive": True}
        )
        return file.getvalue()


def panels(titles: Sequence[str], aspect: float = 0.75, columns: int = 0) -> tuple[Picture, list[Axes]]:
    """An empty figure with a panel for each title.

    Args:
        titles: of the panels.
        aspect: ratio of a panel's height to its width; 0.75 is that of a 640x480 image.
        columns: panels in a row; 0: all in one.
    """
    columns = columns or len(titles)
    rows = -(-len(titles) // columns)
    height = rows * (WIDTH / columns * aspect + 0.3)
    figure = Picture(figsize=(WIDTH, height), dpi=100, layout="constrained")
    grid = np.ravel(figure.subplots(rows, columns))
    for axes in grid[len(titles) :]:
        axes.remove()
    shown = list(grid[: len(titles)])
    for axes, title in zip(shown, titles, strict=False):
        axes.set_title(title, fontsize=9.5, color=INK)
        axes.tick_params(labelsize=8, colors=INK)
        axes.spines[["top", "right"]].set_visible(False)
    return figure, shown


def show_image(axes: Axes, image: NDArray) -> None:
    """An image [H, W, 3], without ticks or frame."""
    axes.imshow(image, interpolation="antialiased")
    axes.set_xlim(-0.5, image.shape[1] - 0.5)
    axes.set_ylim(image.shape[0] - 0.5, -0.5)
    axes.set_axis_off()


def image_panels(titles: Sequence[str], images: Sequence[NDArray], columns: int = 0) -> Picture:
    """Images [H, W, 3] of one size side by side, or in rows of `columns`."""
    height, width = images[0].shape[:2]
    figure, axes = panels(titles, height / width, columns)
    for each, image in zip(axes, images, strict=True):
        show_image(each, image)
    return figure
