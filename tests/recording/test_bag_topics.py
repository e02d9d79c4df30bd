"""Topics by what their messages say, no bag and no library needed."""

from types import SimpleNamespace

import numpy as np
import pytest

from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.geometry.lens import Lens
from riseg_drake.recording.bag_topics import (
    MOST_NAMED,
    CameraInfo,
    ImageTopic,
    aligned,
    camera_info,
    chosen_pair,
    image_base,
    image_topic,
    info_topics,
)
from riseg_drake.recording.layout import RecordingError

RAW = Intrinsics(160, 120, 151.0, 152.0, 81.0, 61.0)
RECTIFIED = Intrinsics(160, 120, 141.0, 142.0, 82.0, 62.0)
# Every place of the matrices holds a number of its own, so that none can stand for another.
K = np.array([151.0, 11.0, 81.0, 12.0, 152.0, 61.0, 13.0, 14.0, 1.0])
P = np.array([141.0, 21.0, 82.0, 22.0, 23.0, 142.0, 62.0, 24.0, 25.0, 26.0, 1.0, 27.0])
BENT = (0.1, -0.08, 0.001, 0.002, 0.0)


def info(k=K, p=P, d=BENT, model="plumb_bob", frame="/eye", upper=False):
    matrices = {"k": k, "p": p, "d": np.array(d)}
    if upper:
        matrices = {name.upper(): value for name, value in matrices.items()}
    header = SimpleNamespace(frame_id=frame)
    return SimpleNamespace(header=header, width=160, height=120, distortion_model=model, **matrices)


def camera(frame="eye", k=RAW):
    return CameraInfo(frame, Lens(k, BENT), Lens(RECTIFIED))


def topic(name, depth=False, frame="eye", known=True, shape=(120, 160), k=RAW):
    return ImageTopic(name, depth, "16UC1" if depth else "rgb8", shape, frame, camera(k=k) if known else None)


@pytest.mark.parametrize("upper", [False, True])
def test_a_cameras_matrices_are_read_row_by_row_by_the_names_of_ros_1_and_2(upper):
    said = camera_info(info(upper=upper))
    assert said == CameraInfo("eye", Lens(RAW, BENT), Lens(RECTIFIED))


def test_without_a_projection_the_rectified_camera_is_the_raw_one_without_its_distortion():
    for p in (None, np.zeros(12)):
        assert camera_info(info(p=p)).rectified == Lens(RAW)


def test_a_camera_that_was_never_calibrated_is_none():
    assert camera_info(info(k=np.zeros(9))) is None
    assert camera_info(SimpleNamespace(header=None, width=160, height=120)) is None


@pytest.mark.parametrize(
    ("model", "d", "fisheye", "kept"),
    [
        ("plumb_bob", (0.0,) * 5, False, ()),
        ("rational_polynomial", (0.1,) * 8, False, (0.1,) * 8),
        ("equidistant", (0.1, 0.2, 0.3, 0.4), True, (0.1, 0.2, 0.3, 0.4)),
        ("Fisheye", (0.1, 0.2, 0.3, 0.4), True, (0.1, 0.2, 0.3, 0.4)),
        ("kannala_brandt4", (0.1, 0.2, 0.3, 0.4), True, (0.1, 0.2, 0.3, 0.4)),
        ("Kannala Brandt4", (0.1, 0.2, 0.3, 0.4, 0.5), True, (0.1, 0.2, 0.3, 0.4)),
    ],
)
def test_a_lens_is_what_its_model_says(model, d, fisheye, kept):
    assert camera_info(info(model=model, d=d)).raw == Lens(RAW, kept, fisheye)


def test_a_number_of_coefficients_that_opencv_has_no_model_for_is_refused():
    with pytest.raises(RecordingError, match=r"holds 4 numbers|holds 5 numbers"):
        camera_info(info(model="equidistant", d=BENT))


@pytest.mark.parametrize(
    ("name", "rectified"),
    [
        ("/c/color/image_raw", False),
        ("/c/color/image_rect_color/compressed", True),
        ("/c/depth/image_rect_raw/compressedDepth", True),
        ("/rect/color/image_raw", False),
        ("image_rect", True),
    ],
)
def test_images_that_are_called_rectified_have_the_rectified_lens(name, rectified):
    assert topic(name).lens == (Lens(RECTIFIED) if rectified else Lens(RAW, BENT))


def test_a_topics_frame_is_its_own_and_its_cameras_where_it_says_none():
    assert topic("/a", frame="own").optical_frame == "own"
    assert topic("/a", frame="").optical_frame == "eye"
    assert topic("/a", frame="", known=False).optical_frame == ""


