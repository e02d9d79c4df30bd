"""The camera's place from views of a board: corners drawn to the pixel's fraction, and whole pictures of it."""

import cv2
import numpy as np
import pytest

from riseg_drake.geometry.camera import Intrinsics, project
from riseg_drake.geometry.se3 import exp_se3, inverse, log_se3, move_points, translation
from riseg_drake.robot.calibration_board import CalibrationBoard
from riseg_drake.robot.camera_calibration import BoardView, CalibrationError, board_pose, calibrated
from tests.robot.drawn_board import drawn_board

K = Intrinsics(848, 480, 616.285, 615.778, 405.418, 232.864)
X_EC = exp_se3(np.array([0.05, 0.35, 1.5, 0.0, 0.0, 0.0]))
X_EC[:3, 3] = [0.11, -0.02, -0.29]
X_WB = translation(np.array([0.45, -0.05, 0.004])) @ exp_se3(np.array([3.1, 0.02, 0.01, 0, 0, 0]))
GRID = np.stack([*np.meshgrid(np.linspace(0, 0.24, 7), np.linspace(0, 0.16, 5)), np.zeros((5, 7))], -1).reshape(
    -1, 3
)


def camera_poses(count, rng, reach=0.4):
    """X_WC [4, 4] that look at the board's middle, tilted by up to 0.45 rad to all sides."""
    poses = []
    for k in range(count):
        tilt, side = rng.uniform(0.15, 0.45), 2 * np.pi * k / count + rng.normal(0, 0.2)
        turned = exp_se3(np.array([tilt * np.cos(side), tilt * np.sin(side), rng.uniform(-0.5, 0.5), 0, 0, 0]))
        middle = X_WB @ translation(np.array([0.12, 0.08, 0.0]))
        poses.append(middle @ turned @ translation(np.array([0, 0, -reach * rng.uniform(0.85, 1.15)])))
    return poses


def wrist_views(count, noise, rng, X_WB=X_WB):
    views = []
    for number, X_WC in enumerate(camera_poses(count, rng)):
        uv = project(move_points(inverse(X_WC) @ X_WB, GRID), K) + rng.normal(0, noise, (len(GRID), 2))
        views.append(BoardView(f"{number}.png", X_WC @ inverse(X_EC), GRID, uv))
    return views


def apart(X, Y):
    """(m, rad) between two poses."""
    V = log_se3(inverse(X) @ Y)
    return float(np.linalg.norm((inverse(X) @ Y)[:3, 3])), float(np.linalg.norm(V[:3]))


def test_corners_without_noise_give_camera_and_board_exactly():
    found = calibrated(wrist_views(6, 0.0, np.random.default_rng(0)), K)
    np.testing.assert_allclose(found.X, X_EC, atol=1e-8)
    np.testing.assert_allclose(found.Y, X_WB, atol=1e-8)
    assert found.residual < 1e-6
    assert found.left_out == ()


def test_a_camera_in_the_world_is_found_by_a_board_that_the_arm_carries():
    rng = np.random.default_rng(1)
    X_WC, X_EB = (
        X_WB @ exp_se3(np.array([0.3, 0.2, 0.1, 0.1, 0.0, -0.9])),
        exp_se3(np.array([0.1, 0.2, 0.3, 0, 0, 0.05])),
    )
    views = []
    for k in range(8):
        turned = exp_se3(0.4 * np.array([np.cos(k), np.sin(k), 0.5 * np.sin(3 * k), 0, 0, 0]))
        X_CB = translation(np.array([0.02 * k - 0.1, 0.01 * k, 0.6])) @ turned
        uv = project(move_points(X_CB, GRID), K)
        views.append(BoardView(str(k), X_WC @ X_CB @ inverse(X_EB), GRID, uv + rng.normal(0, 1e-9, uv.shape)))
    found = calibrated(views, K, world=True)
    np.testing.assert_allclose(found.X, X_WC, atol=1e-6)
    np.testing.assert_allclose(found.Y, X_EB, atol=1e-6)


def test_the_errors_are_as_large_as_it_says_they_are():
    normed = []
    for seed in range(12):
        found = calibrated(wrist_views(8, 0.3, np.random.default_rng(seed)), K)
        metres, radians = apart(X_EC, found.X)
        normed.append([(metres / found.translation_error) ** 2, (radians / found.rotation_error) ** 2])
        assert found.residual == pytest.approx(0.3, rel=0.15)
    # The squares have the mean 1 if they are; of a dozen it lies within half of that.
    np.testing.assert_allclose(np.mean(normed, axis=0), 1.0, atol=0.5)


def test_a_view_that_does_not_fit_is_left_out_and_named():
    views = wrist_views(8, 0.2, np.random.default_rng(3))
    moved = BoardView("moved.png", translation(np.array([0.02, 0.0, 0.0])) @ views[2].X_WE, GRID, views[2].uv)
    found = calibrated([*views[:2], moved, *views[3:]], K)
    assert found.left_out == ("moved.png",)
    assert apart(X_EC, found.X)[0] < 0.001


def test_views_from_which_nothing_follows_are_refused_with_what_would_be_right():
    rng = np.random.default_rng(0)
    with pytest.raises(CalibrationError, match="seen in 3 views; at least 4"):
        calibrated(wrist_views(3, 0.1, rng), K)
    around = [
        X_WB @ exp_se3(np.array([0, 0, 0.3 * k, 0, 0, 0])) @ translation(np.array([0, 0, -0.4]))
        for k in range(6)
    ]
    views = [
        BoardView(str(k), X @ inverse(X_EC), GRID, project(move_points(inverse(X) @ X_WB, GRID), K))
        for k, X in enumerate(around)
    ]
    with pytest.raises(CalibrationError, match="tilt the camera to several sides"):
        calibrated(views, K)


@pytest.mark.renders
@pytest.mark.parametrize("board", [CalibrationBoard(), CalibrationBoard("apriltag", 4, 3, 0.05, 0.012)])
def test_pictures_of_a_board_with_noise_give_the_camera_within_a_millimetre_and_a_tenth_of_a_degree(board):
    rng, views = np.random.default_rng(5), []
    for number, X_WC in enumerate(camera_poses(12, rng)):
        picture = drawn_board(board, inverse(X_WC) @ X_WB, K, rng)
        p_BQ, uv = board.corners(cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY))
        assert len(uv) >= 20
        views.append(BoardView(str(number), X_WC @ inverse(X_EC), p_BQ, uv))
        assert apart(board_pose(views[-1], K), inverse(X_WC) @ X_WB)[0] < 0.004
    found = calibrated(views, K)
    metres, radians = apart(X_EC, found.X)
    assert metres < 0.001
    assert np.degrees(radians) < 0.1
    assert found.translation_error < 0.001
    assert found.left_out == ()
    assert abs(found.Y[2, 3] - X_WB[2, 3]) < 0.001
