"""Drawn objects that move by known motions before a camera at rest; poses that err where nothing moves."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from riseg_drake.app.scenario import Scenario
from riseg_drake.app.segment.replay import Replay
from riseg_drake.evaluation.scores import score
from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.recording.layout import RecordedFrame
from riseg_drake.systems.frame_view import FrameView
from tests.recording.hand_held import Faults, hand_held_film
from tests.recording.moved_objects import moved_film, sideways
from tests.segmentation.drawn_room import VGA as DRAWN_VGA
from tests.segmentation.drawn_scene import CAMERA, Blank, DrawnScene, Texture, looking_down, planar

pytestmark = pytest.mark.renders

VGA = Intrinsics(640, 480, 616.2, 615.8, 316.4, 238.8)
QUARTER = Intrinsics(160, 120, 154.1, 153.9, 79.0, 59.7)
SIZES = [(0.07, 0.06, 0.03), (0.06, 0.08, 0.05), (0.05, 0.05, 0.04)]
PLACES = [planar(-0.08, 0.03, 0.3), planar(0.05, 0.05), planar(0.02, -0.07, 1.0)]


@pytest.mark.parametrize(
    ("speed", "frames", "intrinsics"),
    [(0.5, 16, CAMERA), (2.0, 8, CAMERA), (5.0, 6, CAMERA), (5.0, 7, VGA)],
)
@pytest.mark.parametrize("tilt", [0.0, 0.5], ids=["from above", "from beside"])
def test_each_object_that_moves_is_found_with_overlap_f_above_85(speed, frames, intrinsics, tilt) -> None:
    table = Texture(9, contrast=8) if tilt else Blank()
    camera = looking_down(y=-0.45 * np.tan(tilt), tilt=tilt)
    frame, labels = DrawnScene(SIZES, table=table, intrinsics=intrinsics).frame(
        0, camera, PLACES, np.random.default_rng(0)
    )
    directions = {1: (-0.9, 0.4), 3: (0.3, 0.95)}
    z = {i: float(np.median(frame.depth[labels == i])) for i in directions}
    twists = {i: sideways(speed * np.array(d), z[i], intrinsics, 0.005) for i, d in directions.items()}
    replay = Replay(Scenario(), FrameView(intrinsics, None, None), seed=0)
    film = moved_film(frame.color, frame.depth, labels, intrinsics, twists, frames, np.random.default_rng(1))
    for film_frame in film:
        mask = replay.mask_after(film_frame)
    truth = np.where(np.isin(film_frame.labels, list(twists)), film_frame.labels, 0)
    scores = score(mask, truth)
    assert scores.objects_found == 2
    assert scores.overlap_f >= 0.85


def test_in_a_narrow_image_what_moves_by_6_pixels_a_frame_stays_whole() -> None:
    frame, labels = DrawnScene(SIZES, intrinsics=QUARTER).frame(
        0, looking_down(), PLACES, np.random.default_rng(0)
    )
    twists = {
        i: sideways(6 * np.array(direction), float(np.median(frame.depth[labels == i])), QUARTER, 0.005)
        for i, direction in {1: (-0.9, 0.4), 3: (0.3, 0.95)}.items()
    }
    replay = Replay(Scenario(), FrameView(QUARTER, None, None), seed=0)
    for film_frame in moved_film(
        frame.color, frame.depth, labels, QUARTER, twists, 6, np.random.default_rng(1)
    ):
        mask = replay.mask_after(film_frame)
    scores = score(mask, np.where(np.isin(film_frame.labels, list(twists)), film_frame.labels, 0))
    assert scores.objects_found == 2
    assert scores.overlap_f >= 0.85


def automatic_exposure(frame: RecordedFrame, rng: np.random.Generator) -> RecordedFrame:
    """Brighter and darker by a sixth, once a second."""
    factor = 1 + np.sin(2 * np.pi * frame.time) / 6
    return replace(frame, color=np.clip(np.rint(frame.color * factor), 0, 255).astype(np.uint8))


def flying_pixels(frame: RecordedFrame, rng: np.random.Generator) -> RecordedFrame:
    """Half the pixels at a step in depth lie anywhere between its front and its back."""
    window = np.ones((3, 3), np.uint8)
    front, back = cv2.erode(frame.depth, window), cv2.dilate(frame.depth, window)
    flying = (front > 0) & (back - front > 0.01) & (rng.random(front.shape) < 0.5)
    between = front + (back - front) * rng.random(front.shape)
    return replace(frame, depth=np.where(flying, between, frame.depth).astype(np.float32))


def holes(frame: RecordedFrame, rng: np.random.Generator) -> RecordedFrame:
    """A twentieth of the depth is missing, in specks."""
    specks = cv2.GaussianBlur(rng.normal(size=frame.depth.shape), (0, 0), 1.5)
    return replace(frame, depth=np.where(specks > np.quantile(specks, 0.95), 0, frame.depth).astype(np.float32))


@pytest.mark.parametrize("fault", [automatic_exposure, flying_pixels, holes])
@pytest.mark.parametrize("moves", [True, False], ids=["moving", "still"])
def test_faults_of_real_sensors_are_no_motion_and_hide_none(fault, moves) -> None:
    scene = DrawnScene(SIZES, table=Texture(9, contrast=8))
    frame, labels = scene.frame(0, looking_down(), PLACES, np.random.default_rng(0))
    z = float(np.median(frame.depth[labels == 1]))
    twists = {1: sideways(np.array((-1.4, 0.6)), z, CAMERA, 0.005)} if moves else {}
    replay = Replay(Scenario(), FrameView(CAMERA, None, None), seed=0)
    film = moved_film(frame.color, frame.depth, labels, CAMERA, twists, 14, np.random.default_rng(1))
    rng = np.random.default_rng(2)
    for film_frame in film:
        mask = replay.mask_after(fault(film_frame, rng))
    scores = score(mask, np.where(np.isin(film_frame.labels, list(twists)), film_frame.labels, 0))
    if moves:
        assert scores.objects_found == 1
        assert scores.overlap_f >= 0.85
    else:
        assert replay.segmentation.object_ids == ()


def test_a_body_without_texture_is_found_whole_by_its_edges_once_it_rests() -> None:
    textures = [Blank(gray) for gray in (90.0, 140.0, 60.0)]
    scene = DrawnScene(SIZES, textures, intrinsics=VGA)
    frame, labels = scene.frame(0, looking_down(), PLACES, np.random.default_rng(0))
    twists = {2: sideways(np.array((1.5, -1.0)), float(np.median(frame.depth[labels == 2])), VGA, 0.01)}
    replay = Replay(Scenario(), FrameView(VGA, None, None), seed=0)
    film = list(moved_film(frame.color, frame.depth, labels, VGA, twists, 12, np.random.default_rng(1)))
    rest = [replace(film[-1], time=film[-1].time + k / 15) for k in (1, 2, 3)]
    for film_frame in [*film, *rest]:
        mask = replay.mask_after(film_frame)
    scores = score(mask, np.where(film_frame.labels == 2, film_frame.labels, 0))
    assert scores.objects_found == scores.objects_predicted == 1
    assert scores.overlap_f >= 0.98


@pytest.mark.parametrize("size", [(848, 480), (1280, 720)], ids=["848x480", "1280x720"])
def test_an_object_is_found_in_the_larger_formats_of_real_cameras(size) -> None:
    width, height = size
    intrinsics = Intrinsics(width, height, 0.72 * width, 0.72 * width, width / 2 - 3, height / 2 + 2)
    frame, labels = DrawnScene(SIZES, intrinsics=intrinsics).frame(
        0, looking_down(), PLACES, np.random.default_rng(0)
    )
    twists = {3: sideways(np.array((1.0, 3.0)), float(np.median(frame.depth[labels == 3])), intrinsics, 0.005)}
    replay = Replay(Scenario(), FrameView(intrinsics, None, None), seed=0)
    film = moved_film(frame.color, frame.depth, labels, intrinsics, twists, 8, np.random.default_rng(1))
    for film_frame in film:
        mask = replay.mask_after(film_frame)
    scores = score(mask, np.where(film_frame.labels == 3, film_frame.labels, 0))
    assert scores.objects_found == 1
    assert scores.overlap_f >= 0.85


@pytest.mark.parametrize("table", [Blank(), Texture(9, contrast=8)], ids=["blank table", "textured table"])
def test_nothing_is_found_where_nothing_moves_though_poses_err(table) -> None:
    rng = np.random.default_rng(3)
    scene = DrawnScene(SIZES, table=table)
    replay = Replay(Scenario(), FrameView(CAMERA, None, None), seed=0)
    for k in range(12):
        X_WC = looking_down(0.01 * np.sin(k / 4), 0.01 * np.cos(k / 4), tilt=0.05 * np.sin(k / 5))
        frame, _ = scene.frame(k, X_WC, PLACES, rng)
        error = np.eye(4)
        error[:3, :3] = Rotation.from_rotvec(np.radians(0.1) * rng.normal(size=3)).as_matrix()
        error[:3, 3] = 0.001 * rng.normal(size=3)
        mask = replay.mask_after(RecordedFrame(k / 15, frame.color, frame.depth, X_WC @ error))
        assert not mask.any()
    assert replay.segmentation.object_ids == ()


@pytest.mark.parametrize(("table", "boxes"), [("wood", "blotches"), ("checks", "wood"), ("blank", "blotches")])
def test_a_camera_in_a_hand_finds_nothing_where_nothing_moves_whatever_is_wrong_with_it(table, boxes) -> None:
    wrong = Faults(
        noise=(0.001, 0.05), drift=(0.005, 0.3), hand_eye=(0.005, 0.5), blur=0.015, late=0.01, exposure=0.15
    )
    replay = Replay(Scenario(), FrameView(DRAWN_VGA, None, None), seed=0)
    for frame in hand_held_film(table, boxes, wrong, frames=12, seed=0):
        assert not replay.mask_after(frame).any()
    assert replay.segmentation.object_ids == ()
