"""Bags against the folder of the same frames, and what a bag may lack or have too much of."""

import os
from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

pytest.importorskip("rosbags", reason="rosbags is not installed: pip install 'riseg-drake[bags]'")

from riseg_drake.geometry.se3 import exp_se3, inverse, translation
from riseg_drake.recording.bag_reader import BagReader
from riseg_drake.recording.layout import RecordingError
from riseg_drake.recording.reader import RecordingReader
from riseg_drake.recording.source import SourceOptions
from riseg_drake.recording.source_kinds import opened_source
from tests.recording.made_bags import CAMERA, BagKind, BagWriter, write_bag, write_depth
from tests.recording.made_recordings import SMALL, drawn_frames, write

KINDS = {
    "ros1": BagKind(ros=1),
    "ros1_compressed_chunks": BagKind(ros=1, chunks=True, color="bgr8"),
    "sqlite": BagKind(),
    "sqlite_bare_file": BagKind(bare=True, depth="32FC1"),
    "mcap": BagKind(storage="mcap", color="bgr8"),
    "mcap_bare_file": BagKind(storage="mcap", bare=True, color="png"),
    "compressed": BagKind(color="png", depth="png"),
    "ros1_compressed_depth": BagKind(ros=1, depth="png", color="png"),
    "ros1_metres": BagKind(ros=1, depth="32FC1"),
    "pose_messages": BagKind(poses="stamped"),
}
POSE = {"pose_messages": {"pose": "/pose"}}


@pytest.fixture(scope="module")
def frames():
    """Three frames, the camera moved before the last; whole tenths of a second, whole millimetres."""
    millimetre = np.float32(0.001)
    drawn = [replace(f, depth=np.rint(f.depth * 1000) * millimetre) for f in drawn_frames(3, rate=10.0)]
    moved = drawn[2].X_WC @ exp_se3(np.array([0.01, -0.02, 0.03, 0.004, 0.005, 0.006]))
    return [*drawn[:2], replace(drawn[2], X_WC=moved)]


def of(path, **options):
    return BagReader(path, SourceOptions(**options))


@pytest.mark.parametrize("name", KINDS)
def test_a_bag_of_any_kind_gives_the_frames_of_the_folder_bit_for_bit(tmp_path, frames, name):
    bag = opened_source(
        write_bag(tmp_path / "bag", frames, SMALL, KINDS[name]), SourceOptions(topics=POSE.get(name, {}))
    )
    folder = RecordingReader(write(tmp_path / "folder", frames))
    assert (len(bag), bag.rate, bag.intrinsics) == (3, folder.rate, SMALL)
    for a, b in zip(bag, folder, strict=True):
        assert a.time == b.time
        np.testing.assert_array_equal(a.color, b.color)
        assert a.depth.dtype == b.depth.dtype
        np.testing.assert_array_equal(a.depth, b.depth)
        np.testing.assert_array_equal(a.X_WC, b.X_WC)
    assert (bag.warnings, bag.left_out) == ([], [])


def test_transforms_are_chained_and_those_that_are_fixed_hold_for_ever(tmp_path, frames):
    X_WB = [exp_se3(np.array([0.1 * k, 0.2, -0.1, 0.3, k, 0.5])) for k in range(2)]
    X_BC = exp_se3(np.array([0.4, -0.3, 0.2, 0.1, 0.2, 0.3]))
    with BagWriter(tmp_path / "bag", BagKind()) as bag:
        for ns, X in zip((990_000_000, 1_010_000_000), X_WB, strict=True):
            bag.transform("/tf", ns, "map", "base", translation(np.array([1.0, 2.0, 3.0])))
            bag.transform("/tf", ns, "base", "hand", X)
        bag.transform("/tf_static", 5, "hand", CAMERA, X_BC)
        rgbd(bag, 10**9, frames[0])
    (frame,) = reader = of(bag.path)
    assert reader.camera_poses == f"TF, {CAMERA} in map"
    half = X_WB[0].copy()
    half[:3, :3] = Slerp([0, 1], Rotation.from_matrix([X[:3, :3] for X in X_WB]))(0.5).as_matrix()
    half[:3, 3] = (X_WB[0][:3, 3] + X_WB[1][:3, 3]) / 2
    np.testing.assert_allclose(frame.X_WC, translation(np.array([1.0, 2.0, 3.0])) @ half @ X_BC, atol=1e-12)
    (frame,) = of(bag.path, world_frame="hand")
    assert frame.X_WC is None  # the camera is fixed to the hand
    (frame,) = of(bag.path, world_frame="base")
    np.testing.assert_allclose(frame.X_WC, half @ X_BC, atol=1e-12)
    with pytest.raises(
        RecordingError, match=r"--world-frame moon is not above .*; there are base, camera_color"
    ):
        of(bag.path, world_frame="moon")


