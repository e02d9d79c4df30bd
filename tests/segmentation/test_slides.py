"""Slides and turns on a plane, and what they cost in images that are known."""

from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from riseg_drake.geometry.camera import Intrinsics, rays
from riseg_drake.segmentation.slides import SlideCosts, slides

CAMERA = Intrinsics(80, 60, 100.0, 110.0, 40.0, 30.0)
V, U = np.mgrid[:60, :80]
NORMAL = np.array([0.2, -0.3, -0.9])
CENTRE = np.array([0.05, 0.02, 0.6])


def test_no_amount_is_no_motion_whatever_the_normal_s_length():
    np.testing.assert_allclose(slides(3 * NORMAL, CENTRE, np.zeros((2, 3))), [np.eye(4)] * 2, atol=1e-15)


def test_a_turn_is_about_the_normal_through_the_centre():
    (X,) = slides(NORMAL, CENTRE, np.array([[0.0, 0.0, 0.3]]))
    expected = Rotation.from_rotvec(0.3 * NORMAL / np.linalg.norm(NORMAL)).as_matrix()
    np.testing.assert_allclose(X[:3, :3], expected, atol=1e-12)
    np.testing.assert_allclose(X[:3, :3] @ CENTRE + X[:3, 3], CENTRE, atol=1e-12)


def test_shifts_are_by_their_amounts_along_two_perpendicular_directions_of_the_plane():
    first, second = (slides(NORMAL, CENTRE, np.array([a]))[0, :3, 3] for a in ([0.02, 0, 0], [0, 0.03, 0]))
    assert np.linalg.norm(first) == pytest.approx(0.02)
    assert np.linalg.norm(second) == pytest.approx(0.03)
    assert [first @ second, first @ NORMAL, second @ NORMAL] == pytest.approx([0, 0, 0], abs=1e-12)
    # They make a frame with the normal, so that none is counted backwards.
    assert np.cross(first, second) @ NORMAL > 0


def test_a_turn_with_a_shift_takes_the_centre_by_the_shift_alone():
    (X,) = slides(NORMAL, CENTRE, np.array([[0.02, -0.01, 0.4]]))
    shift = slides(NORMAL, CENTRE, np.array([[0.02, -0.01, 0.0]]))[0, :3, 3]
    np.testing.assert_allclose(X[:3, :3] @ CENTRE + X[:3, 3], CENTRE + shift, atol=1e-12)


def costs(gray_1: np.ndarray, depth_1: np.ndarray, standing: np.ndarray | None = None) -> SlideCosts:
    """Of a keyframe with a ramp of gray at 0.5 m, and a frame seen from the same place."""
    compared = SimpleNamespace(
        keyframe=SimpleNamespace(frame=SimpleNamespace(gray=(2.0 * U).astype(np.float32))),
        frame=SimpleNamespace(
            gray=gray_1.astype(np.float32), unhidden_depth=depth_1.astype(np.float32), intrinsics=CAMERA
        ),
        X_C1K=np.eye(4),
        depth_noise=0.002,
    )
    standing = np.zeros(gray_1.shape, bool) if standing is None else standing
    return SlideCosts(compared, standing, blur=1.0, residual_max=25.0)


def points(z: float = 0.5) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    v, u = (grid[20:40, 30:50].ravel() for grid in (V, U))
    return rays(CAMERA)[v, u] * z, v, u


def shifted(x: float, z: float = 0.0) -> np.ndarray:
    X = np.eye(4)
    X[0, 3], X[2, 3] = x, z
    return X


FLAT = np.full((60, 80), 0.5)
# Of a ramp of 2 gray levels a pixel, blurred by a pixel: half a pixel's worth, beside 8 of noise.
VARIANCE = 8 + (0.5 * 1.0 * 2.0) ** 2


def test_what_has_not_moved_costs_nothing():
    assert costs(2.0 * U, FLAT).of(*points(), np.eye(4)[None]) == pytest.approx([0], abs=1e-6)


def test_gray_costs_its_squared_difference_over_what_a_blurred_step_may_bring():
    assert costs(2.0 * U + 3.0, FLAT).of(*points(), np.eye(4)[None]) == pytest.approx([9 / VARIANCE], rel=1e-4)


def test_a_motion_is_judged_where_it_takes_the_points():
    # 5 mm at 0.5 m are a pixel along u, where the frame is brighter by 2.
    motions = np.array([np.eye(4), shifted(0.005)])
    assert costs(2.0 * (U - 1), FLAT).of(*points(), motions) == pytest.approx([4 / VARIANCE, 0], abs=1e-4)


def test_depth_costs_its_squared_difference_over_that_of_two_noisy_depths():
    # One has 2 mm at 1 m, growing with depth squared: 0.5 mm here. That of two is taken twice.
    moved = costs(2.0 * U, FLAT + 0.001).of(*points(), np.eye(4)[None])
    assert moved == pytest.approx([(0.001 / (2 * np.sqrt(2) * 0.002 * 0.25)) ** 2], rel=1e-3)
    assert costs(2.0 * U, FLAT + 0.001).of(*points(), shifted(0.0, 0.001)[None])[0] < 0.1 * moved[0]


def test_what_differs_much_counts_as_the_most_and_what_has_no_depth_as_what_is_expected():
    assert costs(2.0 * U + 200, FLAT + 0.1).of(*points(), np.eye(4)[None]) == pytest.approx([50])
    assert costs(2.0 * U, 0 * FLAT).of(*points(), np.eye(4)[None]) == pytest.approx([1])


def test_what_leaves_the_image_meets_black_without_depth():
    far = costs(2.0 * U, FLAT).of(*points(), shifted(5.0)[None])
    gray_0 = cv2.GaussianBlur((2.0 * U).astype(np.float32), (0, 0), 1.0)[20:40, 30:50]
    assert far == pytest.approx([np.minimum(gray_0**2 / VARIANCE, 25).mean() + 1], rel=1e-4)


def test_free_points_cost_the_most_for_the_share_of_them_that_meets_what_stands():
    standing = (U >= 40) & (U < 80)
    p_KQ, _, _ = points()
    taken = costs(2.0 * U, FLAT, standing).taken(p_KQ, np.array([np.eye(4), shifted(0.05), shifted(-0.05)]))
    assert taken == pytest.approx([12.5, 25, 0])


def test_many_motions_at_once_cost_what_each_costs_alone():
    motions = slides(
        np.array([0, 0, -1.0]), points()[0].mean(0), np.random.default_rng(0).normal(0, 0.01, (600, 3))
    )
    every = costs(2.0 * U, FLAT)
    together = every.of(*points(), motions)
    assert together[[0, 299, 599]] == pytest.approx(
        [every.of(*points(), motions[i : i + 1])[0] for i in (0, 299, 599)], rel=1e-4
    )
