"""Body frame-invariant features: equal on one rigid body, whatever the frame, near the identity too."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.math import SpatialVelocity

from riseg_drake.geometry.se3 import exp_se3, move_points
from riseg_drake.segmentation.body_frames import BodyFrames
from riseg_drake.segmentation.grouping import mahalanobis_own, mahalanobis_sample
from riseg_drake.segmentation.twists import (
    change_space_frame,
    fit_motion,
    patch_twists,
    point_precision,
    spatial_twist,
    triplet_pose,
    triplet_twists,
)


def moved_frames(V: np.ndarray, rng: np.random.Generator, count: int = 30, points: int = 20) -> BodyFrames:
    """Frames of points within 2 cm, half a metre ahead, that move by the twist V in C0."""
    centres = rng.uniform([-0.1, -0.1, 0.4], [0.1, 0.1, 0.5], (count, 3))
    p_0 = centres[:, None] + rng.uniform(-0.01, 0.01, (count, points, 3))
    p_1 = move_points(exp_se3(V), p_0)
    pixel = np.zeros((count, 2), np.intp)
    ones = np.ones((count, points))
    return BodyFrames(pixel, p_0, p_1, p_1[..., 2], 0.2 * ones, ones > 0)


TWISTS = [
    np.array([0, 0, 0, 0.003, -0.001, 0]),
    np.array([0, 0, 0.05, 0.003, -0.001, 0]),
    np.array([0.02, -0.03, 0.04, 0.003, 0.01, -0.002]),
    np.array([1e-7, 0, 1e-7, 1e-8, 0, 0]),
    np.zeros(6),
]


def precision(frames: BodyFrames) -> np.ndarray:
    return point_precision(frames.p_C0Q0, frames.depth_1, frames.flow_sigma, 0.002, 600.0)


@pytest.mark.parametrize("V", TWISTS)
def test_all_triplets_on_one_body_have_its_twist(V: np.ndarray) -> None:
    frames = moved_frames(V, np.random.default_rng(0), points=3)
    twists = triplet_twists(frames, np.zeros(3))
    np.testing.assert_allclose(twists.V_S, np.broadcast_to(V, (30, 6)), atol=1e-9)


@pytest.mark.parametrize("count", [3, 5, 30])
def test_triplets_fewer_than_six_dimensions_need_have_distances_by_their_sample(count: int) -> None:
    rng = np.random.default_rng(3)
    frames = moved_frames(TWISTS[2], rng, count, points=3)
    noisy = replace(frames, p_C0Q1=frames.p_C0Q1 + rng.normal(0, 1e-4, frames.p_C0Q1.shape))
    twists = triplet_twists(noisy, np.zeros(3))
    # Each of a pair has the sample's covariance: the pair's difference has it twice.
    own = mahalanobis_own(twists.V_S, twists.covariance)
    np.testing.assert_allclose(np.sqrt(2) * own, mahalanobis_sample(twists.V_S), rtol=1e-2, atol=1e-6)


def test_triplets_that_move_alike_to_the_last_digit_are_no_distance_apart() -> None:
    twists = triplet_twists(moved_frames(np.zeros(6), np.random.default_rng(4), 5, points=3), np.zeros(3))
    np.testing.assert_allclose(mahalanobis_own(twists.V_S, twists.covariance), 0, atol=1e-3)


@pytest.mark.parametrize("V", TWISTS)
def test_all_patches_on_one_body_have_its_twist(V: np.ndarray) -> None:
    frames = moved_frames(V, np.random.default_rng(1))
    twists = patch_twists(frames, np.zeros(3), precision(frames))
    np.testing.assert_allclose(twists.V_S, np.broadcast_to(V, (30, 6)), atol=1e-8)


@pytest.mark.parametrize("kind", [triplet_twists, patch_twists])
def test_another_space_frame_shows_the_same_motion(kind) -> None:
    V = TWISTS[2]
    p_C0S = np.array([0.05, -0.02, 0.45])
    frames = moved_frames(V, np.random.default_rng(2), points=3 if kind is triplet_twists else 20)
    arguments = () if kind is triplet_twists else (precision(frames),)
    twists = kind(frames, p_C0S, *arguments)
    p_SQ = np.array([[0.01, 0.02, 0.03]])
    moved_in_S = move_points(exp_se3(twists.V_S[0]), p_SQ)
    moved_in_C0 = move_points(exp_se3(V), p_SQ + p_C0S) - p_C0S
    np.testing.assert_allclose(moved_in_S, moved_in_C0, atol=1e-9)


def test_a_small_spatial_twist_is_drakes_spatial_velocity_times_the_step() -> None:
    # A body turns and moves; its frame B is far from the space frame S.
    w, v_B, dt = np.array([0.3, -0.2, 0.5]), np.array([0.1, 0.05, -0.02]), 1e-6
    X_SB = RigidTransform(RollPitchYaw(0.3, 0.2, 0.1), [0.4, -0.3, 0.2])
    turned = RigidTransform(RollPitchYaw(w * dt), X_SB.translation() + v_B * dt)
    after = RigidTransform(turned.rotation() @ X_SB.rotation(), turned.translation())
    V_S = spatial_twist(X_SB.GetAsMatrix4(), after.GetAsMatrix4()) / dt
    at_S = SpatialVelocity(w, v_B).Shift(-X_SB.translation())
    np.testing.assert_allclose(V_S, at_S.get_coeffs(), atol=1e-5)


def test_the_papers_axes_are_a_rotation_with_x_across_the_triplet() -> None:
    p = np.random.default_rng(3).normal(size=(3, 10, 3))
    T = triplet_pose(*p)
    np.testing.assert_allclose(
        T[:, :3, :3] @ T[:, :3, :3].swapaxes(1, 2), np.tile(np.eye(3), (10, 1, 1)), atol=1e-12
    )
    np.testing.assert_allclose(np.linalg.det(T[:, :3, :3]), 1.0)
    for side in (p[1] - p[0], p[2] - p[0]):
        np.testing.assert_allclose(np.einsum("ki,ki->k", T[:, :3, 0], side), 0, atol=1e-12)


def test_the_propagated_covariance_is_what_repeated_noise_scatters() -> None:
    rng = np.random.default_rng(4)
    flow_noise, depth_noise, focal_length = 0.3, 0.002, 600.0
    frames = moved_frames(np.zeros(6), rng, count=1)
    q_0 = np.repeat(frames.p_C0Q0, 2000, axis=0)
    z = q_0[..., 2]
    noise = rng.normal(size=q_0.shape) * (z * flow_noise / focal_length)[..., None]
    noise[..., 2] = rng.normal(size=z.shape) * np.sqrt(2) * depth_noise * z**2
    W = point_precision(q_0, z, np.full(z.shape, flow_noise), depth_noise, focal_length)
    centre = q_0.mean(axis=(0, 1))
    V, covariance, misfit = fit_motion(q_0 - centre, q_0 + noise - centre, W, np.ones(z.shape, bool))
    # Robust weights give away some of the information, so the claim is a little cautious.
    claimed, seen = np.sqrt(np.diag(covariance.mean(0))), np.sqrt(np.diag(np.cov(V.T)))
    assert (claimed > 0.95 * seen).all()
    assert (claimed < 1.3 * seen).all()
    assert 0.7 < misfit.mean() < 1.1


def test_a_few_points_of_another_body_hardly_move_the_fit() -> None:
    V = TWISTS[1]
    frames = moved_frames(V, np.random.default_rng(5), count=10)
    frames.p_C0Q1[:, :4] += 0.02
    undisturbed = moved_frames(V, np.random.default_rng(5), count=10)
    twists, clean = (patch_twists(f, np.array([0, 0, 0.45]), precision(f)) for f in (frames, undisturbed))
    assert np.abs(twists.V_S - clean.V_S)[:, 3:].max() < 0.002
    assert (twists.misfit > 5 * clean.misfit).all()


def test_changing_the_space_frame_there_and_back_changes_nothing() -> None:
    rng = np.random.default_rng(6)
    V, p = rng.normal(size=(4, 6)), rng.normal(size=(4, 3))
    A = rng.normal(size=(4, 6, 6))
    covariance = A @ A.swapaxes(1, 2)
    V_there, cov_there = change_space_frame(V, covariance, p)
    V_back, cov_back = change_space_frame(V_there, cov_there, -p)
    np.testing.assert_allclose(V_back, V, atol=1e-12)
    np.testing.assert_allclose(cov_back, covariance, atol=1e-10)
