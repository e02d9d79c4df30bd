"""The camera's pictures on LCM: from lcmt_image_array to arrays, and back as the RealSense driver writes."""

import zlib
from collections.abc import Mapping
from dataclasses import dataclass

import cv2
import numpy as np
from drake import lcmt_image, lcmt_image_array
from numpy.typing import NDArray

from riseg_drake.geometry.rgbd import sanitize_depth
from riseg_drake.host.images import MOST_PIXELS, DamagedImageError, decode, image_kind
from riseg_drake.host.terminal import one_line

ALIGNED_DEPTH = "rect_color_aligned_depth"
"""What the RealSense driver calls depth that was carried over to the colour camera."""
REGISTRATION_FLAG = "--software_depth_registration"
"""Makes the RealSense driver publish it."""

_WIDEST_STRIDE = 2
"""Bytes from row to row, in rows: more is no padding."""
_TOO_FAR = 65535  # of a 16-bit depth image; 0 is too near, or no measurement

_TYPES = {
    lcmt_image.CHANNEL_TYPE_UINT8: np.uint8,
    lcmt_image.CHANNEL_TYPE_INT16: np.int16,
    lcmt_image.CHANNEL_TYPE_UINT16: np.uint16,
    lcmt_image.CHANNEL_TYPE_FLOAT32: np.float32,
}
_CHANNELS = {
    lcmt_image.PIXEL_FORMAT_RGB: 3,
    lcmt_image.PIXEL_FORMAT_BGR: 3,
    lcmt_image.PIXEL_FORMAT_RGBA: 4,
    lcmt_image.PIXEL_FORMAT_BGRA: 4,
}  # all others have one
_BLUE_FIRST = (lcmt_image.PIXEL_FORMAT_BGR, lcmt_image.PIXEL_FORMAT_BGRA)


class ImageError(ValueError):
    """A message that holds no usable picture; says in one line what is wrong, and what would be right."""


class DamagedPictureError(ImageError):
    """A message that was damaged on its way; the next one may be whole."""


@dataclass(frozen=True)
class LcmImages:
    """One picture as it came over LCM."""

    color: NDArray[np.uint8]
    """[H, W, 3], RGB."""
    depth: NDArray[np.float32]
    """[H, W], m, aligned to colour, 0 = invalid."""
    time: float
    """When colour was taken, s, by the clock of the sender; the RealSense driver says whole milliseconds."""
    sequence: int
    """Counts the messages of the sender; Drake's simulated cameras always say 0."""


def decode_message(data: bytes) -> lcmt_image_array:
    """The message of some bytes from LCM. Raises DamagedPictureError."""
    try:
        return lcmt_image_array.decode(data)
    except Exception as error:  # whatever the decoder makes of bytes that are no such message
        raise DamagedPictureError(f"a message holds no pictures ({one_line(error)})") from None


def decode_images(message: lcmt_image_array, size: tuple[int, int] | None = None) -> LcmImages:
    """Colour and aligned depth out of a message of the RealSense driver, or of a camera simulated by Drake.

    Images are told by their frame names: `color` (stamped in milliseconds) with `rect_color_aligned_depth`
    by the driver, `rgb` (microseconds) with `depth` by Drake's ApplyCameraConfig, whose depth is aligned.
    `size`, (width, height) in pixels, is what the camera is known to send; nothing else is decoded then.
    Raises ImageError, above all for depth that is not aligned to colour, and DamagedPictureError.
    """
    images = {image.header.frame_name: image for image in message.images}
    name = "color" if "color" in images else "rgb"
    if name not in images:
        raise ImageError(f"no colour image: frames are {_listed(images)}; expected 'color' or 'rgb'")
    color = decode_image(images[name], size)
    if color.ndim != 3 or color.dtype != np.uint8:
        raise ImageError(f"{name}: {_kind(color)}; expected 8-bit colour")
    depth = decode_image(images[_depth_name(images)], size)
    if depth.ndim != 2:
        raise ImageError(f"depth: {_kind(depth)}; expected one channel")
    if depth.shape != color.shape[:2]:
        raise ImageError(
            f"depth is {_size(depth)} and colour {_size(color)} pixels; aligned images are of one size"
        )
    ticks = 1e3 if name == "color" else 1e6
    return LcmImages(
        color=np.ascontiguousarray(color[..., :3]),
        depth=_metres(depth),
        time=images[name].header.utime / ticks,
        sequence=message.header.seq,
    )


