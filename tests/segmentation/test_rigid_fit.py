"""What a motion costs and how far it is set right, on a flat wall: in closed form."""

from dataclasses import replace

import numpy as np
import pytest

from riseg_drake.geometry.camera import Intrinsics, rays
from riseg_drake.geometry.rgbd import Frame, FramePair
from riseg_drake.geometry.se3 import translation
from riseg_drake.segmentation.alignment import (
    AlignmentParameters,
    EdgePixels,
    RigidFit,
    align_motions,
    edge_pixels,
    has_contrast,
    rigid_fit,
)
from riseg_drake.segmentation.noise import MeasurementNoise
from riseg_drake.segmentation.surface import surface_pixels

K = Intrinsics(64, 48, 60.0, 60.0, 31.5, 23.5)
"""Symmetric about its middle: turns of what fills it are told from shifts."""
INNER = np.s_[8:40, 8:56]
"""Gray values between pixels are known here, and a little beyond."""
VARIANCE, NOISE, Z = 9.0, 0.004, 0.8


def wall(seen=slice(None), alike=1.0, gray=100.0):
    """Every pixel of a wall at Z, of one gray value or of given ones [H, W]."""
    mask = np.zeros(K.shape, bool)
    mask[seen] = True
    surface = surface_pixels(mask, np.full(K.shape, Z, np.float32), K)
    v, u = surface.pixel
    every = np.ones(len(v), np.float32)
    return EdgePixels(
        surface,
        rays(K)[v, u].astype(float) * Z,
        np.zeros(len(v), np.intp),
        np.broadcast_to(np.float32(gray), K.shape)[v, u],
        np.float32(VARIANCE) * every,
        np.float32(alike) * every,
    )


def fit(gray=100.0, depth=Z):
    full = np.zeros(K.shape, np.float32)
    return RigidFit(np.eye(4), K, full + np.float32(gray), full + np.float32(depth), NOISE)


def test_the_cost_of_a_pixel_is_its_gray_values_and_its_depths_squared_residual():
    sigma = NOISE * Z**2
    cost = fit(gray=104.0, depth=Z + 2 * sigma).cost(wall(INNER), np.eye(4))
    assert cost == pytest.approx(np.full(48 * 32, 4.0**2 / VARIANCE + 4.0), rel=1e-4)


def test_each_residual_counts_for_nine_at_most():
    assert fit(gray=130.0).cost(wall(INNER), np.eye(4)) == pytest.approx(9.0, abs=1e-6)
    assert fit(depth=Z - 0.1).cost(wall(INNER), np.eye(4)) == pytest.approx(9.0, abs=1e-6)
    assert fit(gray=130.0, depth=Z + 0.1).cost(wall(INNER), np.eye(4)) == pytest.approx(18.0)


def test_what_has_no_depth_costs_what_is_to_be_expected_of_the_right_motion_and_what_is_hidden_twice_that():
    depth = np.full(K.shape, Z, np.float32)
    depth[:, :10] = 0
    gray = np.full(K.shape, 130.0, np.float32)
    gray[:, 20:] = np.nan
    cost = fit(gray, depth).cost(wall(INNER), np.eye(4)).reshape(32, 48)
    assert cost[0, [0, 1, 2, 10, 12, 40]] == pytest.approx([2, 2, 9, 9, 4, 4], abs=1e-6)


def test_a_motion_ahead_is_asked_at_the_depth_that_it_leads_to():
    # 3 % nearer: right for the wall that is now there, 6 sigma off for the one that was.
    X = translation(np.array([0.0, 0.0, -0.03 * Z]))
    assert fit(depth=0.97 * Z).cost(wall(INNER), X) == pytest.approx(0.0, abs=1e-3)
    off = (0.03 / (NOISE * 0.97**2 * Z)) ** 2
    assert fit().cost(wall(INNER), X) == pytest.approx(min(off, 9.0), rel=1e-3)


def test_a_ramp_of_gray_is_read_where_the_motion_leads():
    ramp = (2.0 * np.arange(64) + 50)[None] * np.ones((48, 1))
    X = translation(np.array([Z * 1.5 / K.fx, 0.0, 0.0]))  # 1.5 pixels to the right, along 2 gray levels each
    cost = fit(gray=ramp).cost(wall(np.s_[10:40, 10:40], gray=ramp), X)
    assert cost == pytest.approx(3.0**2 / VARIANCE, rel=1e-4)


@pytest.mark.parametrize(("rounds", "alike"), [(1, 1.0), (2, 1.0), (1, 6.0), (2, 6.0)])
@pytest.mark.parametrize("away", [1, -1])
def test_depth_of_one_gray_surface_moves_it_as_far_as_it_outweighs_what_was_known(rounds, alike, away):
    parameters = AlignmentParameters(rounds=rounds)
    edges = wall(np.s_[20:28, 28:36], alike)
    off = away * 0.1 * NOISE * Z**2
    found = fit(depth=Z + off).align(edges, np.eye(4), rounds, parameters)
    # 64 pixels of a tenth of a sigma, against 1.5 mm; shifted about its own middle a wall does not turn.
    known, told = 0.0015**-2.0, 64 / alike / (NOISE * Z**2) ** 2
    assert found[2, 3] == pytest.approx(off * told / (told + known), rel=0.01)
    np.testing.assert_allclose(found[:3, :3], np.eye(3), atol=1e-6)
    np.testing.assert_allclose(found[:2, 3], 0, atol=1e-6)