def test_what_a_transport_adds_is_taken_off_and_cameras_are_looked_for_beside_the_images():
    assert image_base("/c/image_raw/compressed") == image_base("/c/image_raw/compressedDepth") == "/c/image_raw"
    assert info_topics("/c/color/image_raw/compressed") == ["/c/color/camera_info", "/c/info/camera_info"]


def test_a_topic_is_what_its_first_message_says_and_none_where_it_is_no_image_of_this_kind():
    header = SimpleNamespace(frame_id="/eye")
    message = SimpleNamespace(header=header, height=120, width=160, encoding="16UC1")
    assert image_topic("/d", message, camera()) == topic("/d", depth=True)
    message.encoding = "rgb8"
    assert image_topic("/c", message, None) == topic("/c", known=False)
    message.encoding = "mono8"
    assert image_topic("/m", message, camera()) is None
    packed = SimpleNamespace(header=header, format="16UC1; compressedDepth png", data=np.zeros(40, np.uint8))
    found = image_topic("/d/compressedDepth", packed, None)
    assert (found.encoding, found.depth, found.shape) == ("compressed", True, (0, 0))


def test_depth_is_aligned_where_shape_frame_and_intrinsics_are_the_colours():
    color = topic("/c")
    assert aligned(color, topic("/d", depth=True))
    assert aligned(color, topic("/d", depth=True, known=False))
    assert not aligned(color, topic("/d", depth=True, shape=(60, 80)))
    assert not aligned(color, topic("/d", depth=True, frame="other"))
    assert not aligned(color, topic("/d", depth=True, k=RECTIFIED))


def chosen(images, asked=None, related=lambda a, b: False):
    return tuple(image.name for image in chosen_pair(images, asked or {}, related, "a.bag"))


def test_depth_that_is_aligned_is_chosen_before_depth_that_a_transform_relates():
    images = [topic("/c"), topic("/near", depth=True), topic("/far", depth=True, frame="other")]
    assert chosen(images, related=lambda a, b: True) == ("/c", "/near")


def test_depth_of_a_camera_of_its_own_is_chosen_where_a_transform_relates_the_frames_and_it_is_calibrated():
    images = [topic("/c"), topic("/blind", depth=True, frame="other", known=False)]
    asked = []

    def related(a, b):
        asked.append((a, b))
        return b == "other"

    with pytest.raises(RecordingError, match="no depth is aligned to colour"):
        chosen(images, related=related)
    images += [topic("/far", depth=True, frame="other"), topic("/moon", depth=True, frame="moon")]
    assert chosen(images, related=related) == ("/c", "/far")
    assert asked == [("eye", "other"), ("eye", "moon")]


def test_of_raw_and_compressed_images_the_raw_ones_are_chosen_in_any_order_and_others_if_asked_for():
    images = [topic("/c/compressed"), topic("/c"), topic("/d", depth=True), topic("/d/compressed", depth=True)]
    for order in (images, images[::-1]):
        assert chosen(order) == ("/c", "/d")
    assert chosen(images, {"color": "/c/compressed"}) == ("/c/compressed", "/d")
    assert chosen(images, {"depth": "/d/compressed"}) == ("/c", "/d/compressed")


@pytest.mark.parametrize(
    ("images", "says"),
    [
        ([], "no topic holds colour images; it has no images of colour or depth"),
        ([topic("/d", depth=True)], r"no topic holds colour images; it has /d \(16UC1 160x120, frame 'eye'\)"),
        ([topic("/c")], r"no topic holds depth images; it has /c \(rgb8 160x120, frame 'eye'\)"),
        ([topic("/c", known=False), topic("/d", depth=True)], "/c has no CameraInfo; name its topic"),
        ([topic("/c"), topic("/d", depth=True), topic("/e", depth=True)], "several topics would do.*/d.*/e"),
        ([topic("/c"), topic("/d", depth=True, frame="x", known=False)], ".*frame 'x', no CameraInfo"),
    ],
)
def test_what_is_missing_or_too_much_is_said_with_what_there_is(images, says):
    with pytest.raises(RecordingError, match=f"a.bag: {says}"):
        chosen(images)


def test_of_many_topics_some_are_named_and_the_others_counted():
    named = [topic(f"/c{k:02d}") for k in range(MOST_NAMED)]
    with pytest.raises(RecordingError, match="/c11") as all_of_them:
        chosen(named)
    assert "more" not in str(all_of_them.value)
    with pytest.raises(RecordingError, match=r"/c11.* and 2 more$") as some:
        chosen([*named, topic("/x"), topic("/y")])
    assert "/x" not in str(some.value)
