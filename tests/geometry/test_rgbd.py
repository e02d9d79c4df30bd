"""What a frame and a pair work out of their images, for images that are known."""

from copy import deepcopy
from dataclasses import replace

import numpy as np
import pytest

from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.geometry.rgbd import NO_FRAME, Frame, FramePair, sanitize_depth, smooth_gray
from riseg_drake.geometry.se3 import exp_se3

V, U = np.mgrid[:40, :50]


def frame_of(gray: np.ndarray, gain: float = 1.0, X_WC: np.ndarray | None = None) -> Frame:
    color = np.repeat(gray.astype(np.uint8)[..., None], 3, axis=2)
    depth = np.full(gray.shape, 0.5, np.float32)
    robot = gray == 0
    X_WC = np.eye(4) if X_WC is None else X_WC
    return Frame(0, 0.0, Intrinsics(50, 40, 60.0, 60.0, 25.0, 20.0), color, depth, X_WC, robot, gain)


def test_the_gradient_of_a_ramp_is_its_slope_along_both_axes():
    # 3 and 2 gray levels a pixel; away from the image's border a ramp blurred is the same ramp.
    gradient = frame_of(20 + 3 * U + 2 * V).gradient_squared[5:-5, 5:-5]
    np.testing.assert_allclose(gradient, 3**2 + 2**2, rtol=1e-5)
    np.testing.assert_allclose(frame_of(20 + 3 * U).gradient_squared[5:-5, 5:-5], 9, rtol=1e-5)
    np.testing.assert_allclose(frame_of(20 + 2 * V).gradient_squared[5:-5, 5:-5], 4, rtol=1e-5)


def test_gray_values_are_those_of_the_image_times_the_gain():
    gray = 100 + U
    np.testing.assert_allclose(frame_of(gray).gray[5:-5, 5:-5], gray[5:-5, 5:-5], atol=1e-4)
    np.testing.assert_allclose(frame_of(gray, 0.5).gray, 0.5 * frame_of(gray).gray)


def test_colours_weigh_as_the_eye_does_and_red_comes_first():
    color = np.zeros((20, 20, 3), np.uint8)
    for channel, weight in enumerate((0.299, 0.587, 0.114)):
        one = color.copy()
        one[..., channel] = 200
        np.testing.assert_allclose(smooth_gray(one), 200 * weight, atol=0.5)


def test_where_the_robot_is_in_the_way_there_is_neither_gray_nor_depth():
    gray = np.where(U < 10, 0, 80)
    frame = frame_of(gray)
    assert np.isnan(frame.unhidden_gray[:, :10]).all()
    assert np.isfinite(frame.unhidden_gray[:, 10:]).all()
    np.testing.assert_array_equal(frame.unhidden_depth, np.where(U < 10, 0, np.float32(0.5)))


def test_the_motion_of_a_pair_takes_points_of_the_first_camera_to_the_second():
    X_WC0, X_WC1 = (exp_se3(np.array(V_C)) for V_C in ([0.1, 0.2, 0.3, 0.4, 0.5, 0.6], [0.3, 0, 0, 0, 0.1, 0]))
    pair = FramePair(frame_of(100 + U, X_WC=X_WC0), frame_of(100 + U, X_WC=X_WC1))
    p_WQ = np.array([0.3, -0.2, 0.9, 1.0])
    p_C0Q, p_C1Q = (np.linalg.solve(X_WC, p_WQ) for X_WC in (X_WC0, X_WC1))
    assert pair.X_C1C0 @ p_C0Q == pytest.approx(p_C1Q)


def test_every_spelling_of_no_depth_is_0_and_depth_is_kept():
    spelt = np.array([np.nan, np.inf, -np.inf, -0.1, 0.0, 1e-38, 1e-6, 0.001, 0.5, 20.0, 1e19, 1e300])
    cleaned = sanitize_depth(spelt)
    assert cleaned.dtype == np.float32
    np.testing.assert_array_equal(cleaned, np.float32([0, 0, 0, 0, 0, 0, 0, 0.001, 0.5, 20, 0, 0]))


def test_a_copy_of_what_nobody_changes_is_itself():
    assert deepcopy(NO_FRAME) is NO_FRAME
    frame = frame_of(100 + U)
    assert deepcopy([frame])[0] is frame
    assert replace(frame, time=1.0) is not frame


def test_before_the_first_image_there_is_a_frame_of_no_pixels_older_than_any():
    assert NO_FRAME.sequence == -1  # frames count from 0
    assert NO_FRAME.time == -np.inf
    assert NO_FRAME.color.shape == (0, 0, 3)
    assert NO_FRAME.depth.shape == NO_FRAME.robot.shape == NO_FRAME.intrinsics.shape == (0, 0)
    np.testing.assert_array_equal(NO_FRAME.X_WC, np.eye(4))