def test_a_slope_of_depth_turns_it_as_far_as_it_outweighs_what_was_known():
    slope = 0.002  # rad about -v: the wall's right side farther away
    x = rays(K)[..., 0].astype(float) * Z
    found = fit(depth=Z + slope * x).align(wall(), np.eye(4), 1, AlignmentParameters())
    told = (x**2).sum() / (NOISE * Z**2) ** 2
    assert np.arctan2(found[0, 2], found[2, 2]) == pytest.approx(-slope * told / (told + 0.03**-2.0), rel=0.02)


def test_of_a_pixel_that_is_wrong_by_the_outliers_size_a_half_counts():
    off = 2 * NOISE * Z**2
    known, told = 0.0015**-2.0, 64 / (NOISE * Z**2) ** 2
    edges = wall(np.s_[20:28, 28:36])
    found = fit(depth=Z + off).align(edges, np.eye(4), 1, AlignmentParameters(outlier=4.0))
    assert found[2, 3] == pytest.approx(off * told / 2 / (told / 2 + known), rel=0.01)


def frames(depth_1=Z, gray=100):
    X_WC = translation(np.array([0.1, 0.2, 0.3]))
    zero = np.zeros(K.shape)

    def frame(depth):
        color = np.broadcast_to(zero + gray, (3, *K.shape)).transpose(1, 2, 0).astype(np.uint8)
        return Frame(0, 0.0, K, color, (zero + depth).astype(np.float32), X_WC, zero > 0)

    return FramePair(frame(Z), frame(depth_1))


def test_the_difference_of_two_depths_errs_by_both():
    made = rigid_fit(frames(), 0.002)
    assert made.depth_noise == pytest.approx(0.002 * 2**0.5)
    np.testing.assert_allclose(made.X_C1C0, np.eye(4), atol=1e-12)


def test_a_pixel_with_a_gradient_of_more_than_the_noise_s_tells_where_it_is():
    noise = MeasurementNoise(color=3.0)
    assert has_contrast(np.array([8.9, 9.1], np.float32), noise).tolist() == [False, True]


def test_pixels_with_contrast_are_taken_and_every_fourth_of_the_others_along_both_axes():
    piece = np.full(K.shape, 2, np.intp)
    piece[:, 32:] = -1
    contrast = np.zeros(K.shape, bool)
    contrast[5, 3] = contrast[7, 40] = True  # of which one is of no piece
    variance = np.arange(64 * 48, dtype=np.float32).reshape(K.shape)
    taken = edge_pixels(frames().reference, piece, contrast, variance, 10_000)
    assert len(taken.piece) == 12 * 8 + 1
    v, u = taken.surface.pixel
    alone = (v == 5) & (u == 3)
    assert alone.sum() == 1
    # The noise of its depth is that of its neighbours, which are taken, too; on the grid each has its own.
    assert taken.alike.tolist() == np.where(alone, 6.0, 1.0).tolist()
    np.testing.assert_array_equal(taken.variance, variance[v, u])
    np.testing.assert_array_equal(taken.piece, 2)
    np.testing.assert_allclose(taken.p_C0Q[alone], [[(3 - 31.5) / 60 * Z, (5 - 23.5) / 60 * Z, Z]], rtol=1e-6)


def test_of_too_many_pixels_every_second_or_third_is_taken():
    piece, contrast = np.zeros(K.shape, np.intp), np.ones(K.shape, bool)
    variance = np.ones(K.shape, np.float32)
    for most, step in ((3072, 1), (3071, 2), (1536, 2), (1535, 3)):
        taken = edge_pixels(frames().reference, piece, contrast, variance, most)
        assert np.diff(taken.surface.index).tolist() == [step] * (len(taken.piece) - 1)


def test_a_motion_is_sharpened_by_the_pieces_that_it_explains_better_than_standing_still():
    # The left half came nearer by 4 cm, and one starts at 38 mm, or far from it.
    depth_1 = np.full(K.shape, Z)
    depth_1[:, :30] -= 0.04
    edges = wall()
    edges = replace(edges, piece=(edges.surface.pixel[1] >= 30).astype(np.intp))
    pair, parameters = frames(depth_1), AlignmentParameters(rounds=4)
    true, start = (translation(np.array([0, 0, -z])) for z in (0.04, 0.038))
    (found,) = align_motions(pair, edges, np.array([start]), NOISE, parameters)
    near = edges.p_C0Q[edges.piece == 0]
    z = near @ found[2, :3] + found[2, 3] - near[:, 2]
    assert z == pytest.approx(-0.04, abs=3e-4)
    # Two that end in one are one, in the order in which they began; one that nothing follows stays as it is.
    other = translation(np.array([0.05, 0.0, 0.0]))
    kept = align_motions(pair, edges, np.array([start, true, other]), NOISE, parameters)
    assert len(kept) == 2
    np.testing.assert_array_equal(kept[1], other)


def test_a_motion_of_fewer_pixels_than_it_takes_stays_as_it_is():
    for members_min, changed in ((64, True), (65, False)):
        parameters = AlignmentParameters(members_min=members_min)
        pair, edges = frames(Z - 0.04), wall(np.s_[20:28, 28:36])
        start = translation(np.array([0.0, 0.0, -0.039]))
        (found,) = align_motions(pair, edges, start[None], NOISE, parameters)
        assert np.array_equal(found, start) is not changed
