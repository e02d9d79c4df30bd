"""Boundary maps and how much of one lies along another, as the field's protocol draws them."""

from functools import lru_cache
from math import ceil, hypot

import cv2
import numpy as np
from numpy.typing import NDArray

TOLERANCE_OF_DIAGONAL = 0.003
"""How far two boundaries may lie apart and still agree, as a share of the image's diagonal."""


def tolerance(shape: tuple[int, ...]) -> int:
    """The distance in pixels within which boundaries agree, for an image [H, W]: 3 at 640x480."""
    height, width = shape
    return ceil(TOLERANCE_OF_DIAGONAL * hypot(height, width))


def boundary_map(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The boundary of a mask [H, W]: pixels unlike their right, lower or lower right neighbour.

    At the lower and the right edge of the image only the neighbours along that edge count, so a mask
    that fills the image has no boundary.
    """
    east = np.zeros_like(mask)
    south = np.zeros_like(mask)
    southeast = np.zeros_like(mask)
    east[:, :-1] = mask[:, 1:]
    south[:-1] = mask[1:]
    southeast[:-1, :-1] = mask[1:, 1:]

    boundary = (mask ^ east) | (mask ^ south) | (mask ^ southeast)
    boundary[-1] = mask[-1] ^ east[-1]
    boundary[:, -1] = mask[:, -1] ^ south[:, -1]
    boundary[-1, -1] = False
    return boundary


def dilate(boundary: NDArray[np.bool_], radius: int) -> NDArray[np.bool_]:
    """All pixels [H, W] within `radius` pixels of a boundary."""
    return cv2.dilate(boundary.astype(np.uint8), _disk(radius)).astype(bool)


@lru_cache(maxsize=8)
def _disk(radius: int) -> NDArray[np.uint8]:
    """The pixels within `radius` of the middle one, [2 radius + 1, 2 radius + 1]."""
    offset = np.arange(-radius, radius + 1)
    return (offset[:, None] ** 2 + offset**2 <= radius**2).astype(np.uint8)
