"""Expected flow against closed forms."""

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix

from riseg_drake.geometry.camera import Intrinsics, pixel_grid
from riseg_drake.segmentation.expected_flow import expected_flow, pixel_projection

CAMERA = Intrinsics(64, 48, 60.0, 61.0, 30.5, 24.25)


def test_sideways_motion_over_a_fronto_parallel_plane_is_one_constant_flow() -> None:
    depth = np.full(CAMERA.shape, 0.5, np.float32)
    X_C1C0 = RigidTransform([-0.01, 0.02, 0]).GetAsMatrix4()
    flow = expected_flow(depth, X_C1C0, CAMERA)
    np.testing.assert_allclose(flow[..., 0], -0.01 * 60.0 / 0.5, atol=1e-5)
    np.testing.assert_allclose(flow[..., 1], 0.02 * 61.0 / 0.5, atol=1e-5)


def test_a_pure_rotation_moves_pixels_by_a_homography_whatever_the_depth() -> None:
    R = RotationMatrix(RollPitchYaw(0.02, -0.03, 0.05)).matrix()
    X = np.eye(4)
    X[:3, :3] = R
    K = np.array([[60.0, 0, 30.5], [0, 61.0, 24.25], [0, 0, 1]])
    H = K @ R @ np.linalg.inv(K)
    uv = pixel_grid(48, 64).astype(float)
    moved = np.concatenate([uv, np.ones((48, 64, 1))], -1) @ H.T
    expected = moved[..., :2] / moved[..., 2:] - uv
    for depth in (0.3, 2.0):
        flow = expected_flow(np.full(CAMERA.shape, depth, np.float32), X, CAMERA)
        np.testing.assert_allclose(flow, expected, atol=2e-4)


def test_motion_along_the_axis_spreads_flow_from_the_principal_point() -> None:
    depth = np.full(CAMERA.shape, 0.5, np.float32)
    flow = expected_flow(depth, RigidTransform([0, 0, -0.1]).GetAsMatrix4(), CAMERA)
    offset = pixel_grid(48, 64) - np.float32([30.5, 24.25])
    np.testing.assert_allclose(flow, offset * (0.5 / 0.4 - 1), atol=1e-4)


def test_points_that_come_to_lie_behind_the_camera_have_no_flow() -> None:
    depth = np.full(CAMERA.shape, 0.5, np.float32)
    depth[:, 32:] = 2.0
    flow = expected_flow(depth, RigidTransform([0, 0, -1.0]).GetAsMatrix4(), CAMERA)
    assert np.isnan(flow[:, :32]).all()
    assert np.isfinite(flow[:, 32:]).all()


def test_invalid_depth_has_no_flow() -> None:
    depth = np.full(CAMERA.shape, 0.5, np.float32)
    depth[10, 20] = 0
    flow = expected_flow(depth, np.eye(4), CAMERA)
    assert np.isnan(flow[10, 20]).all()
    assert np.count_nonzero(np.isnan(flow)) == 2


def test_the_projective_map_of_pixels_moves_and_projects_points_as_drake_does() -> None:
    X = RigidTransform(RollPitchYaw(0.1, -0.05, 0.2), [0.1, 0.03, -0.02])
    K = np.array([[60.0, 0, 30.5], [0, 61.0, 24.25], [0, 0, 1]])
    for u, v, z in ((3.0, 40.0, 0.4), (50.5, 7.25, 1.7)):
        a, b, c = pixel_projection(X.GetAsMatrix4(), CAMERA) @ [u, v, 1.0, 1 / z]
        p_C1Q = X @ (z * np.linalg.inv(K) @ [u, v, 1.0])
        np.testing.assert_allclose([a / c, b / c], (K @ p_C1Q / p_C1Q[2])[:2], atol=1e-4)
        np.testing.assert_allclose(c * z, p_C1Q[2], rtol=1e-6)
