"""What the writer puts into its files, to the letter."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.recording.layout import RecordedFrame, RecordingError
from riseg_drake.recording.writer import RecordingWriter, depth_to_millimetres

INTRINSICS = Intrinsics(4, 3, 5.5, 6.5, 1.5, 1.25)
QUARTER_TURN = np.array([[0.0, -1, 0, 0.1], [1, 0, 0, -0.2], [0, 0, 1, 0.3], [0, 0, 0, 1]])
FRAME = RecordedFrame(
    time=0.1 + 0.2,
    color=np.arange(36, dtype=np.uint8).reshape(3, 4, 3),
    depth=np.full((3, 4), 0.5, np.float32),
    X_WC=QUARTER_TURN,
    position=np.array([0.1, -0.2, 0, 1 / 3, 0, 0, 2.5]),
    robot=np.eye(3, 4, dtype=bool),
    labels=np.arange(12).reshape(3, 4) * 100,
)
BARE = RecordedFrame(1.0, FRAME.color, FRAME.depth)


@pytest.fixture
def folder(tmp_path):
    """A recording of a frame with everything, and one with colour and depth alone."""
    with RecordingWriter(tmp_path / "new" / "recording", INTRINSICS) as writer:
        writer.append(FRAME)
        assert writer.frames == 1
        writer.append(BARE)
        assert writer.frames == 2
    return tmp_path / "new" / "recording"


def image(path):
    return cv2.imread(str(path), cv2.IMREAD_UNCHANGED)


def test_a_stamp_is_written_to_the_last_bit(folder):
    heading = "# timestamp filename\n"
    assert (folder / "rgb.txt").read_text() == (
        heading + "0.30000000000000004 rgb/000000.png\n1.0 rgb/000001.png\n"
    )
    assert (folder / "depth.txt").read_text() == (
        heading + "0.30000000000000004 depth/000000.png\n1.0 depth/000001.png\n"
    )


def test_joints_are_a_table_with_commas_of_the_frames_that_have_them(folder):
    assert (folder / "joints.csv").read_text() == (
        "timestamp,q1,q2,q3,q4,q5,q6,q7\n0.30000000000000004,0.1,-0.2,0.0,0.3333333333333333,0.0,0.0,2.5\n"
    )


def test_poses_are_place_and_quaternion_of_the_frames_that_have_them(folder):
    heading, line = (folder / "groundtruth.txt").read_text().splitlines()
    assert heading.startswith("# timestamp tx ty tz qx qy qz qw")
    half = np.sqrt(0.5)
    assert [float(cell) for cell in line.split(" ")] == pytest.approx(
        [0.1 + 0.2, 0.1, -0.2, 0.3, 0, 0, half, half]
    )


def test_the_camera_is_a_file_that_a_person_reads(folder):
    assert (folder / "camera.json").read_text() == (
        '{\n  "width": 4,\n  "height": 3,\n  "fx": 5.5,\n  "fy": 6.5,\n  "cx": 1.5,\n  "cy": 1.25,\n'
        '  "depth_scale": 1000.0\n}\n'
    )


def test_images_hold_colour_millimetres_the_robot_in_white_and_ids(folder):
    np.testing.assert_array_equal(image(folder / "rgb" / "000000.png")[..., ::-1], FRAME.color)
    depth, labels = image(folder / "depth" / "000000.png"), image(folder / "label" / "000000.png")
    assert depth.dtype == labels.dtype == np.uint16
    np.testing.assert_array_equal(depth, np.full((3, 4), 500))
    np.testing.assert_array_equal(labels, FRAME.labels)
    robot = image(folder / "robot" / "000000.png")
    assert robot.dtype == np.uint8
    np.testing.assert_array_equal(robot, 255 * np.eye(3, 4))


def test_what_a_frame_lacks_has_no_image(folder):
    images = sorted(str(path.relative_to(folder)) for path in folder.rglob("*.png"))
    assert images == [
        "depth/000000.png",
        "depth/000001.png",
        "label/000000.png",
        "rgb/000000.png",
        "rgb/000001.png",
        "robot/000000.png",
    ]


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"color": np.zeros((4, 4, 3), np.uint8)}, r"frame 0 has \(4, 4\) in colour and \(3, 4\) in depth"),
        ({"depth": np.zeros((3, 5), np.float32)}, r"frame 0 has \(3, 4\) in colour and \(3, 5\) in depth"),
    ],
)
def test_an_image_of_another_size_than_the_cameras_is_refused_and_leaves_no_trace(tmp_path, wrong, says):
    with RecordingWriter(tmp_path, INTRINSICS) as writer:
        with pytest.raises(RecordingError, match=says):
            writer.append(replace(BARE, **wrong))
        assert writer.frames == 0
    assert [path.name for path in tmp_path.iterdir()] == ["camera.json"]


def test_a_folder_without_a_list_of_images_is_taken(tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    with RecordingWriter(tmp_path, INTRINSICS) as writer:
        writer.append(BARE)
    assert (tmp_path / "notes.txt").read_text() == "mine"
    with pytest.raises(RecordingError, match="holds a recording already"):
        RecordingWriter(tmp_path, INTRINSICS)


def test_depth_is_rounded_to_the_nearest_millimetre():
    depth = np.array([[0.0014, 0.0016, 1.2344, 1.2346, 65.5344, 65.5346]])
    millimetres = depth_to_millimetres(depth)
    assert millimetres.dtype == np.uint16
    np.testing.assert_array_equal(millimetres, [[1, 2, 1234, 1235, 65534, 0]])
