import tracemalloc
import zlib

import cv2
import numpy as np
import pytest
from drake import lcmt_image, lcmt_image_array
from pydrake.geometry import RenderEngineVtkParams
from pydrake.lcm import DrakeLcm
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.sensors import ApplyCameraConfig, CameraConfig

from riseg_drake.stations.lcm_images import (
    DamagedPictureError,
    ImageError,
    decode_image,
    decode_images,
    decode_message,
    encode_image,
    encode_images,
)
from riseg_drake.stations.render_engine import make_render_engine

H, W = 48, 84
V, U = np.mgrid[:H, :W]
COLOR = np.stack([3 * U, 5 * V, 255 - 3 * U], axis=-1).astype(np.uint8)  # smooth: JPEG keeps it
DEPTH = np.where(U < 10, 0, 0.3 + 0.001 * (U + V)).astype(np.float32)
TIME, SENT = 1_700_000_000.1239, 1_700_000_000.2


def through_lcm(message):
    return lcmt_image_array.decode(message.encode())


def real_message(**changes):
    options = {"color": COLOR, "aligned_depth": DEPTH, "time": TIME, "sent": SENT, "sequence": 7} | changes
    return through_lcm(encode_images(**options))


def raw_image(name, pixels, pixel_format, channel_type, stride=None, big_endian=False, compress=True):
    """An image packed by hand, row by row."""
    image = lcmt_image()
    image.header.frame_name = name
    image.header.utime = 1_250_000
    image.height, image.width = pixels.shape[:2]
    image.pixel_format, image.channel_type, image.bigendian = pixel_format, channel_type, big_endian
    kind = pixels.dtype.newbyteorder(">" if big_endian else "<")
    rows = [row.astype(kind).tobytes() for row in pixels]
    image.row_stride = stride or len(rows[0])
    data = b"".join(row.ljust(image.row_stride, b"x") for row in rows)
    image.data = zlib.compress(data) if compress else data
    image.size = len(image.data)
    image.compression_method = (
        image.COMPRESSION_METHOD_ZLIB if compress else image.COMPRESSION_METHOD_NOT_COMPRESSED
    )
    return image


def message_of(*images):
    message = lcmt_image_array()
    message.images, message.num_images = list(images), len(images)
    return message


def test_what_the_driver_writes_comes_back():
    images = decode_images(real_message())
    assert np.abs(images.color.astype(int) - COLOR).max() <= 8  # JPEG
    np.testing.assert_allclose(images.depth, DEPTH, atol=0.51e-3)  # whole millimetres
    assert images.depth.dtype == np.float32
    assert (images.depth[:, :10] == 0).all()
    assert images.sequence == 7


def test_an_image_is_stamped_in_whole_milliseconds_and_the_message_in_microseconds():
    message = real_message()
    assert {image.header.utime for image in message.images} == {1_700_000_000_123}
    assert message.header.utime == 1_700_000_000_200_000
    assert decode_images(message).time == 1_700_000_000.123


def test_names_order_and_compression_are_the_drivers():
    gray = np.zeros((H, W), np.uint8)
    message = real_message(raw_depth=DEPTH, infrared={"infrared": gray, "infrared_stereo": gray})
    assert [(i.header.frame_name, i.compression_method) for i in message.images] == [
        ("color", lcmt_image.COMPRESSION_METHOD_JPEG),
        ("depth", lcmt_image.COMPRESSION_METHOD_ZLIB),
        ("infrared", lcmt_image.COMPRESSION_METHOD_PNG),
        ("infrared_stereo", lcmt_image.COMPRESSION_METHOD_PNG),
        ("rect_color_aligned_depth", lcmt_image.COMPRESSION_METHOD_PNG),
    ]
    assert all(i.channel_type == lcmt_image.CHANNEL_TYPE_UINT16 for i in message.images[1:])


def test_aligned_depth_is_taken_where_raw_depth_comes_first():
    images = decode_images(real_message(raw_depth=DEPTH + 1))
    np.testing.assert_allclose(images.depth, DEPTH, atol=0.51e-3)


def test_raw_depth_alone_is_refused_with_the_flag_that_helps():
    with pytest.raises(ImageError, match=r"not aligned.*--software_depth_registration"):
        decode_images(real_message(aligned_depth=None, raw_depth=DEPTH))


@pytest.mark.parametrize("compression", ["PNG", "ZLIB"])
def test_depth_is_exact_in_png_and_zlib(compression):
    depth = np.random.default_rng(0).integers(0, 2**16, (H, W), dtype=np.uint16)
    method = getattr(lcmt_image, f"COMPRESSION_METHOD_{compression}")
    np.testing.assert_array_equal(decode_image(encode_image("depth", depth, 0, method)), depth)


