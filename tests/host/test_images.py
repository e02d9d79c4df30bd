"""Images are refused by what their headers claim, before a decoder makes room for it."""

import struct
import zlib

import cv2
import numpy as np
import pytest

from riseg_drake.host import images
from riseg_drake.host.images import MOST_SCANS, DamagedImageError, ImageKind, decode, image_kind

PIXELS = np.random.default_rng(0).integers(0, 65536, (12, 20)).astype(np.uint16)
COLOR = np.random.default_rng(1).integers(0, 256, (12, 20, 3)).astype(np.uint8)
PNG = cv2.imencode(".png", PIXELS)[1].tobytes()
JPEG = cv2.imencode(".jpg", COLOR)[1].tobytes()


def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def claiming(width, height):
    """The PNG and the JPEG with another size in their headers."""
    png = PNG[:8] + chunk(b"IHDR", struct.pack(">II", width, height) + PNG[24:29]) + PNG[33:]
    at = JPEG.index(b"\xff\xc0")
    jpeg = JPEG[: at + 5] + struct.pack(">HH", height, width) + JPEG[at + 9 :]
    return png, jpeg


@pytest.fixture
def decoded(monkeypatch):
    """What OpenCV is asked to decode."""
    asked = []
    imdecode = cv2.imdecode
    monkeypatch.setattr(images.cv2, "imdecode", lambda data, flags: asked.append(data) or imdecode(data, flags))
    return asked


def test_headers_tell_what_an_image_is():
    assert image_kind(PNG) == ImageKind(20, 12, 1, 16)
    assert image_kind(JPEG) == ImageKind(20, 12, 3, 8)
    assert image_kind(b"II*\0" + PNG) is None  # a TIFF
    np.testing.assert_array_equal(decode(PNG, "x"), PIXELS)


def test_what_claims_more_than_a_camera_has_is_not_decoded(decoded):
    for content in claiming(30000, 30000):
        with pytest.raises(DamagedImageError, match="30000x30000 pixels; at most"):
            decode(content, "x", jpeg=True)
    for content in claiming(0, 12):
        with pytest.raises(DamagedImageError, match="0x12"):
            decode(content, "x", jpeg=True)
    assert not decoded


def test_other_formats_and_images_that_were_cut_off_are_not_decoded(decoded):
    tiff = cv2.imencode(".tiff", PIXELS)[1].tobytes()
    for content in (tiff, b"", PNG[:-20], PNG[:40], JPEG[:-9], JPEG[:50]):
        with pytest.raises(DamagedImageError, match="x is not a readable PNG or JPEG image"):
            decode(content, "x", jpeg=True)
    with pytest.raises(DamagedImageError, match="not a readable PNG image"):
        decode(JPEG, "x")
    assert not decoded


def test_decoders_see_no_chunk_that_says_nothing_of_pixels(decoded):
    odd = (
        PNG[:33] + chunk(b"acTL", bytes(8)) + chunk(b"zTXt", b"a\0\0" + zlib.compress(bytes(10**6))) + PNG[33:]
    )
    np.testing.assert_array_equal(decode(odd, "x"), PIXELS)
    assert decoded[0].tobytes() == PNG


def test_a_jpeg_of_endless_scans_is_refused(decoded):
    scan = JPEG[JPEG.index(b"\xff\xda") : -2]
    with pytest.raises(DamagedImageError):
        decode(JPEG[:-2] + MOST_SCANS * scan + JPEG[-2:], "x", jpeg=True)
    assert not decoded
