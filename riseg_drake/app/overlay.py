"""Object ids made visible: an id has the same colour in every picture, whoever looks at it."""

import cv2
import numpy as np
from numpy.typing import NDArray

# Okabe and Ito's palette (2008), which people with any colour vision can tell apart, without its black.
_PALETTE = np.array(
    [
        [230, 159, 0],  # orange
        [86, 180, 233],  # sky blue
        [0, 158, 115],  # bluish green
        [240, 228, 66],  # yellow
        [0, 114, 178],  # blue
        [213, 94, 0],  # vermilion
        [204, 121, 167],  # reddish purple
    ],
    np.uint8,
)
_SHADES = (1.0, 0.7, 0.45)  # after seven objects the palette starts again, darker

_FILL = 0.45
"""How much of the object's colour lies over the image inside its outline."""


def object_colors(object_ids: NDArray) -> NDArray[np.uint8]:
    """RGB [..., 3] of object ids [...] from 0 up; 0, the background, is black."""
    table = np.concatenate([_PALETTE * shade for shade in _SHADES]).astype(np.uint8)
    index = object_ids.astype(np.int64)
    colors = table[(index - 1) % len(table)]
    return np.where(index[..., None] > 0, colors, np.uint8(0))


def draw_overlay(color: NDArray[np.uint8], mask: NDArray) -> NDArray[np.uint8]:
    """The image [H, W, 3] with every object of a mask [H, W] tinted, outlined and numbered."""
    objects = mask > 0
    ids = object_colors(mask)
    tinted = cv2.addWeighted(color, 1 - _FILL, ids, _FILL, 0)
    picture = np.where(objects[..., None], tinted, color)

    labels = mask.astype(np.uint16)
    outline = cv2.morphologyEx(labels, cv2.MORPH_GRADIENT, np.ones((5, 5), np.uint8)) > 0
    picture[outline & objects] = ids[outline & objects]
    for object_id in np.unique(mask[objects]):
        _write_number(picture, int(object_id), mask == object_id)
    return picture


def _write_number(picture: NDArray[np.uint8], object_id: int, pixels: NDArray[np.bool_]) -> None:
    """Write the id where the object is widest, light on dark."""
    inside = cv2.distanceTransform(
        cv2.copyMakeBorder(pixels.astype(np.uint8), 1, 1, 1, 1, cv2.BORDER_CONSTANT), cv2.DIST_L2, 3
    )
    _, _, _, (u, v) = cv2.minMaxLoc(inside)
    text, font, scale = str(object_id), cv2.FONT_HERSHEY_SIMPLEX, 0.5
    (width, height), _ = cv2.getTextSize(text, font, scale, 1)
    corner = (u - 1 - width // 2, v - 1 + height // 2)
    cv2.putText(picture, text, corner, font, scale, (0, 0, 0), 3, cv2.LINE_AA)
    cv2.putText(picture, text, corner, font, scale, (255, 255, 255), 1, cv2.LINE_AA)