def decode_image(image: lcmt_image, size: tuple[int, int] | None = None) -> NDArray:
    """The pixels of one image, [H, W] or [H, W, 3 or 4] (red first), as they were before compression.

    What the message says of its size is looked at first, and nothing larger is unpacked. Raises ImageError
    where it is not `size`, (width, height), and DamagedPictureError for what cannot be read.
    """
    name = image.header.frame_name
    if not (image.width > 0 and image.height > 0 and image.width * image.height <= MOST_PIXELS):
        raise DamagedPictureError(f"{name}: {image.width}x{image.height} pixels cannot be")
    if size is not None and (image.width, image.height) != size:
        raise ImageError(
            f"{name}: the camera sends {image.width}x{image.height} pixels, and the scenario's intrinsics are "
            f"for {size[0]}x{size[1]}"
        )
    match image.compression_method:
        case lcmt_image.COMPRESSION_METHOD_JPEG | lcmt_image.COMPRESSION_METHOD_PNG:
            return _unpacked(image)
        case lcmt_image.COMPRESSION_METHOD_ZLIB:
            return _from_rows(image, _decompressed(image))
        case lcmt_image.COMPRESSION_METHOD_NOT_COMPRESSED:
            return _from_rows(image, bytes(image.data))
        case other:
            raise ImageError(f"{name}: compression {other} is unknown; expected JPEG, PNG, zlib or none")


def encode_images(
    color: NDArray[np.uint8],
    aligned_depth: NDArray[np.float32] | None,
    time: float,
    sent: float,
    sequence: int,
    *,
    raw_depth: NDArray[np.float32] | None = None,
    infrared: Mapping[str, NDArray[np.uint8]] | None = None,
) -> lcmt_image_array:
    """A message as the RealSense driver writes it.

    In the driver's order: colour [H, W, 3] as JPEG; `raw_depth` [H, W], m, as seen by the left infrared
    camera, in millimetres and zlib; `infrared` (`infrared`, `infrared_stereo`) [H, W] as 16-bit PNG; last
    `aligned_depth` as PNG, None where registration is off. `time` is when the picture was taken, `sent`
    when it was packed, s; the one is cut to milliseconds, the other to microseconds.
    """
    stamp = int(np.floor(time * 1e3 + 1e-6))
    images = [encode_image("color", color, stamp, lcmt_image.COMPRESSION_METHOD_JPEG)]
    if raw_depth is not None:
        images.append(encode_image("depth", _millimetres(raw_depth), stamp, lcmt_image.COMPRESSION_METHOD_ZLIB))
    for name, image in (infrared or {}).items():
        # The driver stretches 8 bits to 16.
        wide = image.astype(np.uint16) * 256
        images.append(encode_image(name, wide, stamp, lcmt_image.COMPRESSION_METHOD_PNG))
    if aligned_depth is not None:
        millimetres = _millimetres(aligned_depth)
        images.append(encode_image(ALIGNED_DEPTH, millimetres, stamp, lcmt_image.COMPRESSION_METHOD_PNG))
    message = lcmt_image_array()
    message.header.seq = sequence
    message.header.utime = int(sent * 1e6)
    message.images = images
    message.num_images = len(images)
    return message


def encode_image(name: str, pixels: NDArray, utime: int, compression: int) -> lcmt_image:
    """One image: 8-bit colour [H, W, 3] (red first) or a 16-bit image [H, W], compressed as asked.

    A 16-bit image counts as depth where its name ends so, as labels where it is `label`, else as gray.
    """
    image = lcmt_image()
    image.header.frame_name = name
    image.header.utime = utime
    image.height, image.width = pixels.shape[:2]
    image.row_stride = pixels.strides[0] if pixels.flags.c_contiguous else pixels[0].nbytes
    image.compression_method = compression
    if pixels.ndim == 3:
        image.pixel_format = lcmt_image.PIXEL_FORMAT_RGB
        image.channel_type = lcmt_image.CHANNEL_TYPE_UINT8
    else:
        image.channel_type = lcmt_image.CHANNEL_TYPE_UINT16
        image.pixel_format = (
            lcmt_image.PIXEL_FORMAT_DEPTH
            if name.endswith("depth")
            else lcmt_image.PIXEL_FORMAT_LABEL
            if name == "label"
            else lcmt_image.PIXEL_FORMAT_GRAY
        )
    if compression == lcmt_image.COMPRESSION_METHOD_ZLIB:
        image.data = zlib.compress(np.ascontiguousarray(pixels).tobytes(), zlib.Z_BEST_SPEED)
    else:
        blue_first = cv2.cvtColor(pixels, cv2.COLOR_RGB2BGR) if pixels.ndim == 3 else pixels
        extension = ".jpg" if compression == lcmt_image.COMPRESSION_METHOD_JPEG else ".png"
        image.data = cv2.imencode(extension, blue_first)[1].tobytes()
    image.size = len(image.data)
    return image


def _depth_name(images: Mapping[str, lcmt_image]) -> str:
    """Which image is depth aligned to colour. Raises ImageError."""
    if ALIGNED_DEPTH in images:
        return ALIGNED_DEPTH
    if "rgb" in images and "color" not in images and "depth" in images:
        return "depth"
    if "depth" in images:
        raise ImageError(
            f"depth is not aligned to colour: start realsense_rgbd_publisher with {REGISTRATION_FLAG}"
        )
    raise ImageError(
        f"no depth image: frames are {_listed(images)}; expected {ALIGNED_DEPTH!r}: start "
        f"realsense_rgbd_publisher with {REGISTRATION_FLAG}"
    )


