"""Corners of boards, where they are, in any release of OpenCV."""

import cv2
import numpy as np
import pytest

from riseg_drake.geometry.camera import Intrinsics, project
from riseg_drake.geometry.se3 import exp_se3, move_points
from riseg_drake.robot.calibration_board import CalibrationBoard
from tests.robot.drawn_board import drawn_board

K = Intrinsics(640, 480, 610.0, 612.0, 317.3, 241.8)
X_CB = exp_se3(np.array([0.25, -0.3, 0.1, -0.13, -0.08, 0.4]))
BOARDS = [CalibrationBoard(), CalibrationBoard("apriltag", 4, 3, 0.05, 0.012)]


@pytest.mark.parametrize("board", BOARDS)
def test_corners_are_found_without_a_shift(board):
    """OpenCV 4.10 has those of ChArUco boards half a pixel off."""
    picture = drawn_board(board, X_CB, K, np.random.default_rng(0))
    p_BQ, uv = board.corners(cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY))
    assert len(uv) == (24 if board.kind == "charuco" else 48)
    off = uv - project(move_points(X_CB, p_BQ), K)
    assert np.abs(off.mean(axis=0)).max() < 0.06
    assert off.std(axis=0).max() < 0.1


def test_a_picture_without_a_board_has_no_corners():
    gray = np.random.default_rng(0).integers(0, 255, (480, 640), np.uint8)
    for board in BOARDS:
        assert board.corners(gray)[1].shape == (0, 2)


def test_boards_are_as_large_as_they_are_drawn():
    assert CalibrationBoard().size == pytest.approx((0.28, 0.2))
    assert BOARDS[1].size == pytest.approx((4 * 0.05 + 3 * 0.012, 3 * 0.05 + 2 * 0.012))
    assert CalibrationBoard().drawn(1000).shape == (200, 280)


@pytest.mark.parametrize(
    ("board", "words"),
    [
        (CalibrationBoard("chess"), "one of charuco, apriltag"),
        (CalibrationBoard(columns=1), "2 to 20 columns"),
        (CalibrationBoard(length=0.03, other=0.03), "smaller than the squares"),
        (CalibrationBoard(length=4.0), "5 to 500 mm"),
    ],
)
def test_boards_that_cannot_be_are_said(board, words):
    with pytest.raises(ValueError, match=words):
        board.check()