def rgbd(bag, ns, frame, base="/camera"):
    bag.camera_info(f"{base}/color/camera_info", ns, CAMERA, SMALL)
    bag.image(f"{base}/color/image_raw", ns, CAMERA, frame.color, "rgb8")
    write_depth(bag, f"{base}/aligned_depth_to_color/image_raw", ns, CAMERA, frame.depth, "16UC1")


def test_two_cameras_are_a_question_that_names_the_option(tmp_path, frames):
    with BagWriter(tmp_path / "bag", BagKind()) as bag:
        rgbd(bag, 10**9, frames[0], "/left")
        rgbd(bag, 10**9, frames[1], "/right")
    says = r"several topics would do; choose by --topics color=TOPIC,depth=TOPIC; it has /left/aligned_depth"
    with pytest.raises(RecordingError, match=says):
        of(bag.path)
    asked = {"color": "/right/color/image_raw", "depth": "/right/aligned_depth_to_color/image_raw"}
    (frame,) = of(bag.path, topics=asked)
    np.testing.assert_array_equal(frame.color, frames[1].color)


def test_depth_of_another_camera_is_aligned_by_the_transform_between_them(tmp_path, frames):
    """A wall 0.5 m ahead, seen by a depth camera 5 cm to the left: the same wall, but for a strip."""
    X_CD = translation(np.array([-0.05, 0, 0]))
    wall = np.full(SMALL.shape, 0.5, np.float32)
    with BagWriter(tmp_path / "bag", BagKind()) as bag:
        bag.camera_info("/c/color/camera_info", 10**9, CAMERA, SMALL)
        bag.camera_info("/c/depth/camera_info", 10**9, "eye", SMALL)
        bag.image("/c/color/image_raw", 10**9, CAMERA, frames[0].color, "rgb8")
        write_depth(bag, "/c/depth/image_rect_raw", 10**9, "eye", wall, "16UC1")
        path = bag.path
    with pytest.raises(RecordingError, match="no depth is aligned to colour, nor is a transform known between"):
        of(path)
    with BagWriter(tmp_path / "with_tf", BagKind()) as bag:
        bag.camera_info("/c/color/camera_info", 10**9, CAMERA, SMALL)
        bag.camera_info("/c/depth/camera_info", 10**9, "eye", SMALL)
        bag.image("/c/color/image_raw", 10**9, CAMERA, frames[0].color, "rgb8")
        write_depth(bag, "/c/depth/image_rect_raw", 10**9, "eye", wall, "16UC1")
        bag.transform("/tf_static", 10**9, "eye", CAMERA, inverse(X_CD))
    (frame,) = reader = of(bag.path)
    # 0.05 m at 0.5 m is a tenth of the focal length of 154.1 px: 15.41 px to the left.
    np.testing.assert_allclose(frame.depth[:, : 160 - 16], 0.5, atol=1e-6)
    assert not frame.depth[:, 160 - 15 :].any()
    assert (
        reader.warnings[0] == "depth of /c/depth/image_rect_raw is not aligned to colour; the program aligns it"
    )


