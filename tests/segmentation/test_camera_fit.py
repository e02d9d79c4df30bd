"""The steps of setting poses right, each for itself: derivatives, and posteriors in closed form."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from riseg_drake.geometry.camera import Intrinsics, project, rays
from riseg_drake.geometry.se3 import exp_se3, inverse, move_points, translation
from riseg_drake.segmentation import camera_motion
from riseg_drake.segmentation.camera_motion import (
    CameraMotionParameters,
    PoseError,
    renewed_pose_error,
    table_change,
)
from riseg_drake.segmentation.noise import MeasurementNoise

K = Intrinsics(160, 120, 154.0, 151.0, 76.0, 63.0)
DOWN = np.diag([1.0, -1.0, -1.0, 1.0])
X_WC0 = translation(np.array([0.4, 0.1, 0.5])) @ DOWN
X_WC1 = translation(np.array([0.42, 0.08, 0.6])) @ DOWN @ exp_se3(np.array([0.2, -0.1, 0.3, 0, 0, 0]))
TABLE = np.array([0.0, 0.0, 1.0, 0.0])
PARAMETERS = CameraMotionParameters()


def frame(X_WC):
    return SimpleNamespace(X_WC=X_WC, intrinsics=K)


def above(plane_W):
    return SimpleNamespace(plane_W=plane_W)


def tilted(turn, height):
    """The table turned by a rotation vector in W about W's origin, and raised along its normal, m."""
    return np.append(Rotation.from_rotvec(turn).apply([0, 0, 1.0]), -height)


def test_a_table_that_is_where_it_was_has_not_changed_wherever_the_camera_is_now():
    for plane_W in (TABLE, tilted([0.1, 0.05, 0], 0.2)):
        tilt, height, _, _ = table_change(frame(X_WC0), plane_W, frame(X_WC1), plane_W)
        np.testing.assert_allclose([*tilt, height], 0, atol=1e-12)


def test_the_tables_change_is_its_turn_in_the_camera_and_how_much_lower_it_is_amid_the_view():
    turn = np.array([0.01, -0.02, 0.0])
    tilt, height, p_C1T, plane_C1 = table_change(frame(X_WC0), TABLE, frame(X_WC1), tilted(turn, 0.004))
    size = np.linalg.norm(turn)
    np.testing.assert_allclose(tilt, X_WC1[:3, :3].T @ turn * np.sin(size) / size, atol=1e-12)
    p_WT = move_points(X_WC1, p_C1T)
    assert p_WT[2] == pytest.approx(0, abs=1e-12)
    np.testing.assert_allclose(project(p_C1T[None], K)[0], [80, 60], atol=1e-9)
    assert height == pytest.approx(tilted(turn, 0.004)[:3] @ p_WT - 0.004)
    np.testing.assert_allclose(plane_C1[:3], X_WC1[:3, :3].T @ tilted(turn, 0)[:3], atol=1e-12)
    # A table that is found lower than expected is behind the found one's normal.
    lower = table_change(frame(X_WC0), TABLE, frame(X_WC1), tilted([0, 0, 0], -0.003))
    assert lower[1] == pytest.approx(0.003)


def test_old_frames_count_less_by_one_part_in_as_many_as_are_remembered():
    parameters = CameraMotionParameters(frames=4.0)
    known, turn = PoseError(1.0, 2.0, 3.0), np.array([0.03, 0.0, 0.0])
    plane_W = tilted(turn, 0.01)
    tilt, height, _, _ = table_change(frame(X_WC0), TABLE, frame(X_WC1), plane_W)
    now = renewed_pose_error(known, frame(X_WC0), above(TABLE), frame(X_WC1), above(plane_W), parameters)
    assert now.tilt_squares == pytest.approx(0.75 + np.sin(0.03) ** 2)
    assert tilt @ tilt == pytest.approx(np.sin(0.03) ** 2)
    assert now.height_squares == pytest.approx(1.5 + height**2)
    assert now.frames == pytest.approx(3.25)
    forgetful = CameraMotionParameters(frames=0.5)
    now = renewed_pose_error(known, frame(X_WC0), above(TABLE), frame(X_WC1), above(plane_W), forgetful)
    assert now.frames == 1.0


