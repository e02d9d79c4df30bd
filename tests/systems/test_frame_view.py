"""FrameView through its ports."""

import numpy as np
import pytest
from pydrake.common.value import Value
from pydrake.systems.sensors import ImageDepth32F, ImageRgba8U

from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.geometry.rgbd import NO_FRAME, Frame
from riseg_drake.systems.frame_view import FrameView
from tests.systems.ports import port_names

CAMERA = Intrinsics(6, 4, 5.0, 5.0, 2.5, 1.5)
Q = np.arange(7) / 10


def forward(q: np.ndarray) -> np.ndarray:
    X_WC = np.eye(4)
    X_WC[:3, 3] = q[:3]
    return X_WC


def silhouette(q: np.ndarray) -> np.ndarray:
    mask = np.zeros(CAMERA.shape, bool)
    mask[0] = q[6] > 0.5
    return mask


def images(width: int = 6, height: int = 4, depth_size: tuple[int, int] | None = None):
    color, depth = ImageRgba8U(width, height), ImageDepth32F(*(depth_size or (width, height)))
    if width:
        color.mutable_data[...] = np.random.default_rng(0).integers(0, 255, color.data.shape)
        depth.mutable_data[...] = 0.5
    return color, depth


def seen(color: ImageRgba8U, depth: ImageDepth32F, q: np.ndarray = Q) -> Frame:
    view = FrameView(CAMERA, forward, silhouette)
    context = view.CreateDefaultContext()
    for name, value in (
        ("color_image", Value(color)),
        ("depth_image", Value(depth)),
        ("image_time", [1.25]),
        ("position", q),
    ):
        view.GetInputPort(name).FixValue(context, value)
    return view.GetOutputPort("frame").Eval(context)


def test_ports_have_the_names_of_the_contract() -> None:
    view = FrameView(CAMERA, forward, silhouette)
    assert port_names(view) == (["color_image", "depth_image", "image_time", "position"], ["frame"])
    assert view.GetInputPort("position").size() == 7


def test_a_frame_is_what_the_ports_say_of_one_moment() -> None:
    color, depth = images()
    frame = seen(color, depth)
    assert isinstance(frame, Frame)
    assert frame.time == 1.25
    assert frame.intrinsics == CAMERA
    np.testing.assert_array_equal(frame.color, color.data[..., :3])
    assert frame.color.dtype == np.uint8
    np.testing.assert_array_equal(frame.depth, np.full(CAMERA.shape, 0.5, np.float32))
    assert frame.depth.dtype == np.float32
    np.testing.assert_array_equal(frame.X_WC, forward(Q))
    np.testing.assert_array_equal(frame.robot, silhouette(Q))


def test_every_spelling_of_invalid_depth_becomes_zero() -> None:
    color, depth = images()
    depth.mutable_data[0, :4, 0] = [np.nan, np.inf, -1.0, 0.0]
    np.testing.assert_array_equal(seen(color, depth).depth[0], [0, 0, 0, 0, 0.5, 0.5])


def test_a_frame_keeps_its_pixels_when_the_next_image_comes() -> None:
    color, depth = images()
    frame = seen(color, depth)
    before = frame.color.copy(), frame.depth.copy()
    color.mutable_data[...], depth.mutable_data[...] = 0, 0.1
    np.testing.assert_array_equal(frame.color, before[0])
    np.testing.assert_array_equal(frame.depth, before[1])


@pytest.mark.parametrize("sizes", [(0, 0), (6, 4)], ids=["no image", "no depth image"])
def test_before_the_first_image_there_is_no_frame(sizes: tuple[int, int]) -> None:
    assert seen(*images(*sizes, depth_size=(0, 0))) is NO_FRAME


@pytest.mark.parametrize(("color_size", "depth_size"), [((8, 6), (8, 6)), ((6, 4), (12, 8)), ((6, 4), (4, 6))])
def test_images_of_another_size_are_refused_with_all_sizes(color_size, depth_size) -> None:
    with pytest.raises(ValueError, match="6x4") as error:
        seen(*images(*color_size, depth_size=depth_size))
    assert "{}x{}".format(*color_size) in str(error.value)
    assert "{}x{}".format(*depth_size) in str(error.value)
    assert "\n" not in str(error.value)


ELSEWHERE = forward(np.full(7, 0.7))
PIXELS = np.eye(4, 6, dtype=bool)


@pytest.mark.parametrize("pose_known", [True, False], ids=["pose from theta", "pose from a port"])
@pytest.mark.parametrize("robot_known", [True, False], ids=["robot from theta", "robot from a port"])
def test_what_does_not_follow_from_theta_has_a_port_and_theta_has_one_if_anything_does(
    pose_known: bool, robot_known: bool
) -> None:
    view = FrameView(CAMERA, forward if pose_known else None, silhouette if robot_known else None, 9)
    inputs = ["color_image", "depth_image", "image_time"]
    inputs += ["position"] if pose_known or robot_known else []
    inputs += [] if pose_known else ["camera_pose"]
    inputs += [] if robot_known else ["robot_pixels"]
    assert port_names(view) == (inputs, ["frame"])
    color, depth = images()
    context, q = view.CreateDefaultContext(), np.arange(9) / 10
    values = {
        "color_image": Value(color),
        "depth_image": Value(depth),
        "image_time": [0.5],
        "position": q,
        "camera_pose": Value[object](ELSEWHERE),
        "robot_pixels": Value[object](PIXELS),
    }
    for name in inputs:
        view.GetInputPort(name).FixValue(context, values[name])
    frame = view.GetOutputPort("frame").Eval(context)
    np.testing.assert_array_equal(frame.X_WC, forward(q) if pose_known else ELSEWHERE)
    np.testing.assert_array_equal(frame.robot, silhouette(q) if robot_known else PIXELS)
    assert view.intrinsics == CAMERA
    assert frame.sequence == 0


def test_without_a_depth_image_there_is_no_frame_yet() -> None:
    color, _ = images()
    assert seen(color, ImageDepth32F()) is NO_FRAME
    assert seen(ImageRgba8U(), images()[1]) is NO_FRAME
