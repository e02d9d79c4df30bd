"""The pixels along the borders of superpixels, and what an image shows on both sides of them."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from riseg_drake.segmentation.superpixels import Superpixels, touching


@dataclass(frozen=True)
class BorderPixels:
    """K places between a pixel and the next one along one axis of the image, where a border runs through."""

    border: NDArray[np.intp]
    """[K], which of the superpixels' borders."""
    pixel: NDArray[np.intp]
    """[2, K], (v, u) of the pixel before it."""
    axis: int
    """0: the next one is below; 1: to the right."""

    def beside(self, image: NDArray, offset: int) -> NDArray:
        """[K, ...], what an image [H, W, ...] shows across the border; 0 is the last pixel before it, 1 the
        first behind it."""
        place = self.pixel.copy()
        place[self.axis] = np.clip(place[self.axis] + offset, 0, image.shape[self.axis] - 1)
        return image[*place]


def border_pixels(cut: Superpixels) -> Iterator[BorderPixels]:
    """Those along v, then those along u."""
    code = cut.borders[:, 0] * cut.count + cut.borders[:, 1]  # rising, as the superpixels list them
    for axis, (pixel, low, high) in enumerate(touching(cut.label)):
        yield BorderPixels(np.searchsorted(code, low * cut.count + high), pixel, axis)
