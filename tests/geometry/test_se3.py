"""Rigid motions and twists against Drake's own, and at the corners of their formulas."""

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.math import SpatialVelocity
from scipy.linalg import expm

from riseg_drake.geometry.se3 import (
    adjoint,
    exp_se3,
    inverse,
    log_se3,
    move_points,
    skew,
    translation,
)


def random_pose(rng: np.random.Generator) -> RigidTransform:
    return RigidTransform(RollPitchYaw(rng.uniform(-1, 1, 3)), rng.uniform(-1, 1, 3))


def test_skew_is_the_cross_product() -> None:
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=(2, 5, 3))
    np.testing.assert_allclose(np.einsum("kij,kj->ki", skew(a), b), np.cross(a, b), atol=1e-15)


@pytest.mark.parametrize("angle", [0.0, 1e-9, 0.9e-4, 1.1e-4, 0.1, 1.5, 3.0])
def test_exp_agrees_with_the_matrix_exponential(angle: float) -> None:
    rng = np.random.default_rng(1)
    axis = rng.normal(size=3)
    V = np.concatenate([angle * axis / np.linalg.norm(axis), rng.normal(size=3)])
    generator = np.zeros((4, 4))
    generator[:3, :3], generator[:3, 3] = skew(V[:3]), V[3:]
    np.testing.assert_allclose(exp_se3(V), expm(generator), atol=1e-12)


@pytest.mark.parametrize("angle", [0.0, 1e-9, 0.9e-4, 1.1e-4, 0.1, 1.5, 3.0])
def test_log_undoes_exp(angle: float) -> None:
    rng = np.random.default_rng(2)
    axes = rng.normal(size=(20, 3))
    omega = angle * axes / np.linalg.norm(axes, axis=1, keepdims=True)
    V = np.concatenate([omega, rng.normal(size=(20, 3))], axis=1)
    np.testing.assert_allclose(log_se3(exp_se3(V)), V, atol=1e-9)


def test_near_no_rotation_log_has_the_next_term_of_its_series_too() -> None:
    # Without it, or with another divisor, a rotation of 0.9e-4 is wrong by more than 1e-10 of itself.
    V = np.array([0.9e-4, 0.0, 0.0, 1.0, 2.0, 3.0])
    np.testing.assert_allclose(log_se3(exp_se3(V))[0], V[0], rtol=3e-11)


def test_inverse_and_moved_points_agree_with_drake() -> None:
    rng = np.random.default_rng(3)
    X_AB = random_pose(rng)
    p_BQ = rng.normal(size=(7, 3))
    np.testing.assert_allclose(inverse(X_AB.GetAsMatrix4()), X_AB.inverse().GetAsMatrix4(), atol=1e-14)
    np.testing.assert_allclose(move_points(X_AB.GetAsMatrix4(), p_BQ), X_AB.multiply(p_BQ.T).T, atol=1e-14)


def test_adjoint_shifts_and_turns_twists_as_drake_shifts_spatial_velocities() -> None:
    rng = np.random.default_rng(4)
    X_AB = random_pose(rng)
    V_B = rng.normal(size=6)
    R = X_AB.rotation()
    # The velocity of the body's point that coincides with B, in A's axes, shifted to A's origin.
    at_B = SpatialVelocity(R.multiply(V_B[:3]), R.multiply(V_B[3:]))
    at_A = at_B.Shift(-X_AB.translation())
    np.testing.assert_allclose(adjoint(X_AB.GetAsMatrix4()) @ V_B, at_A.get_coeffs(), atol=1e-14)


def test_translation_moves_by_its_vector() -> None:
    p = np.array([[1.0, 2.0, 3.0], [0.0, 0.0, 0.0]])
    np.testing.assert_array_equal(translation(p)[:, :3, 3], p)
    np.testing.assert_array_equal(translation(p)[1], np.eye(4))
