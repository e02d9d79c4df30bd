from dataclasses import replace
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.geometry.rgbd import NO_PAIR, Frame, FramePair
from riseg_drake.geometry.se3 import exp_se3, inverse, translation
from riseg_drake.pictures.object_colors import object_colors
from riseg_drake.pushing.push import NO_PUSH
from riseg_drake.segmentation.bfif import no_groups
from riseg_drake.segmentation.partition import Margins
from riseg_drake.segmentation.segmentation import Segmentation
from riseg_drake.timeline.file import timeline_stream
from riseg_drake.timeline.log import TimelineLog, group_twist
from riseg_drake.timeline.moment import Moment
from tests.timeline.read_back import rows

CAMERA = Intrinsics(64, 48, 60.0, 50.0, 31.5, 23.25)
X_WC = exp_se3(np.array([np.pi, 0, 0, 0, 0, 0])) @ translation(np.array([0.1, 0.2, -0.5]))
"""Looks down from 0.5 m."""
TWIST = np.array([0.0, 0.0, 0.1, 0.02, 0.0, 0.0])
"""A turn of 0.1 rad about the middle of the group, and 2 cm to the right, in {s}."""
p_C0S = np.array([0.05, -0.02, 0.45])
AHEAD = np.array([0.1, 0, 0])


def groups():
    X_C0S = translation(p_C0S)
    motion = X_C0S @ exp_se3(TWIST) @ inverse(X_C0S)
    return replace(
        no_groups(),
        pixel=np.array([[10, 10], [11, 20]]),
        V_S=np.array([TWIST, TWIST]),
        covariance=np.tile(np.eye(6), (2, 1, 1)),
        p_C0S=p_C0S,
        group=np.array([0, -1]),
        motion_C0=motion[None],
        p_C0Q=np.array([p_C0S + AHEAD, p_C0S]),
    )


def moment(time, label, **more):
    depth = np.full(CAMERA.shape, 0.4, np.float32)
    depth[0] = 0
    color = np.full((*CAMERA.shape, 3), 120, np.uint8)
    frame = Frame(3, time, CAMERA, color, depth, X_WC, np.zeros(CAMERA.shape, bool))
    flow = np.zeros((*CAMERA.shape, 2), np.float32)
    segmentation = Segmentation(3, label, margins=Margins({7: 0.0}, {7: 0.0}))
    return Moment(FramePair(frame, frame), flow, np.full_like(flow, 6.0), no_groups(), segmentation, **more)


@pytest.fixture(scope="module")
def logged(tmp_path_factory):
    label = np.zeros(CAMERA.shape, np.uint16)
    label[0:3, 5:7] = 7
    label[20:22, 30:32] = 400
    push = replace(
        NO_PUSH, p_WB=np.array([0.3, 0.1, 0.02]), direction_W=np.array([0.6, -0.8]), d_push=0.05, cost=1.0
    )
    file = tmp_path_factory.mktemp("timeline") / "folder" / "a.rrd"
    with timeline_stream(file, "a film", live=False) as stream:
        log = TimelineLog(stream)
        log.take(replace(moment(0.0, label), pair=NO_PAIR))  # before the first frame there is nothing
        log.take(replace(moment(8.5, label, push=push, stage_ms={"OpticalFlow": 12.5}), groups=groups()))
        log.take(moment(9.0, np.where(label == 7, np.uint16(7), np.uint16(0)), scores={"Overlap F": 75.0}))
        log.take_scores(8.5, {"Overlap F": 50.0})
    return rows(file)


def test_time_goes_from_the_first_frame_on_and_the_camera_is_where_it_was(logged):
    (t0, pose), (t1, _) = logged["camera"]
    assert (t0, t1) == (0.0, 0.5)
    np.testing.assert_allclose(pose["translation"], [X_WC[:3, 3]], atol=1e-6)
    np.testing.assert_allclose(np.reshape(pose["mat3x3"], (3, 3)).T, X_WC[:3, :3], atol=1e-6)  # by columns
    (_, pinhole), _ = logged["camera/image"]
    K = np.reshape(pinhole["image_from_camera"], (3, 3)).T
    np.testing.assert_allclose(K, [[60, 0, 32.0], [0, 50, 23.75], [0, 0, 1]])  # from the first pixel's corner
    assert pinhole["resolution"] == [[64.0, 48.0]]


def test_depth_is_metres_and_the_mask_has_the_ids(logged):
    (_, depth), _ = logged["camera/image/depth"]
    image = cv2.imdecode(np.array(depth["blob"][0], np.uint8), cv2.IMREAD_UNCHANGED)
    assert depth["meter"] == [1000.0]
    np.testing.assert_array_equal(np.unique(image[0]), [0])
    np.testing.assert_array_equal(np.unique(image[1:]), [400])
    (_, mask), _ = logged["camera/image/mask"]
    ids = np.frombuffer(bytes(mask["buffer"][0]), np.uint16).reshape(CAMERA.shape)
    assert [(a, np.count_nonzero(ids == a)) for a in (7, 400)] == [(7, 6), (400, 4)]


