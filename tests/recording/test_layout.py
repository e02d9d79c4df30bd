"""camera.json and poses, by the numbers."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RigidTransform

from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.recording.layout import (
    RecordedFrame,
    RecordingError,
    camera_from_json,
    camera_to_json,
    pose_from_numbers,
    pose_to_numbers,
    unlikely_camera,
)

USUAL = Intrinsics(width=640, height=480, fx=615.0, fy=610.0, cx=325.0, cy=238.0)


def test_a_camera_is_read_as_it_was_written():
    assert camera_from_json(camera_to_json(USUAL, 1000.0)) == (USUAL, 1000.0)


@pytest.mark.parametrize(
    ("key", "value", "says"),
    [
        ("fx", True, '"fx" must be a number'),
        ("fx", "615", '"fx" must be a number'),
        ("cx", float("nan"), '"cx" must be a number'),
        ("depth_scale", 1e9, '"depth_scale" must be a number'),
        ("width", 31, '"width" is 31, it must be a whole number from 32 to 16384'),
        ("height", 16385, '"height" is 16385, it must be'),
        ("width", 640.5, '"width" is 640.5, it must be'),
        ("fy", 0.99, '"fy" is 0.99, it must be from 1 to 1e\\+06'),
        ("depth_scale", 1.01e6, '"depth_scale" is 1.01e\\+06, it must be from'),
        ("cx", 640, '"cx" is 640, outside of the 640 pixels of width'),
        ("cy", -0.1, '"cy" is -0.1, outside of the 480 pixels of height'),
    ],
)
def test_what_no_camera_has_is_refused_by_its_key(key, value, says):
    with pytest.raises(RecordingError, match=says):
        camera_from_json({**camera_to_json(USUAL, 1000.0), key: value})


@pytest.mark.parametrize(
    ("key", "value"),
    [("width", 32.0), ("fx", 1.0), ("depth_scale", 1e6), ("depth_scale", 1.0), ("cx", 0), ("cy", 479.9)],
)
def test_what_a_camera_may_just_have_is_taken(key, value):
    content = {**camera_to_json(USUAL, 1000.0), "cx": 0.0, "cy": 0.0, key: value}
    k, scale = camera_from_json(content)
    assert camera_to_json(k, scale)[key] == value


def test_a_list_is_no_camera():
    with pytest.raises(RecordingError, match="one object with the keys"):
        camera_from_json([640, 480])


@pytest.mark.parametrize(
    "changed",
    [
        {},
        {"cx": 320 + 0.149 * 640, "cy": 240 - 0.149 * 480},
        {"fx": 1.24 * 610},
        {"fy": 1.24 * 615},
        {"fx": 0.31 * 640, "fy": 200.0},
        {"fx": 4.99 * 640, "fy": 3200.0},
    ],
    ids=["usual", "off the middle", "wide pixels", "tall pixels", "wide angle", "long lens"],
)
def test_a_camera_that_may_well_be_is_not_warned_of(changed):
    assert unlikely_camera(replace(USUAL, **changed)) == []


@pytest.mark.parametrize(
    ("changed", "says"),
    [
        ({"cx": 320 + 0.151 * 640}, '"cx" is 416.64, far off the middle of 640'),
        ({"cy": 240 - 0.151 * 480}, '"cy" is 167.52, far off the middle of 480'),
        ({"fx": 1.26 * 610}, '"fx" and "fy" are 768.6 and 610'),
        ({"fy": 1.26 * 615}, '"fx" and "fy" are 615 and 774.9'),
        ({"fx": 0.29 * 640, "fy": 186.0}, '"fx" is 185.6 at a width of 640'),
        ({"fx": 5.01 * 640, "fy": 3206.0}, '"fx" is 3206.4 at a width of 640'),
    ],
)
def test_each_oddity_of_a_camera_is_one_line(changed, says):
    (line,) = unlikely_camera(replace(USUAL, **changed))
    assert line.startswith(says)


def test_poses_are_those_of_drake_with_the_scalar_last():
    q = np.array([0.1, -0.5, 0.3, 0.8])  # w, x, y, z
    q /= np.linalg.norm(q)
    X = RigidTransform(Quaternion(q), [0.3, -0.2, 0.9]).GetAsMatrix4()
    numbers = [0.3, -0.2, 0.9, *q[1:], q[0]]
    np.testing.assert_allclose(pose_from_numbers(np.array(numbers)), X, atol=1e-12)
    assert pose_to_numbers(X) == pytest.approx(numbers)


def test_a_frame_that_was_not_read_stands_in_no_line_of_no_file():
    frame = RecordedFrame(0.5, np.zeros((2, 3, 3), np.uint8), np.zeros((2, 3), np.float32))
    assert (frame.name, frame.line) == ("", 0)
    assert frame.X_WC is frame.position is frame.robot is frame.labels is None
