"""Films that are right leave no doubt; each way of being wrong leaves one line, which names it."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw
from scipy.spatial.transform import Rotation

from riseg_drake.geometry.se3 import inverse
from riseg_drake.plausibility.check import doubts
from tests.plausibility.filmed import FRAMES, hand_held, reader, with_poses

OPENGL = np.diag([1.0, -1.0, -1.0, 1.0])
ASKEW = RigidTransform(RollPitchYaw(0.3, -0.2, 0.5), [0.06, 0.02, -0.04]).GetAsMatrix4()


@pytest.fixture(scope="module")
def film():
    return hand_held()


def said(film, poses="groundtruth.txt", depth_scale=1000.0):
    return doubts(reader(film), len(film), depth_scale, poses)


def in_units(factor):
    def written(_, X_WC):
        X = X_WC.copy()
        X[:3, 3] *= factor
        return X

    return written


def scalar_first(_, X_WC):
    """A file with w x y z, read as x y z w."""
    x, y, z, w = Rotation.from_matrix(X_WC[:3, :3]).as_quat()
    X = X_WC.copy()
    X[:3, :3] = Rotation.from_quat([w, x, y, z]).as_matrix()
    return X


def test_a_right_film_leaves_no_doubt(film):
    assert said(film) == []


def test_a_camera_that_stands_still_leaves_no_doubt_with_poses_and_without():
    still = hand_held(still=True)
    assert said(still) == said(still, poses=None) == []


WRITTEN = {
    "inverse": (lambda k, X: inverse(X), "X_CW"),
    "OpenGL": (lambda k, X: X @ OPENGL, "OpenGL"),
    "w first": (scalar_first, "w first"),
    "millimetres": (in_units(1e3), "in millimetres"),
    "centimetres": (in_units(1e2), "in centimetres"),
    "of another body": (lambda k, X: X @ ASKEW, "are they of the colour camera"),
}


@pytest.mark.parametrize("case", WRITTEN)
def test_poses_that_are_written_otherwise_are_called_by_that_name(film, case):
    written, name = WRITTEN[case]
    (line,) = said(with_poses(film, written))
    assert line.startswith("groundtruth.txt: by these poses the table does not stand still")
    assert name in line


def test_poses_that_stop_while_the_camera_goes_on_are_stuck(film):
    (line,) = said(with_poses(film, lambda k, X: film[min(k, 4)].X_WC))
    assert "they do not change while the camera moves" in line


def test_a_camera_that_moves_is_not_fixed(film):
    (line,) = said([replace(frame, X_WC=np.eye(4)) for frame in film], poses=None)
    assert line.startswith("the camera moves")


def test_mirrored_images_are_called_so(film):
    mirrored = [
        replace(
            frame,
            color=np.ascontiguousarray(frame.color[:, ::-1]),
            depth=np.ascontiguousarray(frame.depth[:, ::-1]),
        )
        for frame in film
    ]
    (line,) = said(mirrored)
    assert "mirrored left to right" in line


@pytest.mark.parametrize("factor", [2.0, 0.5])
def test_a_depth_scale_that_is_twice_too_small_or_large_shows_where_the_camera_moves(film, factor):
    scaled = [replace(frame, depth=frame.depth * np.float32(factor)) for frame in film]
    (line,) = said(scaled, depth_scale=None)
    assert f"as if depth were {1 / factor:g} times" in line


@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_a_wrong_focal_length_shows_where_the_camera_moves(film, factor):
    k = film[0].intrinsics
    wrong = replace(k, fx=factor * k.fx, fy=factor * k.fy)
    assert any(
        f"as if fx and fy in camera.json were {1 / factor:g} times as long" in line
        for line in said([replace(frame, intrinsics=wrong) for frame in film])
    )


def test_poses_with_the_errors_of_good_odometry_leave_no_doubt(film):
    """A millimetre and a tenth of a degree (standard deviations), anew in each frame."""
    rng = np.random.default_rng(3)

    def written(_, X_WC):
        turn, shift = rng.normal(0, np.deg2rad(0.1), 3), rng.normal(0, 0.001, 3)
        return X_WC @ RigidTransform(RollPitchYaw(turn), shift).GetAsMatrix4()

    assert said(with_poses(film, written)) == []


def test_flow_is_told_in_pixels_of_the_images_whatever_their_size(film):
    stuck = with_poses(film, lambda k, X: film[0].X_WC)
    (small,) = said(stuck)
    k = film[0].intrinsics
    twice = replace(k, width=640, height=480, fx=2 * k.fx, fy=2 * k.fy, cx=2 * k.cx + 0.5, cy=2 * k.cy + 0.5)

    def larger(frame):
        return replace(
            frame,
            intrinsics=twice,
            color=cv2.resize(frame.color, (640, 480), interpolation=cv2.INTER_NEAREST),
            depth=cv2.resize(frame.depth, (640, 480), interpolation=cv2.INTER_NEAREST),
            robot=np.zeros((480, 640), bool),
        )

    (large,) = said([larger(frame) for frame in stuck])
    pixels = [float(line.split("the flow of ")[1].split(" px")[0]) for line in (small, large)]
    assert pixels[1] == pytest.approx(2 * pixels[0], abs=0.15)


def test_one_frame_cannot_show_what_moves(film):
    (line,) = said(film[:1])
    assert line.startswith("there is one frame only")


def test_damaged_frames_are_passed_over(film):
    assert doubts(lambda number: None, FRAMES, 1000.0, None) == []
    assert doubts(lambda number: None if number % 2 else film[number], FRAMES, 1000.0, "groundtruth.txt") == []
