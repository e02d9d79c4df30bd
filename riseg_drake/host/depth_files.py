"""The door for depth images that are no PNG: arrays of numpy, and TIFF."""

import io
import warnings

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from riseg_drake.host.images import MOST_PIXELS, DamagedImageError, decode

DEPTH_TYPES = (np.dtype(np.uint16), np.dtype(np.float32), np.dtype(np.float64))
_TIFF = (b"II*\0", b"MM\0*")
_NPY = b"\x93NUMPY"


def decode_depth(content: bytes, name: str) -> NDArray:
    """Depth [H, W] of 16 bits or floats, as a PNG, TIFF or .npy file holds it.

    `name` is what errors call it. Raises DamagedImageError: cut off, of another format, too large.
    """
    if content[:6] == _NPY:
        image = _array(content, name)
    elif content[:4] in _TIFF:
        image = _tiff(content, name)
    else:
        image = decode(content, name)
    if image.ndim == 3 and image.shape[2] == 1:
        image = image[..., 0]
    return image


def _array(content: bytes, name: str) -> NDArray:
    """An array of a file that says how large it is, without objects in it."""
    file = io.BytesIO(content)
    try:
        version = np.lib.format.read_magic(file)
        read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, _, kind = read(file)
        if not 0 < np.prod(shape, dtype=float) <= MOST_PIXELS or kind.hasobject:
            raise DamagedImageError(f"{name} holds {shape} values of {kind}, which is no depth image")
        file.seek(0)
        return np.load(file, allow_pickle=False)
    except DamagedImageError:
        raise
    except Exception as error:  # numpy evaluates the header, and lets through what comes of that
        raise DamagedImageError(f"{name} is no .npy file that can be read ({error})") from None


def _tiff(content: bytes, name: str) -> NDArray:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            with Image.open(io.BytesIO(content), formats=["TIFF"]) as header:  # reads the header alone
                width, height = header.size
    except Exception:
        raise DamagedImageError(f"{name} is no TIFF image that can be read") from None
    if not 0 < width * height <= MOST_PIXELS:
        raise DamagedImageError(
            f"{name} says that it has {width}x{height} pixels; at most {MOST_PIXELS} are read"
        )
    try:
        image = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_UNCHANGED)
    except cv2.error:
        image = None
    if image is None or image.shape[:2] != (height, width):
        raise DamagedImageError(f"{name} is no TIFF image that can be read")
    return image
