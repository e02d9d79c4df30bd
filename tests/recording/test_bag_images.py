"""Images of messages, made byte by byte."""

import struct
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from riseg_drake.host.images import DamagedImageError
from riseg_drake.recording.bag_images import (
    COLOR_ENCODINGS,
    color_image,
    depth_image,
    encoding_of,
    is_color,
    is_compressed,
    is_depth,
    shape_of,
)

RNG = np.random.default_rng(0)
RGB = RNG.integers(0, 256, (4, 6, 3), np.uint8)


def raw(pixels, encoding, pad=0, big=False, **fields):
    """A message of an array [H, W, ...] whose rows have some bytes more."""
    height, width = pixels.shape[:2]
    rows = np.ascontiguousarray(pixels).view(np.uint8).reshape(height, -1)
    rows = np.pad(rows, ((0, 0), (0, pad)), constant_values=77)
    said = dict(height=height, width=width, step=rows.shape[1], encoding=encoding, is_bigendian=int(big))
    return SimpleNamespace(**{**said, "data": rows.ravel(), **fields})


def packed(content, encoding):
    return SimpleNamespace(format=encoding, data=np.frombuffer(content, np.uint8))


def png(pixels):
    return cv2.imencode(".png", pixels)[1].tobytes()


HEADER = struct.pack("<iff", 0, 0.0, 0.0)


@pytest.mark.parametrize("pad", [0, 5])
@pytest.mark.parametrize(
    ("encoding", "order"),
    [
        ("rgb8", [0, 1, 2]),
        ("bgr8", [2, 1, 0]),
        ("8UC3", [2, 1, 0]),
        ("rgba8", [0, 1, 2, 3]),
        ("bgra8", [2, 1, 0, 3]),
    ],
)
def test_colours_in_any_order_and_rows_of_any_length_are_rgb(encoding, order, pad):
    pixels = np.dstack([RGB, np.full((4, 6), 9, np.uint8)])[..., order]
    image = color_image(raw(pixels, encoding, pad), "a")
    assert image.dtype == np.uint8
    np.testing.assert_array_equal(image, RGB)


@pytest.mark.parametrize("pattern", ["rggb", "bggr", "gbrg", "grbg"])
def test_a_mosaic_of_one_colour_is_that_colour_everywhere(pattern):
    value = {"r": 200, "g": 100, "b": 50}
    tile = np.array([value[letter] for letter in pattern], np.uint8).reshape(2, 2)
    image = color_image(raw(np.tile(tile, (4, 5)), f"bayer_{pattern}8"), "a")
    np.testing.assert_array_equal(image, np.broadcast_to([200, 100, 50], (8, 10, 3)))


@pytest.mark.parametrize("encoding", ["yuv422", "uyvy", "UYVY", "yuv422_yuy2", "yuyv", "YUYV"])
@pytest.mark.parametrize(("yuv", "rgb"), [((81, 90, 240), (255, 0, 0)), ((41, 240, 110), (0, 0, 255))])
def test_two_pixels_of_four_bytes_are_the_colour_of_bt_601(encoding, yuv, rgb):
    y, u, v = yuv
    four = [u, y, v, y] if encoding in ("yuv422", "uyvy", "UYVY") else [y, u, y, v]
    pixels = np.tile(np.array(four, np.uint8), (2, 3)).reshape(2, 6, 2)
    image = color_image(raw(pixels, encoding), "a")
    np.testing.assert_allclose(image.astype(int), np.broadcast_to(rgb, (2, 6, 3)), atol=2)


def test_a_compressed_image_is_its_pixels_without_what_it_has_of_opacity():
    np.testing.assert_array_equal(color_image(packed(png(RGB[..., ::-1]), "rgb8; png"), "a"), RGB)
    opaque = np.dstack([RGB[..., ::-1], np.full((4, 6), 9, np.uint8)])
    np.testing.assert_array_equal(color_image(packed(png(opaque), "png"), "a"), RGB)


@pytest.mark.parametrize("pixels", [RGB[..., 0], RGB.astype(np.uint16)])
def test_a_compressed_image_of_gray_or_of_16_bits_is_no_colour(pixels):
    message = packed(png(pixels), "png")
    assert not is_color(message)
    with pytest.raises(DamagedImageError, match="a is no colour image of 8 bits"):
        color_image(message, "a")


def test_what_an_encoding_is_no_colour_or_no_depth_for_is_said():
    with pytest.raises(DamagedImageError, match="a has the encoding '16UC1', which is no colour"):
        color_image(raw(RGB, "16UC1"), "a")
    with pytest.raises(DamagedImageError, match="a has the encoding 'rgb8', which is no depth"):
        depth_image(raw(RGB, "rgb8"), "a")


@pytest.mark.parametrize("encoding", ["16UC1", "mono16"])
@pytest.mark.parametrize("big", [False, True])
def test_whole_numbers_are_millimetres_unless_another_unit_is_said_and_none_where_they_are_0_or_the_most(
    encoding, big
):
    number = np.array([[0, 3, 300], [1000, 65534, 65535]])
    message = raw(number.astype(">u2" if big else "<u2"), encoding, pad=2, big=big)
    metres = np.array([[0, 0.003, 0.3], [1, 65.534, 0]])
    depth = depth_image(message, "a")
    assert depth.dtype == np.float32
    np.testing.assert_allclose(depth, metres, rtol=1e-6)
    np.testing.assert_allclose(depth_image(message, "a", np.float32(0.0001)), metres / 10, rtol=1e-6)


