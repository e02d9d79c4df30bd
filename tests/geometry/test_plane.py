"""Heights above a plane against closed forms."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from riseg_drake.geometry.camera import back_project
from riseg_drake.geometry.plane import heights_above_plane, transform_plane
from tests.geometry.planes import CAMERA, tilted_plane


def test_heights_equal_those_of_back_projected_points() -> None:
    plane_C = tilted_plane(0.4, 0.6)
    rng = np.random.default_rng(0)
    depth = rng.uniform(0.3, 0.7, CAMERA.shape).astype(np.float32)
    depth[0, :50] = 0
    height = heights_above_plane(depth, CAMERA, plane_C)
    expected = back_project(depth, CAMERA).astype(float) @ plane_C[:3] + plane_C[3]
    assert height.dtype == np.float32
    assert np.isnan(height[0, :50]).all()
    np.testing.assert_allclose(height[1:], expected[1:], atol=1e-6)


def test_height_of_a_point_does_not_depend_on_the_frame_it_is_measured_in() -> None:
    X_WC = np.eye(4)
    X_WC[:3, :3] = Rotation.from_rotvec([2.8, 0.3, 0.1]).as_matrix()
    X_WC[:3, 3] = [0.5, 0.1, 0.6]
    plane_C = tilted_plane(0.2, 0.5)
    p_CQ = np.array([0.1, -0.05, 0.45])
    p_WQ = X_WC[:3, :3] @ p_CQ + X_WC[:3, 3]
    plane_W = transform_plane(X_WC, plane_C)
    assert plane_W[:3] @ p_WQ + plane_W[3] == pytest.approx(plane_C[:3] @ p_CQ + plane_C[3])
