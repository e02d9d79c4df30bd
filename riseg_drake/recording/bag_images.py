"""The images of ROS messages as arrays."""

import struct
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.rgbd import sanitize_depth
from riseg_drake.host.images import MOST_PIXELS, DamagedImageError, decode, image_kind
from riseg_drake.recording.bag_messages import MILLIMETRE

COLOR_ENCODINGS = {
    "rgb8": (3, None),
    "bgr8": (3, cv2.COLOR_BGR2RGB),
    "rgba8": (4, cv2.COLOR_RGBA2RGB),
    "bgra8": (4, cv2.COLOR_BGRA2RGB),
    "8UC3": (3, cv2.COLOR_BGR2RGB),
    "bayer_rggb8": (1, cv2.COLOR_BayerBG2RGB),
    "bayer_bggr8": (1, cv2.COLOR_BayerRG2RGB),
    "bayer_gbrg8": (1, cv2.COLOR_BayerGR2RGB),
    "bayer_grbg8": (1, cv2.COLOR_BayerGB2RGB),
    "yuv422": (2, cv2.COLOR_YUV2RGB_UYVY),
    "uyvy": (2, cv2.COLOR_YUV2RGB_UYVY),
    "yuv422_yuy2": (2, cv2.COLOR_YUV2RGB_YUYV),
    "yuyv": (2, cv2.COLOR_YUV2RGB_YUYV),
    "YUYV": (2, cv2.COLOR_YUV2RGB_YUYV),
    "UYVY": (2, cv2.COLOR_YUV2RGB_UYVY),
}
"""Bytes of a pixel, and how OpenCV makes RGB of it; the last two as RealSense files call them."""
DEPTH_ENCODINGS = {"16UC1": np.uint16, "mono16": np.uint16, "32FC1": np.float32}
"""Whole millimetres, or metres (REP 118)."""
_INVALID = 65535
_DEPTH_HEADER = struct.Struct("<iff")
"""What compressedDepth puts before a PNG: its format, and two numbers of the scale of 32FC1."""


def is_compressed(message: Any) -> bool:
    """Whether it is a sensor_msgs/CompressedImage."""
    return hasattr(message, "format")


def encoding_of(message: Any) -> str:
    """What an image says it is, such as "rgb8" or "16UC1"; of a compressed one, the whole word."""
    return str(message.format if is_compressed(message) else message.encoding)


def shape_of(message: Any) -> tuple[int, int]:
    """(height, width) of an image, (0, 0) of one that cannot be read."""
    if not is_compressed(message):
        return int(message.height), int(message.width)
    kind = image_kind(_picture(message.data.tobytes()))
    return (kind.height, kind.width) if kind else (0, 0)


def is_depth(message: Any, topic: str) -> bool:
    """Whether an image holds distances. One of 16 gray levels bits does if its topic says so."""
    encoding = encoding_of(message)
    if is_compressed(message):
        sure = encoding.startswith(("16UC1", "32FC1")) or "compressedDepth" in encoding
    else:
        sure = encoding in ("16UC1", "32FC1")
    return sure or (encoding.startswith("mono16") and "depth" in topic.lower())


def is_color(message: Any) -> bool:
    """Whether an image has colours."""
    encoding = encoding_of(message)
    if not is_compressed(message):
        return encoding in COLOR_ENCODINGS
    kind = image_kind(message.data.tobytes())
    return kind is not None and kind.channels in (3, 4) and kind.bits == 8


def color_image(message: Any, name: str) -> NDArray[np.uint8]:
    """RGB [H, W, 3] of a message. Raises DamagedImageError with the name that is given."""
    if is_compressed(message):
        image = decode(message.data.tobytes(), name, jpeg=True)
        if image.dtype != np.uint8 or image.ndim != 3:
            raise DamagedImageError(f"{name} is no colour image of 8 bits")
        return cv2.cvtColor(image[..., :3], cv2.COLOR_BGR2RGB).astype(np.uint8, copy=False)
    if message.encoding not in COLOR_ENCODINGS:
        raise DamagedImageError(f"{name} has the encoding {message.encoding!r}, which is no colour")
    channels, conversion = COLOR_ENCODINGS[message.encoding]
    image = _pixels(message, np.dtype(np.uint8), channels, name)
    if conversion is None:
        return image
    return cv2.cvtColor(image if channels > 1 else image[..., 0], conversion).astype(np.uint8, copy=False)


def depth_image(message: Any, name: str, unit: np.float32 = MILLIMETRE) -> NDArray[np.float32]:
    """Depth [H, W], m, 0 = invalid, of a message; `unit` is what 1 stands for in whole numbers, m.

    Raises DamagedImageError with the name that is given.
    """
    if is_compressed(message):
        return _compressed_depth(message.data.tobytes(), encoding_of(message), name, unit)
    if message.encoding not in DEPTH_ENCODINGS:
        raise DamagedImageError(f"{name} has the encoding {message.encoding!r}, which is no depth")
    kind = np.dtype(DEPTH_ENCODINGS[message.encoding])
    image = _pixels(message, kind.newbyteorder(">" if message.is_bigendian else "<"), 1, name)[..., 0]
    return _metres(image.astype(kind), unit)


def _compressed_depth(content: bytes, encoding: str, name: str, unit: np.float32) -> NDArray[np.float32]:
    if "rvl" in encoding.lower():
        raise DamagedImageError(f"{name} is compressed as RVL; compressedDepth is read as PNG")
    image = decode(_picture(content), name)
    if image.dtype != np.uint16 or image.ndim != 2:
        raise DamagedImageError(f"{name} is no depth image of 16 bits")
    if not encoding.startswith("32FC1"):
        return _metres(image, unit)
    if image_kind(content) is not None:
        raise DamagedImageError(f"{name} lacks the header of compressedDepth, which has its scale")
    _, a, b = _DEPTH_HEADER.unpack_from(content)
    # The transport keeps a / z + b, rounded.
    with np.errstate(divide="ignore"):
        return sanitize_depth(
            np.where(image > 0, np.float32(a) / (image.astype(np.float32) - np.float32(b)), 0)
        )


def _picture(content: bytes) -> bytes:
    """The image file in a compressed message; compressedDepth has a header before it."""
    return content if image_kind(content) is not None else content[_DEPTH_HEADER.size :]


def _metres(image: NDArray, unit: np.float32) -> NDArray[np.float32]:
    if image.dtype == np.float32:
        return sanitize_depth(image)
    # A product, as depth sensors and Drake make it: a quotient can differ in the last bit.
    return sanitize_depth(np.where(image == _INVALID, 0, image).astype(np.float32) * unit)


def _pixels(message: Any, kind: np.dtype, channels: int, name: str) -> NDArray:
    """[H, W, channels] of an image whose rows may be padded."""
    height, width, step = int(message.height), int(message.width), int(message.step)
    row = width * channels * kind.itemsize
    if not 0 < height * width <= MOST_PIXELS or step < row or len(message.data) < height * step:
        raise DamagedImageError(
            f"{name} says {width}x{height} pixels in rows of {step} bytes, and holds {len(message.data)} bytes"
        )
    rows = np.frombuffer(message.data, np.uint8, height * step).reshape(height, step)[:, :row]
    return np.ascontiguousarray(rows).view(kind).reshape(height, width, channels)