def test_joint_angles_count_where_it_is_said_what_they_belong_to(tmp_path, frames):
    with BagWriter(tmp_path / "bag", BagKind()) as bag:
        for ns in (990_000_000, 1_010_000_000):
            bag.joints("/joint_states", ns, ["lift", "turn"], [ns / 10**9, 2.0])
        rgbd(bag, 10**9, frames[0])
    reader = of(bag.path)
    assert reader.joints is None
    assert reader.warnings == [
        "/joint_states is not used; --robot names the robot that its joint angles are of"
    ]
    for options in ({"robot": True}, {"topics": {"joints": "/joint_states"}}):
        (frame,) = reader = of(bag.path, **options)
        assert reader.joints.names == ["lift", "turn"]
        np.testing.assert_allclose(frame.position, [1.0, 2.0], atol=1e-12)


@pytest.mark.parametrize(
    ("topics", "says"),
    [
        ({"colour": "/a"}, r"--topics: 'colour' is none of color, depth, color_info, depth_info, pose, joints"),
        ({"color": "/a"}, r"has no messages on /a \(--topics color=\)"),
    ],
)
def test_a_topic_that_is_not_there_is_said(tmp_path, frames, topics, says):
    with pytest.raises(RecordingError, match=says):
        of(write_bag(tmp_path / "bag", frames, SMALL, BagKind()), topics=topics)


@pytest.mark.parametrize("name", ["ros1", "sqlite_bare_file", "mcap_bare_file"])
def test_a_file_that_was_cut_off_gives_frames_or_is_refused(tmp_path, frames, name):
    path = write_bag(tmp_path / "bag", frames, SMALL, KINDS[name])
    content = path.read_bytes()
    for length in (0, 10, len(content) // 2, len(content) - 20):
        path.write_bytes(content[:length])
        with suppress(RecordingError):
            assert len(list(of(path))) <= 3


def test_images_without_a_partner_in_time_are_left_out(tmp_path, frames):
    with BagWriter(tmp_path / "bag", BagKind()) as bag:
        rgbd(bag, 10**9, frames[0])
        bag.image("/camera/color/image_raw", 1_100_000_000, CAMERA, frames[1].color, "rgb8")
    reader = of(bag.path)
    assert len(list(reader)) == 1
    (left_out,) = map(str, reader.left_out)
    assert left_out.endswith(
        "/camera/color/image_raw: image 2 is left out: /camera/aligned_depth_to_color/image_raw has nothing "
        "within 0.02 s of it"
    )


def test_a_damaged_size_is_not_asked_for(tmp_path, frames):
    """The first record of an mcap file, behind 8 bytes of magic and its kind, says how long it is."""
    file = write_bag(tmp_path / "bag", frames, SMALL, BagKind(storage="mcap", bare=True))
    content = bytearray(file.read_bytes())
    content[9:17] = (2**62).to_bytes(8, "little")
    file.write_bytes(content)
    with pytest.raises(RecordingError, match="cannot be read"):
        opened_source(file, SourceOptions())


@pytest.mark.parametrize(("name", "says"), [("metadata.yaml", "larger than 1 MB"), ("bag.db3", "not a file")])
def test_what_the_library_would_wait_for_is_refused_before(tmp_path, frames, name, says):
    """3 GB of nothing in the place of a list of topics; a pipe that nobody writes to."""
    folder = write_bag(tmp_path / "bag", frames, SMALL, BagKind())
    (folder / name).unlink()
    if name == "bag.db3":
        os.mkfifo(folder / name)
    else:
        with (folder / name).open("wb") as file:
            file.truncate(3 * 2**30)
    with pytest.raises(RecordingError, match=says):
        opened_source(folder, SourceOptions())


def test_gigabytes_without_a_first_line_are_no_bag(tmp_path):
    with (tmp_path / "a.bag").open("wb") as file:
        file.truncate(3 * 2**30)
    with pytest.raises(RecordingError, match="does not begin as one of ROS 1"):
        opened_source(tmp_path / "a.bag", SourceOptions())
