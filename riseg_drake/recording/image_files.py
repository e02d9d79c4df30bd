"""Images of a recording: what their first bytes promise, and whether all of them is there.

PNG; colour may be JPEG, too, as some data sets have it.
"""

import struct
import zlib
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_HEADER_BYTES = 33
"""Signature, and the chunk IHDR with its length, type, 13 bytes and check sum."""
_CHANNELS = {0: 1, 2: 3, 3: 3, 4: 2, 6: 4}
"""By PNG colour type: gray, RGB, palette (decoded to RGB), gray with alpha, RGB with alpha."""


class DamagedImageError(ValueError):
    """Why an image file cannot be read, in one line."""


@dataclass(frozen=True)
class ImageKind:
    """What an image is, as far as its header tells."""

    width: int
    height: int
    channels: int
    bits: int

    def __str__(self) -> str:
        return f"{self.channels} channel{'s' if self.channels > 1 else ''} of {self.bits} bits"


def image_kind(path: Path) -> ImageKind | None:
    """What a PNG file says it is; None where it has no header of a PNG. Raises OSError if it is not there."""
    with path.open("rb") as file:
        head = file.read(_HEADER_BYTES)
    if len(head) < _HEADER_BYTES or head[:8] != _SIGNATURE or head[12:16] != b"IHDR":
        return None
    if zlib.crc32(head[12:29]) != struct.unpack(">I", head[29:33])[0]:
        return None
    width, height, bits, color_type = struct.unpack(">IIBB", head[16:26])
    if color_type == 3:
        bits = 8
    return ImageKind(width, height, _CHANNELS.get(color_type, 0), bits)


def read_image(path: Path, *, jpeg: bool = False) -> NDArray:
    """A whole PNG image (or JPEG, where that will do) as OpenCV decodes it: [H, W] or [H, W, channels], BGR.

    Raises DamagedImageError. That all is there is looked at first: decoders fill up what is missing.
    """
    unreadable = f"{path} is not a readable PNG{' or JPEG' if jpeg else ''} image"
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        raise DamagedImageError(f"{path} is missing") from None
    except OSError:
        raise DamagedImageError(unreadable) from None
    try:
        whole = _is_whole(content) or (jpeg and _is_whole_jpeg(content))
        image = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_UNCHANGED) if whole else None
    except cv2.error:
        image = None
    if image is None:
        raise DamagedImageError(unreadable)
    return image


def _is_whole_jpeg(content: bytes) -> bool:
    """Whether a JPEG file begins and ends as one; it has no check sums."""
    return content[:3] == b"\xff\xd8\xff" and content.rstrip(b"\0")[-2:] == b"\xff\xd9"


def _is_whole(content: bytes) -> bool:
    """Whether every chunk of a PNG file is there as it was written, up to the last."""
    if content[:8] != _SIGNATURE:
        return False
    view, start, packed = memoryview(content), 8, []
    while start + 12 <= len(content):
        length, kind = struct.unpack(">I4s", view[start : start + 8])
        end = start + 8 + length
        if end + 4 > len(content):
            return False
        if zlib.crc32(view[start + 4 : end]) != struct.unpack(">I", view[end : end + 4])[0]:
            return False
        if kind == b"IDAT":
            packed.append(end - start)
        if kind == b"IEND":
            return bool(packed)
        start = end + 4
    return False