def test_points_of_an_object_lie_in_w_in_the_colour_of_its_id_and_go_with_it(logged):
    (t0, there), (t1, gone) = logged["objects/object_400"]
    assert (t0, t1) == (0.0, 0.5)
    expected = [
        (X_WC @ [0.4 * (u - 31.5) / 60, 0.4 * (v - 23.25) / 50, 0.4, 1])[:3] for v in (20, 21) for u in (30, 31)
    ]
    np.testing.assert_allclose(there["positions"], expected, atol=1e-6)
    (packed,) = set(there["colors"])
    assert [packed >> 24, packed >> 16 & 255, packed >> 8 & 255] == object_colors(np.array(400)).tolist()
    assert gone["is_recursive"] == [False]
    assert len(logged["objects/object_7"][0][1]["positions"]) == 4  # two of its six pixels have no depth


def test_a_twist_is_that_of_its_group_and_ends_with_it(logged):
    np.testing.assert_allclose(group_twist(groups(), 0), TWIST, atol=1e-12)
    (t0, omega), (t1, after) = logged["twists/group_0/omega"]
    assert (t0, t1) == (0.0, 0.5)
    np.testing.assert_allclose(omega["scalars"], TWIST[:3], atol=1e-12)
    assert np.isnan(after["scalars"]).all()
    np.testing.assert_allclose(logged["twists/group_0/v"][0][1]["scalars"], TWIST[3:], atol=1e-12)


def test_a_body_frame_is_an_arrow_to_where_its_twist_takes_it(logged):
    (_, arrows), _ = logged["body_frames"]
    R_WC = X_WC[:3, :3]
    np.testing.assert_allclose(arrows["origins"][0], (X_WC @ [*(p_C0S + AHEAD), 1])[:3], atol=1e-6)
    np.testing.assert_allclose(arrows["vectors"], [R_WC @ [0.02, 0.01, 0], R_WC @ [0.02, 0, 0]], atol=1e-6)


def test_a_push_is_an_arrow_from_the_contact_while_it_is_under_way(logged):
    (t0, arrow), (t1, gone) = logged["push"]
    assert (t0, t1) == (0.0, 0.5)
    np.testing.assert_allclose(arrow["origins"], [[0.3, 0.1, 0.02]], atol=1e-6)
    np.testing.assert_allclose(arrow["vectors"], [[0.03, -0.04, 0]], atol=1e-6)
    assert gone["is_recursive"] == [False]


def test_numbers_stand_at_their_moment(logged):
    assert [(t, c["scalars"]) for t, c in logged["stages/OpticalFlow"]] == [(0.0, [12.5])]
    assert [(t, c["scalars"]) for t, c in logged[r"scores/Overlap\ F"]] == [(0.0, [50.0]), (0.5, [75.0])]
    assert [t for t, _ in logged["confidence/object_7"]] == [0.0, 0.5]


def test_both_flows_are_there_by_their_colours(logged):
    pictures = {}
    for name in ("flow/optical", "flow/expected"):
        blob = logged[name][0][1]["blob"][0]
        pictures[name] = cv2.imdecode(np.array(blob, np.uint8), cv2.IMREAD_COLOR)
        assert pictures[name].shape == (24, 32, 3)
    assert pictures["flow/expected"].min() > 250  # no flow is white
    assert pictures["flow/optical"].mean() < 235


def test_every_id_has_its_name_and_colour(logged):
    (_, first), (_, second) = [row for row in logged[""] if "context" in row[1]]
    named = [entry["class_description"]["info"]["label"] for entry in first["context"][0]]
    assert named == ["background", "object 7", "object 400"]
    assert len(second["context"][0]) == 2


def test_a_robot_stands_as_its_angles_say(tmp_path):
    poses = {"arm/link": X_WC}
    piece = SimpleNamespace(
        body="arm/link", name="shape_0", corners=np.eye(4)[:, :3], triangles=np.array([[0, 1, 2], [1, 2, 3]])
    )
    robot = SimpleNamespace(pieces=[piece], poses=lambda q: poses if q[0] == 0.5 else {})
    with timeline_stream(tmp_path / "a.rrd", "a", live=False) as stream:
        label = np.zeros(CAMERA.shape, np.uint16)
        TimelineLog(stream, robot).take(moment(1.0, label, position=np.array([0.5])))
    there = rows(tmp_path / "a.rrd")
    ((_, pose),) = there["robot/arm/link"]
    np.testing.assert_allclose(pose["translation"], [X_WC[:3, 3]], atol=1e-6)
    ((time, mesh),) = there["robot/arm/link/shape_0"]
    assert time is None
    assert mesh["triangle_indices"] == [[0, 1, 2], [1, 2, 3]]
