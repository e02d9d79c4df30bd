"""Moving pictures as GIF, which every code host shows, with colours that stand still."""

from collections.abc import Sequence
from io import BytesIO

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from riseg_drake.pictures.object_colors import object_colors

_STEADY = 6
"""Gray levels; a pixel that changes by less, in every channel, is left as it was: that is sensor noise."""
_OBJECTS = 12
"""So many objects have their colours exactly."""
_SAMPLES = 24
"""Pictures that the palette is taken from."""
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


def gif(pictures: Sequence[NDArray[np.uint8]], rate: float, last: float = 0.0) -> bytes:
    """The pictures [H, W, 3], of one size, as a GIF that repeats.

    All share one palette, so that no colour flickers.

    Args:
        pictures: in order.
        rate: pictures a second.
        last: how long the last one stays, s.
    """
    palette = _palette(pictures)
    shown = pictures[0].copy()
    images = []
    for picture in pictures:
        moved = np.abs(picture.astype(np.int16) - shown).max(axis=-1) >= _STEADY
        shown[moved] = picture[moved]
        images.append(Image.fromarray(shown).quantize(palette=palette, dither=Image.Dither.NONE))
    durations = [1000 / rate] * len(images)
    durations[-1] += 1000 * last
    file = BytesIO()
    images[0].save(
        file, "GIF", save_all=True, append_images=images[1:], duration=durations, loop=0, optimize=False
    )
    return file.getvalue()


def _palette(pictures: Sequence[NDArray[np.uint8]]) -> Image.Image:
    """256 colours for all pictures: the first objects' own, and of the rest those that are there.

    A colour counts by the root of its area, so that not all are shades of the table.
    """
    sample = np.stack(pictures[:: -(-len(pictures) // _SAMPLES)]) >> 3
    code = sample[..., 0].astype(np.int32) << 10 | sample[..., 1].astype(np.int32) << 5 | sample[..., 2]
    codes, count = np.unique(code, return_counts=True)
    colors = np.stack([codes >> 10, codes >> 5 & 31, codes & 31], axis=-1) * 8 + 4
    weighted = np.repeat(colors, np.ceil(np.sqrt(count)).astype(int), axis=0).astype(np.uint8)
    others = 256 - _OBJECTS
    found = Image.fromarray(weighted[None]).quantize(others, Image.Quantize.MEDIANCUT).getpalette() or []
    palette = Image.new("P", (1, 1))
    palette.putpalette(object_colors(np.arange(1, _OBJECTS + 1)).ravel().tolist() + found[: 3 * others])
    return palette