def test_jpeg_of_another_writer_is_read_red_first():
    red = np.zeros((H, W, 3), np.uint8)
    red[..., 2] = 200  # OpenCV has blue first
    image = encode_image("color", COLOR, 0, lcmt_image.COMPRESSION_METHOD_JPEG)
    image.data = cv2.imencode(".jpg", red)[1].tobytes()
    assert decode_image(image)[0, 0] == pytest.approx([200, 0, 0], abs=3)


@pytest.mark.parametrize("compress", [True, False])
@pytest.mark.parametrize("order", ["RGB", "BGR", "RGBA", "BGRA"])
def test_uncompressed_rows_are_read_in_any_order_of_colours_and_with_padding(order, compress):
    pixels = np.dstack([COLOR, np.full((H, W), 255, np.uint8)])[..., ["RGBA".index(c) for c in order]]
    layout = getattr(lcmt_image, f"PIXEL_FORMAT_{order}")
    color = raw_image("rgb", pixels, layout, lcmt_image.CHANNEL_TYPE_UINT8, 4 * W + 12, compress=compress)
    depth = raw_image("depth", DEPTH, lcmt_image.PIXEL_FORMAT_DEPTH, lcmt_image.CHANNEL_TYPE_FLOAT32)
    np.testing.assert_array_equal(decode_images(message_of(depth, color)).color, COLOR)


def test_depth_of_the_other_byte_order_is_read():
    depth = raw_image(
        "depth",
        np.full((H, W), 513, np.uint16),
        lcmt_image.PIXEL_FORMAT_DEPTH,
        lcmt_image.CHANNEL_TYPE_UINT16,
        big_endian=True,
    )
    assert (decode_image(depth) == 513).all()


@pytest.mark.parametrize("value", [0, 65535])
def test_both_ends_of_16_bit_depth_are_invalid(value):
    color = raw_image("rgb", COLOR, lcmt_image.PIXEL_FORMAT_RGB, lcmt_image.CHANNEL_TYPE_UINT8)
    depth = np.full((H, W), value, np.uint16)
    image = raw_image("depth", depth, lcmt_image.PIXEL_FORMAT_DEPTH, lcmt_image.CHANNEL_TYPE_UINT16)
    assert (decode_images(message_of(color, image)).depth == 0).all()


@pytest.mark.parametrize("value", [np.inf, np.nan, -1.0])
def test_depth_in_metres_is_swept_at_the_door(value):
    color = raw_image("rgb", COLOR, lcmt_image.PIXEL_FORMAT_RGB, lcmt_image.CHANNEL_TYPE_UINT8)
    depth = np.full((H, W), value, np.float32)
    image = raw_image("depth", depth, lcmt_image.PIXEL_FORMAT_DEPTH, lcmt_image.CHANNEL_TYPE_FLOAT32)
    assert (decode_images(message_of(color, image)).depth == 0).all()


def spoil(change):
    message = real_message(raw_depth=DEPTH)
    change({image.header.frame_name: image for image in message.images}, message)
    return message


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda images, message: message.images.clear(), "no colour image: frames are none"),
        (lambda images, message: message.images.pop(0), "no colour image"),
        (lambda images, message: setattr(images["color"], "data", b"junk"), "color: damaged JPEG"),
        (lambda images, message: setattr(images["color"], "data", b""), "color: damaged JPEG"),
        (lambda images, message: setattr(images["color"], "compression_method", 9), "compression 9"),
        (lambda images, message: message.images.__delitem__(slice(1, None)), "no depth image"),
    ],
)
def test_what_is_wrong_with_a_message_is_said_in_one_line(change, words):
    with pytest.raises(ImageError, match=words) as caught:
        decode_images(spoil(change))
    assert "\n" not in str(caught.value)


def test_damaged_zlib_and_too_few_bytes_are_named():
    image = raw_image("depth", DEPTH, lcmt_image.PIXEL_FORMAT_DEPTH, lcmt_image.CHANNEL_TYPE_FLOAT32)
    image.height += 1
    with pytest.raises(ImageError, match="do not fill 84x49 pixels of 4 bytes"):
        decode_image(image)
    image.data = image.data[:-9]
    with pytest.raises(ImageError, match="damaged zlib"):
        decode_image(image)


def test_images_of_two_sizes_are_refused():
    with pytest.raises(ImageError, match="depth is 84x47 and colour 84x48"):
        decode_images(real_message(aligned_depth=DEPTH[1:]))


