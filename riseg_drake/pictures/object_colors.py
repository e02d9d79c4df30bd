"""A colour for every object id: the same in every picture, and told apart by people of any colour vision."""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from riseg_drake.pictures.color_vision import (
    DEUTERANOPIA,
    NORMAL,
    PROTANOPIA,
    as_seen,
    oklab_from_srgb,
)

# Okabe and Ito (2008), "Color universal design", without black.
_FIRST = (
    (230, 159, 0),  # orange
    (86, 180, 233),  # sky blue
    (0, 158, 115),  # bluish green
    (240, 228, 66),  # yellow
    (0, 114, 178),  # blue
    (213, 94, 0),  # vermilion
    (204, 121, 167),  # reddish purple
)
_COUNT = 32
"""After so many objects the colours start again."""
_GRID = 16
"""Gray levels between the colours that may follow the first."""
_LIGHTNESS = (0.35, 0.85)
_CHROMA_MIN = 0.07
"""Tables are white, shadows black and robots gray: objects are none of these. In Oklab."""


def object_colors(object_ids: NDArray) -> NDArray[np.uint8]:
    """RGB [..., 3] of object ids [...] from 0 up; 0, the background, is black."""
    table = _table()
    index = np.asarray(object_ids).astype(np.int64)
    return np.where(index[..., None] > 0, table[(index - 1) % len(table)], np.uint8(0))


def hex_color(object_id: int) -> str:
    """The same of one id, as `#rrggbb`."""
    return "#" + bytes(object_colors(np.array(object_id))).hex()


@cache
def _table() -> NDArray[np.uint8]:
    """The colours [_COUNT, 3] in the order of the ids.

    After the first seven each is the one that lies farthest from all before it, in the eyes of whoever
    tells them apart worst.
    """
    steps = np.arange(0, 256, _GRID)
    candidates = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)
    lab = oklab_from_srgb(candidates / 255)
    low, high = _LIGHTNESS
    allowed = (lab[:, 0] > low) & (lab[:, 0] < high) & (np.hypot(lab[:, 1], lab[:, 2]) > _CHROMA_MIN)
    candidates = candidates[allowed]
    looks = _looks(candidates)

    colors = list(np.array(_FIRST))
    nearest = np.full(len(candidates), np.inf)
    for color in colors:
        nearest = np.minimum(nearest, _apart(looks, _looks(color[None])))
    while len(colors) < _COUNT:
        best = int(nearest.argmax())
        colors.append(candidates[best])
        nearest = np.minimum(nearest, _apart(looks, looks[:, best : best + 1]))
    return np.array(colors, np.uint8)


def _looks(colors: NDArray) -> NDArray[np.float64]:
    """How colours [N, 3] look to three kinds of eyes, [3, N, 3]."""
    return np.stack(
        [oklab_from_srgb(as_seen(colors / 255, vision)) for vision in (NORMAL, PROTANOPIA, DEUTERANOPIA)]
    )


def _apart(looks: NDArray, other: NDArray) -> NDArray[np.float64]:
    """How far colours [3, N, 3] lie from another [3, 1, 3] to those who tell them apart worst, [N]."""
    return np.linalg.norm(looks - other, axis=-1).min(axis=0)
