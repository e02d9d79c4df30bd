"""The door for images: what their headers promise is looked at before a decoder sees them.

PNG, and JPEG where that will do. A decoder makes room for what a header claims, and a few kilobytes can claim
gigabytes; it also fills up what is missing, so that all is there is looked at here.
"""

import struct
import zlib
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from riseg_drake.host.files import FileError, read_bytes

MOST_PIXELS = 2**24
"""Of one image: more than any depth camera has."""
MOST_BYTES = 2**27
"""Of one image file: as many pixels of 64 bits."""
MOST_SCANS = 100
"""Passes of a progressive JPEG: each costs as much time as the whole image; ten are usual."""

_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_HEADER_BYTES = 33
"""Signature, and the chunk IHDR with its length, type, 13 bytes and check sum."""
_CHANNELS = {0: 1, 2: 3, 3: 3, 4: 2, 6: 4}
"""By PNG colour type: gray, RGB, palette (decoded to RGB), gray with alpha, RGB with alpha."""
_NEEDED = (b"IHDR", b"PLTE", b"tRNS", b"IDAT", b"IEND")
"""Chunks that say something about pixels; decoders see no others."""
_FRAME_HEADERS = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
_WITHOUT_LENGTH = frozenset(range(0xD0, 0xD9)) | {0x01}


class DamagedImageError(ValueError):
    """Why an image cannot be read, in one line."""


@dataclass(frozen=True)
class ImageKind:
    """What an image is, as far as its header tells."""

    width: int
    height: int
    channels: int
    bits: int
    palette: bool = False
    """Whether its pixels are numbers of colours in a table."""

    def __str__(self) -> str:
        return f"{self.channels} channel{'s' if self.channels > 1 else ''} of {self.bits} bits"


def png_kind(path: Path, inside: Path | None = None) -> ImageKind | None:
    """What a PNG file says it is, by its first bytes; None where it has no header of a PNG.

    Raises FileError where it is no file, or leads out of the folder `inside`.
    """
    return image_kind(read_bytes(path, MOST_BYTES, inside, first=_HEADER_BYTES))


def image_kind(content: bytes) -> ImageKind | None:
    """What the header of a PNG or a JPEG says; None where there is none."""
    if content[:8] == _SIGNATURE:
        return _kind_of_png(content)
    if content[:3] == b"\xff\xd8\xff":
        return _kind_of_jpeg(content)
    return None


def read_image(path: Path, *, jpeg: bool = False, indices: bool = False, inside: Path | None = None) -> NDArray:
    """A whole PNG image (or JPEG, where that will do), [H, W] or [H, W, channels]; see `decode`.

    Raises DamagedImageError.
    """
    try:
        content = read_bytes(path, MOST_BYTES, inside)
    except FileError as error:
        raise DamagedImageError(str(error)) from None
    return decode(content, str(path), jpeg=jpeg, indices=indices)


def decode(content: bytes, name: str, *, jpeg: bool = False, indices: bool = False) -> NDArray:
    """The pixels of an image as OpenCV has them: [H, W] or [H, W, channels], BGR.

    With `indices`, an image with a palette gives the numbers [H, W] that its pixels hold, and not their
    colours: so are object ids written by many tools. `name` is what errors call it.

    Raises DamagedImageError: cut off, of another format, too large.
    """
    unreadable = f"{name} is not a readable PNG{' or JPEG' if jpeg else ''} image"
    kind = image_kind(content)
    if kind is None:
        raise DamagedImageError(unreadable)
    if not 0 < kind.width * kind.height <= MOST_PIXELS:
        raise DamagedImageError(
            f"{name} says that it has {kind.width}x{kind.height} pixels; at most {MOST_PIXELS} are read"
        )
    is_png = content[:8] == _SIGNATURE
    whole = _pixels_of_png(content) if is_png else _whole_jpeg(content) if jpeg else None
    if whole is None:
        raise DamagedImageError(unreadable)
    if indices and kind.palette:
        return _palette_indices(whole, unreadable)
    try:
        image = cv2.imdecode(np.frombuffer(whole, np.uint8), cv2.IMREAD_UNCHANGED)
    except cv2.error:
        image = None
    if image is None or image.shape[:2] != (kind.height, kind.width):
        raise DamagedImageError(unreadable)
    return image


def _palette_indices(content: bytes, unreadable: str) -> NDArray[np.uint8]:
    """OpenCV knows colours only."""
    try:
        with Image.open(BytesIO(content), formats=["PNG"]) as image:
            return np.array(image, np.uint8)
    except (OSError, SyntaxError, ValueError):
        raise DamagedImageError(unreadable) from None


def _kind_of_png(content: bytes) -> ImageKind | None:
    head = content[:_HEADER_BYTES]
    if len(head) < _HEADER_BYTES or head[12:16] != b"IHDR":
        return None
    if zlib.crc32(head[12:29]) != struct.unpack(">I", head[29:33])[0]:
        return None
    width, height, bits, color_type = struct.unpack(">IIBB", head[16:26])
    palette = color_type == 3
    return ImageKind(width, height, _CHANNELS.get(color_type, 0), 8 if palette else bits, palette)


def _kind_of_jpeg(content: bytes) -> ImageKind | None:
    """By the frame header, which follows any number of other segments."""
    start = 2
    while start + 4 <= len(content) and content[start] == 0xFF:
        marker = content[start + 1]
        if marker == 0xFF or marker in _WITHOUT_LENGTH:
            start += 1 if marker == 0xFF else 2
            continue
        (length,) = struct.unpack(">H", content[start + 2 : start + 4])
        if marker in _FRAME_HEADERS and start + 10 <= len(content):
            bits, height, width, channels = struct.unpack(">BHHB", content[start + 4 : start + 10])
            return ImageKind(width, height, channels, bits)
        start += 2 + length
    return None


def _whole_jpeg(content: bytes) -> bytes | None:
    """A JPEG that begins and ends as one, in a number of scans that can be; it has no check sums."""
    is_whole = content[:3] == b"\xff\xd8\xff" and content.rstrip(b"\0")[-2:] == b"\xff\xd9"
    return content if is_whole and content.count(b"\xff\xda") <= MOST_SCANS else None


def _pixels_of_png(content: bytes) -> bytes | None:
    """The chunks that a decoder needs, where all chunks are there as they were written; None otherwise."""
    view, start, chunks, has_pixels = memoryview(content), 8, [memoryview(_SIGNATURE)], False
    while start + 12 <= len(content):
        length, kind = struct.unpack(">I4s", view[start : start + 8])
        end = start + 8 + length
        if end + 4 > len(content):
            return None
        if zlib.crc32(view[start + 4 : end]) != struct.unpack(">I", view[end : end + 4])[0]:
            return None
        if kind in _NEEDED:
            chunks.append(view[start : end + 4])
        has_pixels |= kind == b"IDAT" and length > 0
        if kind == b"IEND":
            return b"".join(chunks) if has_pixels else None
        start = end + 4
    return None