@pytest.mark.parametrize(
    ("turn", "height", "told"),
    [(0.089, 0.0, True), (0.092, 0.0, False), (0.0, 0.029, True), (0.0, 0.031, False), (0.0, -0.031, False)],
)
def test_a_table_that_tilts_by_5_degrees_or_rises_by_3_cm_is_another_one(turn, height, told):
    # Turned about the point amid the view, whose height does not change by that.
    _, _, p_C1T, _ = table_change(frame(X_WC0), TABLE, frame(X_WC1), TABLE)
    n = Rotation.from_rotvec([turn, 0, 0]).apply([0, 0, 1.0])
    plane_W = np.append(n, -n @ move_points(X_WC1, p_C1T) - height)
    now = renewed_pose_error(PoseError(), frame(X_WC0), above(TABLE), frame(X_WC1), above(plane_W), PARAMETERS)
    assert (now.frames > 0) is told


def test_the_error_s_upper_end_is_chi_squares_with_two_tilts_and_one_height_a_frame():
    # 30 frames: 43.188 and 18.493 are chi squared's 5 % quantiles of 60 and 30 (printed tables).
    rotation, shift = PoseError(60 * 1e-6, 30 * 4e-6, 30.0).sigma(0.95)
    assert rotation == pytest.approx(1e-3 * np.sqrt(60 / 43.188), rel=1e-4)
    assert shift == pytest.approx(2e-3 * np.sqrt(30 / 18.493), rel=1e-4)
    assert PoseError(1.0, 1.0, 0.99).sigma(0.95) == (0.0, 0.0)
    assert min(PoseError(1.0, 1.0, 1.0).sigma(0.95)) > 0


def scattered(count=400, seed=0):
    rng = np.random.default_rng(seed)
    v, u = rng.integers(0, K.height, count), rng.integers(0, K.width, count)
    return rays(K)[v, u].astype(float) * rng.uniform(0.4, 0.8, count)[:, None]


PAIR = SimpleNamespace(X_C1C0=inverse(X_WC1) @ X_WC0, current=SimpleNamespace(intrinsics=K))


def test_the_images_change_with_the_cameras_motion_as_finite_differences_say():
    p_C0Q, V = scattered(20), np.array([0.01, -0.02, 0.03, 0.005, 0.01, -0.02])
    uv_1 = np.zeros((20, 2))
    _, J = camera_motion._linearised(V, p_C0Q, uv_1, PAIR)
    now = exp_se3(V) @ PAIR.X_C1C0
    for k, step in enumerate(1e-6 * np.eye(6)):
        ahead, back = (project(move_points(exp_se3(s) @ now, p_C0Q), K) for s in (step, -step))
        np.testing.assert_allclose(J[:, :, k], (ahead - back) / 2e-6, rtol=1e-5, atol=1e-3)


def test_what_is_left_is_where_a_point_appears_less_where_it_should_and_much_behind_the_camera():
    p_C0Q = scattered(5)
    right = project(move_points(PAIR.X_C1C0, p_C0Q), K)
    p_C0Q[4] = move_points(inverse(PAIR.X_C1C0), np.array([0.1, 0.1, -0.5]))
    apart, J = camera_motion._linearised(np.zeros(6), p_C0Q, right + np.array([1.0, -2.0]), PAIR)
    np.testing.assert_allclose(apart[:4], [[1.0, -2.0]] * 4, atol=1e-6)
    np.testing.assert_array_equal(apart[4], [1e3, 1e3])
    np.testing.assert_array_equal(J[4], 0)


def fitted(p_C0Q, uv_1, flow_noise, change=None, sigma=(0.01, 0.01), **changed):
    noise = np.full(len(p_C0Q), float(flow_noise))
    parameters = CameraMotionParameters(**changed)
    return camera_motion._fit(p_C0Q, uv_1, noise, PAIR, change, sigma, parameters)


def test_a_motion_that_all_points_show_is_found_though_a_third_of_them_moves_by_itself():
    V, p_C0Q = np.array([0.004, -0.006, 0.008, 0.003, -0.002, 0.004]), scattered()
    uv_1 = project(move_points(exp_se3(V) @ PAIR.X_C1C0, p_C0Q), K)
    found = fitted(p_C0Q, uv_1, 0.2)
    np.testing.assert_allclose(found, V, atol=1e-3)
    uv_1[:130] += [6.0, 4.0]
    np.testing.assert_allclose(fitted(p_C0Q, uv_1, 0.2), V, atol=2e-3)


def test_it_is_set_right_by_no_more_than_its_reach_in_the_same_direction():
    V, p_C0Q = np.array([0.0, 0.0, 0.08, 0.0, 0.0, 0.0]), scattered()
    uv_1 = project(move_points(exp_se3(V) @ PAIR.X_C1C0, p_C0Q), K)
    found = fitted(p_C0Q, uv_1, 0.2, reach=2.0)
    assert np.abs(found).max() == pytest.approx(0.02)
    assert found[2] == pytest.approx(0.02, rel=0.01)