def _unpacked(image: lcmt_image) -> NDArray:
    """A JPEG or PNG image; both say themselves what they hold, which must be what the message says."""
    name = image.header.frame_name
    kind = image_kind(bytes(image.data))
    if kind is None:
        raise DamagedPictureError(f"{name}: damaged JPEG or PNG data")
    if (kind.width, kind.height) != (image.width, image.height):
        raise DamagedPictureError(
            f"{name}: the data are of {kind.width}x{kind.height} pixels, the message says "
            f"{image.width}x{image.height}"
        )
    try:
        pixels = decode(bytes(image.data), name, jpeg=True)
    except DamagedImageError:
        raise DamagedPictureError(f"{name}: damaged JPEG or PNG data") from None
    if pixels.ndim == 3 and pixels.shape[2] not in (3, 4):
        raise ImageError(f"{name}: {_kind(pixels)}; expected one, three or four channels")
    if pixels.ndim == 3:
        red_first = cv2.COLOR_BGR2RGB if pixels.shape[2] == 3 else cv2.COLOR_BGRA2RGBA
        pixels = cv2.cvtColor(pixels, red_first)
    return pixels


def _decompressed(image: lcmt_image) -> bytes:
    """What was packed by zlib, as far as the image has room for it."""
    most = _bytes_of(image)
    unpacking = zlib.decompressobj()
    try:
        data = unpacking.decompress(image.data, most)
    except zlib.error as error:
        raise DamagedPictureError(f"{image.header.frame_name}: damaged zlib data ({error})") from None
    if len(data) < most and not unpacking.eof:
        raise DamagedPictureError(f"{image.header.frame_name}: damaged zlib data (cut off)")
    return data


def _from_rows(image: lcmt_image, data: bytes) -> NDArray:
    """The image whose rows lie in `data` one after another, every `row_stride` bytes."""
    kind, channels, stride, row = _layout_of(image)
    if len(data) < stride * (image.height - 1) + row:
        raise DamagedPictureError(
            f"{image.header.frame_name}: {len(data)} bytes do not fill {image.width}x{image.height} pixels of "
            f"{channels * kind.itemsize} bytes"
        )
    rows = np.lib.stride_tricks.as_strided(
        np.frombuffer(data, np.uint8), (image.height, row), (stride, 1), writeable=False
    )
    pixels = np.ascontiguousarray(rows).view(kind).astype(kind.newbyteorder("="), copy=False)
    if channels == 1:
        return pixels
    pixels = pixels.reshape(image.height, image.width, channels)
    return pixels[..., [2, 1, 0, 3][:channels]] if image.pixel_format in _BLUE_FIRST else pixels


def _layout_of(image: lcmt_image) -> tuple[np.dtype, int, int, int]:
    """How uncompressed rows lie: the kind of a number, channels, bytes from row to row, bytes of a row."""
    name = image.header.frame_name
    if image.channel_type not in _TYPES:
        raise ImageError(f"{name}: channel type {image.channel_type} is not supported")
    kind = np.dtype(_TYPES[image.channel_type])
    if image.bigendian:
        kind = kind.newbyteorder(">")
    channels = _CHANNELS.get(image.pixel_format, 1)
    row = image.width * channels * kind.itemsize
    stride = image.row_stride or row
    if not row <= stride <= _WIDEST_STRIDE * row:
        raise DamagedPictureError(f"{name}: rows of {row} bytes do not lie {stride} bytes apart")
    return kind, channels, stride, row


def _bytes_of(image: lcmt_image) -> int:
    """How many bytes an image takes without compression."""
    _, _, stride, row = _layout_of(image)
    return stride * (image.height - 1) + row


def _metres(depth: NDArray) -> NDArray[np.float32]:
    """Depth as the program has it: from 16-bit millimetres, or from metres; 0 = invalid."""
    if depth.dtype == np.uint16:
        return np.where(depth == _TOO_FAR, 0, depth).astype(np.float32) * np.float32(1e-3)
    if depth.dtype == np.float32:
        return sanitize_depth(depth)
    raise ImageError(f"depth: {_kind(depth)}; expected 16-bit millimetres or 32-bit metres")


def _millimetres(depth: NDArray[np.float32]) -> NDArray[np.uint16]:
    """Depth as the driver has it, rounded; beyond 65 m it is invalid, too."""
    millimetres = np.round(depth * 1e3)
    return np.where(millimetres < _TOO_FAR, millimetres, 0).astype(np.uint16)


def _listed(images: Mapping[str, lcmt_image]) -> str:
    return ", ".join(repr(name) for name in images) or "none"


def _size(pixels: NDArray) -> str:
    return f"{pixels.shape[1]}x{pixels.shape[0]}"


def _kind(pixels: NDArray) -> str:
    return f"{_size(pixels)} pixels of {pixels[0, 0].size} x {pixels.dtype}"
