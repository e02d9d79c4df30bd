"""Motions sharpened on the images: towards the true ones, and found where body frames say nothing."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.geometry.rgbd import Frame, FramePair
from riseg_drake.geometry.se3 import exp_se3, translation
from riseg_drake.segmentation.alignment import AlignmentParameters, align_motions
from riseg_drake.segmentation.keyframe import KeyframeParameters, make_keyframe
from riseg_drake.segmentation.motions import flow_difference
from riseg_drake.segmentation.noise import MeasurementNoise
from tests.segmentation.drawn_scene import (
    CAMERA,
    Blank,
    DrawnScene,
    Texture,
    looking_down,
    motion_seen_from,
    planar,
    standing,
)

pytestmark = pytest.mark.renders

SIZES = [(0.08, 0.07, 0.03), (0.06, 0.08, 0.05)]
PLACES = [planar(-0.06, 0.0), planar(0.06, 0.0)]
CAMERAS = (looking_down(), looking_down(0.004, -0.003))
DEPTH_NOISE = 0.0023
FOCAL_LENGTH = 308.1


FINE = Intrinsics(
    4 * CAMERA.width, 4 * CAMERA.height, 4 * CAMERA.fx, 4 * CAMERA.fy, 4 * CAMERA.cx + 1.5, 4 * CAMERA.cy + 1.5
)


def as_a_camera_sees(frame: Frame) -> Frame:
    """The frame with pixels that are means of four by four: edges are not jagged, as in an image."""
    color = cv2.resize(frame.color, CAMERA.shape[::-1], interpolation=cv2.INTER_AREA)
    coarse = (slice(1, None, 4), slice(1, None, 4))
    return replace(frame, intrinsics=CAMERA, color=color, depth=frame.depth[coarse], robot=frame.robot[coarse])


class Moved:
    """The first box has moved, the second stands still."""

    def __init__(self, textures, to=(-0.057, 0.004, 0.06), seed: int = 0) -> None:
        scene, after = DrawnScene(SIZES, textures=textures, intrinsics=FINE), [planar(*to), PLACES[1]]
        pair, label_0, _ = scene.pair(CAMERAS, (PLACES, after), np.random.default_rng(seed))
        self.pair, label_0 = (
            FramePair(*(as_a_camera_sees(f) for f in (pair.reference, pair.current))),
            label_0[1::4, 1::4],
        )
        above_0 = standing(self.pair.reference, label_0 > 0)
        self.edges = make_keyframe(self.pair.reference, above_0, MeasurementNoise(), KeyframeParameters()).edges
        self.motion_C0 = motion_seen_from(CAMERAS[0], PLACES[0], after[0])
        v, u = self.edges.surface.pixel
        self.p_C0Q = self.edges.p_C0Q[label_0[v, u] == 1]

    def aligned(self, *starts: np.ndarray, parameters: AlignmentParameters | None = None) -> np.ndarray:
        motions = np.array(starts).reshape(-1, 4, 4)
        return align_motions(self.pair, self.edges, motions, DEPTH_NOISE, parameters or AlignmentParameters())

    def error(self, motion: np.ndarray) -> float:
        """Pixels by which a motion is wrong on the box that moved."""
        return flow_difference(self.p_C0Q, motion, self.motion_C0, FOCAL_LENGTH)

    def nearly(self, size: float) -> np.ndarray:
        """The true motion, wrong by a turn (rad) and as many shifts of a tenth of a metre."""
        centre = self.p_C0Q.mean(0)
        wrong = exp_se3(size * np.array([0.2, -0.2, 1.0, 0.1, -0.1, 0.02]))
        return translation(centre) @ wrong @ translation(-centre) @ self.motion_C0


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(("texture", "rounds"), [(Texture(1), 2), (Blank(90.0), 8)])
def test_a_motion_that_is_a_little_wrong_is_set_right(texture, rounds: int, seed: int) -> None:
    moved = Moved([texture, Texture(2)], seed=seed)
    start = moved.nearly(0.012)
    (aligned,) = moved.aligned(start, parameters=AlignmentParameters(rounds=rounds))
    assert moved.error(start) > 0.5
    assert moved.error(aligned) < 0.3 * moved.error(start)


def test_a_motion_that_is_right_stays_right() -> None:
    moved = Moved([Texture(1), Texture(2)])
    (aligned,) = moved.aligned(moved.motion_C0)
    assert moved.error(aligned) < 0.1


def test_two_starts_that_end_in_one_motion_are_one() -> None:
    moved = Moved([Texture(1), Texture(2)])
    assert len(moved.aligned(moved.motion_C0, moved.nearly(0.004))) == 1


def test_without_rounds_motions_stay_as_the_body_frames_have_them() -> None:
    moved = Moved([Texture(1), Texture(2)])
    start = moved.nearly(0.02)
    np.testing.assert_array_equal(moved.aligned(start, parameters=AlignmentParameters(rounds=0))[0], start)
