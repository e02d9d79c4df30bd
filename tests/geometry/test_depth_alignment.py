"""Depth carried from one camera to another, against planes whose depth in both is known in closed form."""

import numpy as np
import pytest

from riseg_drake.geometry.camera import Intrinsics, rays
from riseg_drake.geometry.depth_alignment import align_depth
from riseg_drake.geometry.lens import Lens, grid_rays
from riseg_drake.geometry.se3 import exp_se3, inverse, translation

D = Intrinsics(160, 120, 150.0, 150.0, 79.5, 59.5)
FINER = Intrinsics(320, 240, 310.0, 310.0, 159.5, 119.5)
SIDEWAYS = translation(np.array([0.05, 0.0, 0.0]))


def test_a_camera_aligned_with_itself_keeps_its_image_bit_for_bit():
    depth = np.random.default_rng(0).uniform(0.3, 3.0, D.shape).astype(np.float32)
    depth[10:20, 5:50] = 0
    np.testing.assert_array_equal(align_depth(depth, Lens(D), np.eye(4), D), depth)


@pytest.mark.parametrize("lens", [Lens(D), Lens(D, (0.12, -0.25, 0.001, -0.002, 0.1))])
@pytest.mark.parametrize("turn", [0.0, 0.05])
def test_a_slanted_plane_has_its_own_depth_in_a_finer_camera_and_no_holes(lens, turn):
    X_CD = SIDEWAYS @ exp_se3(np.array([0.0, turn, 0.02, 0.0, 0.0, 0.0]))
    n_C, d = np.array([0.2, -0.3, 1.0]), 0.8  # n . p = d
    n_D, d_D = X_CD[:3, :3].T @ n_C, d - n_C @ X_CD[:3, 3]
    depth = (d_D / (grid_rays(lens, 0.0, 0.0) @ n_D)).astype(np.float32)
    aligned = align_depth(depth, lens, X_CD, FINER)
    expected = d / (rays(FINER).astype(float) @ n_C)
    inner = (slice(40, -40), slice(70, -60))
    assert (aligned[inner] > 0).all()
    # A pixel's square stands at its centre's depth: off by the plane's slope over one pixel of D at most.
    assert np.abs(aligned[inner] - expected[inner]).max() < 0.8 * np.linalg.norm([0.2, 0.3]) / 150 * 2
    assert abs(np.mean(aligned[inner] - expected[inner])) < 2e-4


def test_the_nearer_surface_hides_the_other_and_what_it_hid_from_the_depth_camera_has_no_depth():
    """A pole at 0.5 m before a wall at 1 m; f b / z is 15 px for the pole and 7.5 px for the wall."""
    depth = np.full(D.shape, 1.0, np.float32)
    depth[:, 60:80] = 0.5
    row = align_depth(depth, Lens(D), SIDEWAYS, D)[60]
    np.testing.assert_array_equal(np.flatnonzero(row == 0.5), np.arange(75, 95))
    # The wall goes on from column 79.5 + 7.5 on, and up to 59.5 + 7.5: its shadow lies behind the pole's left.
    np.testing.assert_array_equal(np.flatnonzero(row == 0), [*range(7), *range(68, 75)])
    np.testing.assert_array_equal(np.unique(row), np.float32([0, 0.5, 1]))


def test_there_and_back_is_the_same_plane():
    depth = np.full(D.shape, 0.7, np.float32)
    back = align_depth(align_depth(depth, Lens(D), SIDEWAYS, D), Lens(D), inverse(SIDEWAYS), D)
    np.testing.assert_allclose(back[:, 12:-12], 0.7, atol=1e-6)


def test_points_behind_the_camera_and_images_without_depth_give_nothing():
    behind = translation(np.array([0.0, 0.0, -2.0]))
    assert not align_depth(np.full(D.shape, 1.0, np.float32), Lens(D), behind, D).any()
    assert not align_depth(np.zeros(D.shape, np.float32), Lens(D), np.eye(4), D).any()