@pytest.mark.parametrize("order", ["<", ">"])
def test_metres_are_metres_and_0_where_they_are_no_numbers(order):
    metres = np.array([[0.5, np.nan], [np.inf, -1.0]])
    message = raw(metres.astype(f"{order}f4"), "32FC1", big=order == ">")
    np.testing.assert_array_equal(depth_image(message, "a", np.float32(0.1)), [[0.5, 0], [0, 0]])


def test_compressed_depth_is_whole_numbers_behind_a_header_or_without_one():
    number = np.array([[0, 300], [65535, 1200]], np.uint16)
    for content in (HEADER + png(number), png(number)):
        message = packed(content, "16UC1; compressedDepth png")
        np.testing.assert_allclose(depth_image(message, "a"), [[0, 0.3], [0, 1.2]], rtol=1e-6)
        assert shape_of(message) == (2, 2)
    np.testing.assert_allclose(depth_image(message, "a", np.float32(0.01)), [[0, 3], [0, 12]], rtol=1e-6)


def test_compressed_metres_are_kept_as_a_over_z_plus_b():
    # The transport's own rule: number = a / z + b.
    a, b, z = 3000.0, -200.0, np.array([[0.5, 1.5], [3.0, 6.0]])
    number = np.rint(a / z + b).astype(np.uint16)
    number[1, 1] = 0
    content = struct.pack("<iff", 0, a, b) + png(number)
    depth = depth_image(packed(content, "32FC1; compressedDepth png"), "a")
    np.testing.assert_allclose(depth, [[0.5, 1.5], [3.0, 0]], rtol=1e-6)


@pytest.mark.parametrize(
    ("content", "encoding", "says"),
    [
        (b"", "16UC1; compressedDepth RVL", "compressed as RVL"),
        (HEADER + png(RGB), "16UC1; compressedDepth png", "no depth image of 16 bits"),
        (HEADER + png(RGB[..., 0]), "16UC1; compressedDepth png", "no depth image of 16 bits"),
        (HEADER + png(RGB.astype(np.uint16)), "16UC1; compressedDepth png", "no depth image of 16 bits"),
        (png(np.ones((2, 2), np.uint16)), "32FC1; compressedDepth png", "lacks the header"),
    ],
)
def test_compressed_depth_that_is_none_is_refused(content, encoding, says):
    with pytest.raises(DamagedImageError, match=says):
        depth_image(packed(content, encoding), "a")


@pytest.mark.parametrize("encoding", ["16UC1", "32FC1"])
def test_what_holds_distances_is_depth_by_its_encoding_alone(encoding):
    assert is_depth(SimpleNamespace(encoding=encoding), "/a")
    assert is_depth(packed(b"", f"{encoding}; png"), "/a")
    assert is_depth(packed(b"", "; compressedDepth"), "/a")
    assert not is_depth(SimpleNamespace(encoding="rgb8"), "/depth")
    assert not is_depth(SimpleNamespace(encoding=f"{encoding}; compressedDepth"), "/a")
    assert not is_depth(packed(b"", "rgb8; jpeg"), "/depth")


def test_gray_levels_of_16_bits_are_depth_where_the_topic_says_so():
    for message in (SimpleNamespace(encoding="mono16"), packed(b"", "mono16; png")):
        assert is_depth(message, "/camera/Depth/image")
        assert not is_depth(message, "/camera/infra/image")


def test_what_a_message_says_of_its_encoding_shape_and_colours():
    message, file = raw(RGB, "bgr8"), packed(png(RGB), "bgr8; png compressed bgr8")
    assert (is_compressed(message), is_compressed(file)) == (False, True)
    assert (encoding_of(message), encoding_of(file)) == ("bgr8", "bgr8; png compressed bgr8")
    assert shape_of(message) == shape_of(file) == (4, 6)
    assert is_color(message)
    assert is_color(file)
    assert not is_color(raw(RGB, "mono8"))
    assert all(is_color(SimpleNamespace(encoding=encoding)) for encoding in COLOR_ENCODINGS)
    nothing = packed(b"nothing", "rgb8; jpeg")
    assert not is_color(nothing)
    assert shape_of(nothing) == (0, 0)


def test_a_message_with_fewer_bytes_than_its_rows_need_is_damaged_and_one_with_more_is_not():
    message = raw(RGB, "rgb8")
    message.data = np.append(message.data, np.zeros(3, np.uint8))
    np.testing.assert_array_equal(color_image(message, "a"), RGB)
    for fields in ({"data": message.data[: 4 * 18 - 1]}, {"step": 17}, {"height": 0}, {"width": 0}):
        with pytest.raises(DamagedImageError, match=r"a says \d+x\d+ pixels in rows of \d+ bytes, and holds"):
            color_image(raw(RGB, "rgb8", **fields), "a")
    # What would be more than any camera has is not asked for, either.
    with pytest.raises(DamagedImageError, match="says 4097x4096 pixels"):
        depth_image(
            SimpleNamespace(encoding="16UC1", is_bigendian=0, width=4097, height=4096, step=8194, data=Much()),
            "a",
        )


class Much:
    """Bytes that nobody may look at."""

    def __len__(self):
        return 2**40
