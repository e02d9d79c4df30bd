"""Poses that err: the table says by how much, and what stands still says how the camera really moved."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from riseg_drake.geometry.rgbd import FramePair
from riseg_drake.geometry.se3 import inverse, log_se3
from riseg_drake.segmentation.above_table import AboveTableParameters, objects_above_table
from riseg_drake.segmentation.camera_motion import (
    CameraMotionParameters,
    PoseError,
    renewed_pose_error,
    settled_pair,
    table_change,
)
from riseg_drake.segmentation.noise import MeasurementNoise
from riseg_drake.segmentation.optical_flow import DisFlow
from tests.segmentation.drawn_scene import CAMERA, Blank, DrawnScene, Texture, looking_down, planar

SIZES = [(0.07, 0.06, 0.03), (0.06, 0.08, 0.05), (0.05, 0.05, 0.04)]
PLACES = [planar(-0.08, 0.03, 0.3), planar(0.05, 0.05), planar(0.02, -0.07, 1.0)]
PARAMETERS = CameraMotionParameters()
ERRS = PoseError(tilt_squares=60 * np.radians(0.14) ** 2, height_squares=30 * 0.0014**2, frames=30)
"""Of 1 mm and 0.1 degree in each axis of each pose."""


def pixels(X: np.ndarray) -> float:
    """How far a small motion takes the image at 0.45 m, about."""
    V = log_se3(X)
    p = V[3:] + np.cross(V[:3], [0, 0, 0.45])
    return float(CAMERA.fx * np.linalg.norm(p[:2]) / 0.45)


def pair_with_error(table, error: np.ndarray, moving: float = 0.0):
    rng = np.random.default_rng(1)
    scene = DrawnScene(SIZES, table=table)
    first, _ = scene.frame(0, looking_down(), PLACES, rng)
    moved = [PLACES[0] @ planar(moving, 0.0), *PLACES[1:]]
    X_WC1 = looking_down(x=0.004, y=0.002)
    second, _ = scene.frame(1, X_WC1, moved, rng)
    second = replace(second, X_WC=X_WC1 @ error)
    above = [objects_above_table(f, AboveTableParameters()) for f in (first, second)]
    pair = FramePair(first, second)
    flow = DisFlow()(first.color, second.color)
    return pair, flow, above, inverse(X_WC1) @ looking_down()


def small_error() -> np.ndarray:
    X = np.eye(4)
    X[:3, :3] = Rotation.from_euler("xyz", [0.12, -0.1, 0.1], degrees=True).as_matrix()
    X[:3, 3] = [0.001, -0.0012, 0.0008]
    return X


@pytest.mark.parametrize("table", [Blank(), Texture(9, contrast=10)], ids=["blank table", "textured table"])
@pytest.mark.parametrize("moving", [0.0, 0.006], ids=["all stand still", "one moves"])
def test_the_cameras_motion_is_set_right_to_a_fraction_of_a_pixel(table, moving) -> None:
    pair, flow, above, X_true = pair_with_error(table, small_error(), moving)
    settled = settled_pair(pair, flow, *above, ERRS, MeasurementNoise(), PARAMETERS)
    assert pixels(pair.X_C1C0 @ inverse(X_true)) > 1.0
    assert pixels(settled.X_C1C0 @ inverse(X_true)) < 0.35
    assert 0 < settled.residual < 0.5
    assert settled.reference is pair.reference


def test_exact_poses_are_left_untouched() -> None:
    pair, flow, above, _ = pair_with_error(Blank(), np.eye(4))
    exact = renewed_pose_error(PoseError(), pair.reference, above[0], pair.current, above[1], PARAMETERS)
    assert settled_pair(pair, flow, *above, exact, MeasurementNoise(), PARAMETERS) is pair
    assert settled_pair(pair, flow, *above, PoseError(), MeasurementNoise(), PARAMETERS) is pair


def test_poses_that_the_images_agree_with_are_exact_whatever_the_table_says_and_something_moves() -> None:
    pair, flow, above, _ = pair_with_error(Blank(), np.eye(4), moving=0.006)
    settled = settled_pair(pair, flow, *above, ERRS, MeasurementNoise(), PARAMETERS)
    np.testing.assert_array_equal(settled.current.X_WC, pair.current.X_WC)
    assert 0 < settled.residual < 0.3
    # Not reduced: the whole frame's pixels are its own.
    assert settled.given_residual == settled.pose_error == settled.residual


@pytest.mark.parametrize(("rest", "exact"), [(0.1, True), (0.6, False)])
def test_what_the_images_left_at_rest_says_whether_poses_are_exact_where_all_moves(rest, exact) -> None:
    """Two in three of those frames may be of things that move."""
    pair, flow, above, _ = pair_with_error(Blank(), small_error())  # all seems to move by two pixels
    known = replace(ERRS, left=(rest,) * 4 + (3.0,) * 8)
    settled = settled_pair(pair, flow, *above, known, MeasurementNoise(), PARAMETERS)
    assert np.array_equal(settled.current.X_WC, pair.current.X_WC) == exact
    assert settled.given_residual > 1
    assert settled.pose_error == pytest.approx(rest if exact else 0.0)
    if exact:
        assert settled.residual == pytest.approx(rest)


def test_three_frames_say_nothing_yet_of_what_the_images_leave_at_rest() -> None:
    assert PoseError(left=(0.1,) * 3).by_images == np.inf
    assert PoseError(left=(0.1,) * 4).by_images == pytest.approx(0.1)


def test_what_the_images_left_is_kept_for_the_last_thirty_frames() -> None:
    frame, _ = DrawnScene(SIZES).frame(0, looking_down(), PLACES)
    above, known = objects_above_table(frame, AboveTableParameters()), PoseError()
    assert known.by_images == np.inf
    for k in range(40):
        known = renewed_pose_error(known, frame, above, frame, above, PARAMETERS, left=0.01 * (k + 1))
    assert len(known.left) == 30
    # The lower quartile of 0.11 to 0.40.
    assert known.by_images == pytest.approx(0.11 + 0.29 / 4)
    assert renewed_pose_error(known, frame, above, frame, above, PARAMETERS) is known


@pytest.mark.parametrize("table", [Blank(), Texture(9, contrast=10)], ids=["blank table", "textured table"])
def test_a_table_that_tilts_with_the_depth_does_not_turn_the_camera(table) -> None:
    """As depth that errs smoothly has it: another table in each frame, where the poses are right."""
    pair, flow, above, X_true = pair_with_error(table, np.eye(4))
    tilt = Rotation.from_rotvec([0.01, -0.008, 0]).as_matrix()
    plane_W = np.append(tilt @ above[1].plane_W[:3], above[1].plane_W[3] + 0.004)
    above[1] = replace(above[1], plane_W=plane_W)
    settled = settled_pair(pair, flow, *above, ERRS, MeasurementNoise(), PARAMETERS)
    assert pixels(settled.X_C1C0 @ inverse(X_true)) < 0.35
    assert 0 < settled.residual < 0.3


def test_where_a_tilted_table_helps_but_less_than_the_images_it_is_not_believed() -> None:
    pair, flow, above, X_true = pair_with_error(Texture(9, contrast=10), small_error())
    settled = []
    for angle in (0.003, 0.004):
        tilt = Rotation.from_rotvec([angle, -angle, 0]).as_matrix()
        plane_W = np.append(tilt @ above[1].plane_W[:3], above[1].plane_W[3] + 0.0005)
        tilted = replace(above[1], plane_W=plane_W)
        settled.append(settled_pair(pair, flow, above[0], tilted, ERRS, MeasurementNoise(), PARAMETERS))
    np.testing.assert_array_equal(settled[0].X_C1C0, settled[1].X_C1C0)
    assert pixels(settled[0].X_C1C0 @ inverse(X_true)) < 0.05


def test_the_motion_is_set_right_no_further_than_poses_may_err() -> None:
    far = np.eye(4)
    far[:3, 3] = [0.02, 0, 0]
    pair, flow, above, _ = pair_with_error(Texture(9, contrast=10), far)
    settled = settled_pair(pair, flow, *above, ERRS, MeasurementNoise(), PARAMETERS)
    change = log_se3(settled.X_C1C0 @ inverse(pair.X_C1C0))
    limit = PARAMETERS.reach * np.repeat(ERRS.sigma(PARAMETERS.confidence), 3)
    assert (np.abs(change) <= limit * (1 + 1e-9)).all()


def test_the_poses_error_is_read_off_the_table() -> None:
    rng = np.random.default_rng(2)
    scene, known = DrawnScene(SIZES[:1]), PoseError()
    before = above = None
    for k in range(25):
        X_WC = looking_down(0.002 * k)
        frame, _ = scene.frame(k, X_WC, PLACES[:1], rng)
        error = np.eye(4)
        error[:3, :3] = Rotation.from_rotvec(np.radians(0.1) * rng.normal(size=3)).as_matrix()
        error[:3, 3] = 0.001 * rng.normal(size=3)
        frame = replace(frame, X_WC=X_WC @ error)
        now = objects_above_table(frame, AboveTableParameters())
        if before is not None:
            known = renewed_pose_error(known, before, above, frame, now, PARAMETERS)
        before, above = frame, now
    rotation, translation = known.sigma(0.5)
    assert np.degrees(rotation) == pytest.approx(0.1 * np.sqrt(2), rel=0.35)
    assert translation == pytest.approx(0.001 * np.sqrt(2), rel=0.5)
    assert known.sigma(0.95) > known.sigma(0.5)


def test_a_camera_that_stands_still_says_nothing() -> None:
    frame, _ = DrawnScene(SIZES).frame(0, looking_down(), PLACES, np.random.default_rng(3))
    above = objects_above_table(frame, AboveTableParameters())
    known = renewed_pose_error(PoseError(), frame, above, frame, above, PARAMETERS)
    assert known.sigma(0.95) == (0.0, 0.0)


def test_a_table_that_tilts_once_is_an_outlier_and_one_that_does_again_and_again_is_none() -> None:
    frame, _ = DrawnScene(SIZES).frame(0, looking_down(), PLACES)
    aside = replace(frame, X_WC=looking_down(0.002))
    above = objects_above_table(frame, AboveTableParameters())

    def after(known: PoseError, tilt: float, height: float) -> PoseError:
        plane_W = np.array([np.sin(tilt), 0, np.cos(tilt), 0.0])
        # The height is told amid the view, where that is on the table.
        amid = table_change(frame, np.array([0, 0, 1.0, 0]), aside, plane_W)[1]
        tilted = replace(above, plane_W=plane_W + np.array([0, 0, 0, height - amid]))
        level = replace(above, plane_W=np.array([0, 0, 1.0, 0]))
        return renewed_pose_error(known, frame, level, aside, tilted, PARAMETERS)

    known = PoseError(tilt_squares=40 * 1e-8, height_squares=20 * 1e-8, frames=20)
    # By one standard deviation of each of two angles, and of the height: as it is.
    usual = after(known, np.arcsin(np.sqrt(2) * 1e-4), 1e-4)
    assert usual.tilt_squares == pytest.approx((40 * 29 / 30 + 2) * 1e-8)
    assert usual.height_squares == pytest.approx((20 * 29 / 30 + 1) * 1e-8, rel=1e-3)
    # By a degree and 5 mm: three standard deviations, as large as they may be with that confidence.
    once = after(known, np.radians(1), 0.005)
    assert once.tilt_squares == pytest.approx((40 * 29 / 30 + 2 * 9 * 40 / chi2.ppf(0.05, 40)) * 1e-8)
    assert once.height_squares == pytest.approx((20 * 29 / 30 + 9 * 20 / chi2.ppf(0.05, 20)) * 1e-8)
    assert np.degrees(once.sigma(0.5)[0]) < 0.01
    for _ in range(20):
        once = after(once, np.radians(1), 0.005)
    assert np.degrees(once.sigma(0.95)[0]) > 0.3  # of 0.7 about each of two axes, and nothing before that
    # The first frame of all is believed.
    first = after(PoseError(), np.radians(1), 0.005)
    assert first.tilt_squares == pytest.approx(np.sin(np.radians(1)) ** 2)
    assert first.height_squares == pytest.approx(0.005**2)