@pytest.mark.renders
@pytest.mark.parametrize("do_compress", [True, False])
def test_a_camera_that_drake_simulates_is_read(do_compress):
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.01)
    scene_graph.AddRenderer("r", make_render_engine(RenderEngineVtkParams(default_clear_color=[0.2, 0.4, 0.8])))
    plant.Finalize()
    lcm = DrakeLcm("memq://")
    config = CameraConfig(
        name="x", width=W, height=H, fps=10, depth=True, renderer_name="r", do_compress=do_compress
    )
    config.X_PB.translation = [0, 0, 1]
    ApplyCameraConfig(config=config, builder=builder, plant=plant, scene_graph=scene_graph, lcm=lcm)
    heard = []
    lcm.Subscribe("DRAKE_RGBD_CAMERA_IMAGES_x", lambda raw: heard.append(lcmt_image_array.decode(raw)))
    Simulator(builder.Build()).AdvanceTo(0.25)
    lcm.HandleSubscriptions(0)
    images = decode_images(heard[-1])
    assert images.time == pytest.approx(0.2)
    assert images.color[0, 0] == pytest.approx([51, 102, 204], abs=1)
    assert (images.depth == 0).all()  # nothing there: too far


def color_of(message):
    (image,) = [image for image in message.images if image.header.frame_name == "color"]
    return image


@pytest.mark.parametrize(
    ("width", "height"), [(0, 48), (-84, 48), (84, -1), (60000, 60000), (2**31 - 1, 2**31 - 1)]
)
@pytest.mark.parametrize("compression", ["JPEG", "ZLIB", "NOT_COMPRESSED"])
def test_sizes_that_cannot_be_are_refused_before_anything_is_unpacked(width, height, compression, monkeypatch):
    image = color_of(real_message())
    image.width, image.height = width, height
    image.compression_method = getattr(lcmt_image, f"COMPRESSION_METHOD_{compression}")
    monkeypatch.setattr("cv2.imdecode", lambda *_: pytest.fail("it is unpacked"))
    with pytest.raises(DamagedPictureError, match=f"color: {width}x{height} pixels cannot be"):
        decode_image(image)


def test_a_camera_of_another_size_is_refused_before_anything_is_unpacked(monkeypatch):
    monkeypatch.setattr("cv2.imdecode", lambda *_: pytest.fail("it is unpacked"))
    with pytest.raises(ImageError, match="sends 84x48 pixels, and the scenario's intrinsics are for 640x480"):
        decode_images(real_message(), size=(640, 480))


def test_data_of_another_size_than_the_message_says_are_not_unpacked(monkeypatch):
    image = color_of(real_message())
    large = cv2.imencode(".jpg", np.zeros((3000, 3000, 3), np.uint8))[1].tobytes()
    image.data, image.size = large, len(large)
    monkeypatch.setattr("cv2.imdecode", lambda *_: pytest.fail("it is unpacked"))
    with pytest.raises(DamagedPictureError, match="of 3000x3000 pixels, the message says 84x48"):
        decode_image(image)


def test_zlib_is_unpacked_as_far_as_the_image_has_room_for_it():
    image = raw_image("depth", DEPTH, lcmt_image.PIXEL_FORMAT_DEPTH, lcmt_image.CHANNEL_TYPE_FLOAT32)
    image.data = zlib.compress(DEPTH.tobytes() + bytes(10**8))
    tracemalloc.start()
    np.testing.assert_array_equal(decode_image(image), DEPTH)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 20 * DEPTH.nbytes


@pytest.mark.parametrize("stride", [1, -1, 10**6])
def test_rows_that_do_not_lie_behind_each_other_are_refused(stride):
    image = raw_image("depth", DEPTH, lcmt_image.PIXEL_FORMAT_DEPTH, lcmt_image.CHANNEL_TYPE_FLOAT32)
    image.row_stride = stride
    with pytest.raises(DamagedPictureError, match="rows of 336 bytes"):
        decode_image(image)


def test_images_of_other_formats_in_the_place_of_a_jpeg_are_damage():
    image = color_of(real_message())
    tiff = cv2.imencode(".tiff", np.zeros((48, 84), np.float64))[1].tobytes()
    for data in (tiff, b"", bytes(image.data)[:-30]):
        image.data, image.size = data, len(data)
        with pytest.raises(DamagedPictureError, match="color: damaged JPEG or PNG data"):
            decode_image(image)


def test_bytes_that_are_no_message_are_damage():
    whole = real_message().encode()
    for data in (b"", whole[:40], whole[:100], b"x" * 200, whole[:20] + b"\xff" * 40):
        with pytest.raises(DamagedPictureError):
            decode_message(data)
    assert decode_message(whole).num_images == len(real_message().images)
