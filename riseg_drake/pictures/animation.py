"""Moving pictures as WebP, which code hosts and browsers show: a fifth of what a GIF takes, in all colours."""

from collections.abc import Sequence
from io import BytesIO

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

_QUALITY = 55
"""Of its pictures, as WebP counts it: letters stay sharp, and a run is some 250 kB."""
_CAPTION = 26
"""Height of the line below the pictures, pixels."""
_GAP = 4
_PAPER, _INK = (255, 255, 255), (50, 50, 50)


def side_by_side(
    left: NDArray[np.uint8], right: NDArray[np.uint8], captions: tuple[str, str], width: int
) -> NDArray[np.uint8]:
    """Two images of one shape [H, W, 3] beside each other, shrunk to `width` pixels in all, captions below."""
    each = (width - _GAP) // 2
    size = (each, round(each * left.shape[0] / left.shape[1]))
    shrunk = [cv2.resize(image, size, interpolation=cv2.INTER_AREA) for image in (left, right)]
    page = Image.new("RGB", (width, size[1] + _CAPTION), _PAPER)
    pen = ImageDraw.Draw(page)
    for x, image, caption in zip((0, width - each), shrunk, captions, strict=True):
        page.paste(Image.fromarray(image), (x, 0))
        pen.text((x + 6, size[1] + 4), caption, _INK, ImageFont.load_default(15))
    return np.asarray(page)


def film(pictures: Sequence[NDArray[np.uint8]], rate: float, last: float = 0.0) -> bytes:
    """The pictures [H, W, 3], of one size, as a WebP that repeats.

    Args:
        pictures: in order.
        rate: pictures a second.
        last: how long the last one stays, s.
    """
    images = [Image.fromarray(picture) for picture in pictures]
    durations = [round(1000 / rate)] * len(images)
    durations[-1] += round(1000 * last)
    file = BytesIO()
    images[0].save(
        file, "WEBP", save_all=True, append_images=images[1:], duration=durations, loop=0, quality=_QUALITY
    )
    return file.getvalue()