@pytest.mark.parametrize(("sigma_R", "sigma_p"), [(5e-4, 3e-4), (1e-3, 1e-3), (2e-3, 1.5e-4)])
def test_where_the_images_say_nothing_the_table_and_the_poses_share_the_change(sigma_R, sigma_p):
    # Looking straight down at it; the table tilts by 5e-4 rad and rises by 3e-4 m, as well as it is known.
    p_C0Q = scattered(50)
    uv_1 = project(move_points(PAIR.X_C1C0, p_C0Q), K)
    change = (np.array([4e-4, -3e-4, 0.0]), 2e-4, np.array([0, 0, 0.6]), np.array([0, 0, -1.0, 0.6]))
    found = fitted(p_C0Q, uv_1, 1e4, change, (sigma_R, sigma_p))
    turn, shift = (sigma**2 / (sigma**2 + known**2) for sigma, known in ((sigma_R, 5e-4), (sigma_p, 3e-4)))
    expected = [4e-4 * turn, -3e-4 * turn, 0, 0, 0, 2e-4 * shift]
    np.testing.assert_allclose(found, expected, atol=1e-8)


def test_the_height_of_a_table_beside_the_axis_is_that_of_the_point_that_was_measured():
    # Of a turn of 1 mrad about v the point 0.1 m to the right rises by 0.1 mm: that alone is no shift.
    p_C0Q = scattered(50)
    uv_1 = project(move_points(PAIR.X_C1C0, p_C0Q), K)
    turn = np.array([0.0, 1e-3, 0.0])
    p = np.array([0.1, 0.0, 0.6])
    moved = np.cross(turn, p)[2]  # along +z, away from the camera: the expected table is above it
    change = (turn, moved, p, np.array([0, 0, -1.0, 0.6]))
    found = fitted(p_C0Q, uv_1, 1e4, change, (0.1, 0.1))
    np.testing.assert_allclose(found[[0, 1, 2, 5]], [0, 1e-3, 0, 0], atol=2e-6)


def test_points_are_taken_where_texture_depth_and_flow_are_and_far_from_outlines_so_many_at_most():
    rng = np.random.default_rng(0)
    shape = (120, 160)
    gray, depth = rng.uniform(0, 255, shape).astype(np.float32), np.full(shape, 0.5, np.float32)
    depth[:30, :40] = 0
    robot, mask = np.zeros(shape, bool), np.zeros(shape, bool)
    robot[90:, :] = True
    mask[:, 100:] = True
    gray[:, 60:80] = 100.0
    flow = np.zeros((*shape, 2), np.float32)
    flow[40:60, :30] = [-31.0, 0.0]
    flow[40:60, 140:] = [25.0, 0.0]
    flow[:15, :] = [0.0, -20.0]
    reference = SimpleNamespace(gray=gray, depth=depth, robot=robot, intrinsics=K)
    pair = SimpleNamespace(reference=reference, current=SimpleNamespace(intrinsics=K))
    standing = SimpleNamespace(mask=mask)
    p, sigma, on_table, uv_1 = camera_motion._points(pair, flow, standing, MeasurementNoise(), 160 * 120)
    assert len(p) == len(sigma) == len(on_table) == len(uv_1)
    taken = np.zeros(shape, bool)
    u, v = np.rint(project(p, K)).astype(int).T
    taken[v, u] = True
    good = (depth > 0) & ~robot
    good[:, 93:107] = False  # within 7 pixels of the outline
    good[40:60, :30] = good[40:60, 140:] = good[:15] = False  # out of the picture
    blank = np.zeros(shape, bool)
    blank[:, 67:73] = True
    unsure = np.zeros(shape, bool)
    unsure[:, 55:85] = True  # as far as the flow's window is partly blank
    assert not taken[blank].any()
    np.testing.assert_array_equal(taken[~unsure], good[~unsure])
    np.testing.assert_array_equal(on_table, u < 100)
    np.testing.assert_allclose(uv_1, np.column_stack([u, v]) + flow[v, u], atol=1e-4)
    assert np.all(sigma < 0.4)
    for most in (len(p), len(p) - 1, 500, 7):
        few = camera_motion._points(pair, flow, standing, MeasurementNoise(), most)
        step = -(-len(p) // most)
        assert len(p) / step <= len(few[0]) <= most
        for some, every in zip(few, (p, sigma, on_table, uv_1), strict=True):
            np.testing.assert_array_equal(some, every[::step])
