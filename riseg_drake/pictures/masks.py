"""A mask over its image: every object tinted, outlined and numbered."""

from collections.abc import Mapping

import cv2
import numpy as np
from numpy.typing import NDArray

from riseg_drake.pictures.object_colors import object_colors

_FILL = 0.5
"""How much of the object's colour lies over the image inside its outline."""
_LINE = 2
"""Pixels of the outline in the object's colour, inside a dark rim of one; twice that from a width of
`_WIDE` pixels on."""
_WIDE = 1200
_RIM = 0.25
"""Brightness of the rim: light objects stand out from a light table, and neighbours from each other."""


def draw_masks(
    color: NDArray[np.uint8],
    mask: NDArray,
    numbers: bool = True,
    confidence: Mapping[int, float] | None = None,
) -> NDArray[np.uint8]:
    """The image [H, W, 3] with the objects of a mask [H, W] on it; the background stays as it is.

    Under its tint an object is gray: an id's colour is the same whatever the colour of the object. Where the
    `confidence` of an id is given, it stands beside its number, small, in percent.
    """
    objects = mask > 0
    ids = object_colors(mask)
    gray = cv2.cvtColor(cv2.cvtColor(color, cv2.COLOR_RGB2GRAY), cv2.COLOR_GRAY2RGB)
    tinted = cv2.addWeighted(gray, 1 - _FILL, ids, _FILL, 0)
    picture = np.where(objects[..., None], tinted, color)

    thick = 2 if color.shape[1] >= _WIDE else 1
    line, rim = (_within(mask, thick * width) & objects for width in (_LINE + 1, 1))
    picture[line] = ids[line]
    picture[rim] = (_RIM * ids[rim]).astype(np.uint8)
    if numbers:
        for object_id in np.unique(mask[objects]):
            sure = (confidence or {}).get(int(object_id))
            percent = "" if sure is None else f"{100 * sure:.0f}%"
            _write_number(picture, int(object_id), percent, mask == object_id, thick)
    return picture


def _within(mask: NDArray, width: int) -> NDArray[np.bool_]:
    """The pixels [H, W] that have another id no more than `width` pixels away."""
    window = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * width + 1,) * 2)
    return cv2.morphologyEx(mask.astype(np.uint16), cv2.MORPH_GRADIENT, window) > 0


def _write_number(
    picture: NDArray[np.uint8], object_id: int, percent: str, pixels: NDArray[np.bool_], thick: int
) -> None:
    """Write the id where the object is widest, light on dark, and smaller how sure it is."""
    inside = cv2.distanceTransform(
        cv2.copyMakeBorder(pixels.astype(np.uint8), 1, 1, 1, 1, cv2.BORDER_CONSTANT), cv2.DIST_L2, 3
    )
    _, _, _, (u, v) = cv2.minMaxLoc(inside)
    text, font, scale = str(object_id), cv2.FONT_HERSHEY_SIMPLEX, 0.55 * thick
    (width, height), _ = cv2.getTextSize(text, font, scale, thick)
    corner = (u - 1 - width // 2, v - 1 + height // 2)
    beside = (corner[0] + width + thick, corner[1])
    for words, place, size in ((text, corner, scale), (percent, beside, 0.6 * scale)):
        cv2.putText(picture, words, place, font, size, (0, 0, 0), 3 * thick, cv2.LINE_AA)
        cv2.putText(picture, words, place, font, size, (255, 255, 255), thick, cv2.LINE_AA)
