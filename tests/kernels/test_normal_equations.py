"""The kernel beside derivatives by finite differences, and residuals that are known."""

import numpy as np
import pytest

from riseg_drake.geometry.camera import Intrinsics, rays
from riseg_drake.geometry.se3 import exp_se3, inverse, move_points, translation
from riseg_drake.kernels.normal_equations import normal_equations
from riseg_drake.segmentation.expected_flow import pixel_projection

INTRINSICS = Intrinsics(160, 120, 150.0, 152.0, 79.5, 59.5)
X_C1C0 = inverse(exp_se3(np.array([0.02, -0.03, 0.05, 0.01, -0.02, 0.03])))
X = exp_se3(np.array([0.01, 0.02, -0.03, 0.004, 0.003, -0.002]))
CENTRE = np.array([0.01, -0.02, 0.5])
DEPTH_NOISE, OUTLIER = 0.003, 4.0


class Views:
    """Some pixels of C0 and what they find in C1: smooth in gray value, and a plane in depth."""

    def __init__(self, seed: int = 0):
        rng = np.random.default_rng(seed)
        u, v = rng.integers(30, 130, 50), rng.integers(30, 90, 50)
        self.depth = rng.uniform(0.45, 0.55, 50).astype(np.float32)
        self.pixel = np.stack([u, v, np.ones(50), 1 / self.depth]).astype(np.float32)
        self.p_C0Q = rays(INTRINSICS)[v, u] * self.depth[:, None].astype(float)
        self.gray = rng.uniform(90, 110, 50).astype(np.float32)
        self.variance = rng.uniform(4, 9, 50).astype(np.float32)
        self.alike = rng.choice([1, 6], 50).astype(np.float32)
        i, j = np.mgrid[:120, :160].astype(np.float32)
        self.gray_1 = np.float32(2.0) * j - np.float32(1.5) * i + np.float32(50)
        self.depth_1 = np.full((120, 160), 0.5, np.float32)

    def equations(self, X):
        return normal_equations(
            self.pixel, self.p_C0Q, self.gray, self.variance, self.alike,
            pixel_projection(X_C1C0 @ X, INTRINSICS), X, X_C1C0, CENTRE, (INTRINSICS.fx, INTRINSICS.fy),
            self.gray_1, self.depth_1, DEPTH_NOISE, OUTLIER,
        )  # fmt: skip

    def residuals(self, X):
        """Of gray value and depth, [2, 50], by closed forms."""
        p_C1Q = move_points(X_C1C0 @ X, self.p_C0Q)
        x, y, z = p_C1Q.T
        u, v = INTRINSICS.fx * x / z + INTRINSICS.cx, INTRINSICS.fy * y / z + INTRINSICS.cy
        gray = (2.0 * u - 1.5 * v + 50 - self.gray) / np.sqrt(self.variance)
        return np.stack([gray, (0.5 - z) / (DEPTH_NOISE * z**2)])


def twisted(V):
    return translation(CENTRE) @ exp_se3(V) @ translation(-CENTRE) @ X


def test_they_are_those_of_finite_differences():
    views, step = Views(), 1e-6
    r = views.residuals(X)
    J = np.stack(
        [
            (views.residuals(twisted(step * e)) - views.residuals(twisted(-step * e))) / (2 * step)
            for e in np.eye(6)
        ],
        axis=-1,
    )
    # How sure depth is does not change where a point is nearly as far: that is left out of its derivative.
    z = move_points(X_C1C0 @ X, views.p_C0Q)[:, 2]
    J[1] /= (1 + 2 * (0.5 - z) / z)[:, None]
    weight = 1 / (1 + r**2 / OUTLIER) / np.stack([np.ones(50), views.alike])
    normal, rhs = views.equations(X)
    np.testing.assert_allclose(normal, np.einsum("kn,kni,knj->ij", weight, J, J), rtol=2e-3)
    np.testing.assert_allclose(rhs, -np.einsum("kn,kni->i", weight * r, J), rtol=2e-3)


def test_what_is_not_known_tells_nothing():
    views = Views()
    views.depth_1[:] = 0
    views.gray_1[:] = np.nan
    for each in views.equations(X):
        np.testing.assert_array_equal(each, 0)


@pytest.mark.parametrize("part", ["gray", "depth"])
def test_each_half_stands_alone(part):
    whole, gray, depth = Views(), Views(), Views()
    gray.depth_1[:] = 0
    depth.gray_1[:] = np.nan
    for k in range(2):
        np.testing.assert_allclose(
            whole.equations(X)[k], gray.equations(X)[k] + depth.equations(X)[k], rtol=1e-9
        )


def test_a_point_behind_the_camera_tells_nothing():
    views = Views()
    behind = exp_se3(np.array([0, 0, 0, 0, 0, -2.0]))
    for each in views.equations(behind):
        np.testing.assert_array_equal(each, 0)
