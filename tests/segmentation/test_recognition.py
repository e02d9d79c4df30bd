"""Motions of what is recognised, on drawn boxes, and of matches made by hand."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from riseg_drake.geometry.se3 import exp_se3, move_points
from riseg_drake.segmentation import recognition
from riseg_drake.segmentation.comparison import Comparison
from riseg_drake.segmentation.recognition import RecognitionParameters, recognised_motions
from tests.segmentation.drawn_scene import (
    Blank,
    DrawnScene,
    Texture,
    first_compared,
    flow_error,
    looking_down,
    motion_seen_from,
    planar,
)

SIZES = [(0.08, 0.07, 0.05), (0.07, 0.08, 0.05)]
PLACES = [planar(-0.07, 0.0), planar(0.06, 0.0)]


def fallen(place: np.ndarray, tilt: float, turn: float) -> np.ndarray:
    """X_WB of a box that was tilted about x and turned about z, rad, and lifted by 3 cm."""
    turned = np.eye(4)
    turned[:3, :3] = Rotation.from_euler("xz", [tilt, turn]).as_matrix()
    moved = place @ turned
    moved[2, 3] += 0.03
    return moved


def seen(poses: list[np.ndarray], textures: list | None = None, X_WC1: np.ndarray | None = None):
    """The boxes at their places and then at some poses: compared, and where something stands then."""
    views = (looking_down(), looking_down() if X_WC1 is None else X_WC1)
    scene = DrawnScene(SIZES, textures=textures or [Texture(1), Texture(2)])
    pair, label, label_1 = scene.pair(views, (PLACES, poses), np.random.default_rng(0))
    return first_compared(pair, label)[1], label, label_1 > 0


def error(compared: Comparison, label: np.ndarray, k: int, pose: np.ndarray, motion: np.ndarray) -> float:
    """Pixels by which a motion is wrong on a box."""
    return flow_error(compared, label == k + 1, motion, motion_seen_from(looking_down(), PLACES[k], pose))


@pytest.mark.renders
@pytest.mark.parametrize("turn", [0.0, np.pi / 2, np.pi])
def test_what_was_tilted_and_turned_far_is_recognised(turn):
    poses = [PLACES[0], fallen(planar(0.05, 0.09), 0.35, turn)]
    compared, label, above = seen(poses)
    motions = recognised_motions(compared, above, RecognitionParameters())
    assert len(motions) == 1
    assert error(compared, label, 1, poses[1], motions[0]) < 1.0


@pytest.mark.renders
def test_each_of_two_that_moved_is_recognised_and_from_another_view():
    poses = [planar(-0.1, -0.06, 1.0), planar(0.08, 0.05, -2.0)]
    compared, label, above = seen(poses, X_WC1=looking_down(0.03))
    motions = recognised_motions(compared, above, RecognitionParameters())
    assert len(motions) == 2
    for k, pose in enumerate(poses):
        assert min(error(compared, label, k, pose, X) for X in motions) < 1.0
    assert len(recognised_motions(compared, above, RecognitionParameters(most=1))) == 1


@pytest.mark.renders
def test_of_what_stands_still_or_is_blank_or_is_hidden_nothing_is_recognised():
    compared, _, above = seen(PLACES)
    assert recognised_motions(compared, above, RecognitionParameters()).shape == (0, 4, 4)
    moved = [PLACES[0], planar(0.08, 0.05, 0.5)]
    compared, _, above = seen(moved, [Blank(90.0), Blank(120.0)])
    assert recognised_motions(compared, above, RecognitionParameters()).shape == (0, 4, 4)
    compared, _, above = seen(moved)
    nowhere = np.zeros_like(above)
    assert recognised_motions(compared, nowhere, RecognitionParameters()).shape == (0, 4, 4)


def test_matches_that_agree_with_one_motion_are_found_among_as_many_wrong_ones():
    rng = np.random.default_rng(0)
    before, X = 0.05 * rng.normal(size=(80, 3)), exp_se3(np.array([0.5, -0.3, 1.5, 0.02, 0.1, -0.05]))
    after = move_points(X, before) + 0.0005 * rng.normal(size=(80, 3))
    wrong = rng.random(80) < 0.5
    after[wrong] += 0.1 * rng.normal(size=(wrong.sum(), 3))
    agrees = recognition._largest_agreement(before, after, 0.004, rng)
    assert np.count_nonzero(agrees & wrong) <= 1
    assert np.count_nonzero(agrees & ~wrong) >= 0.9 * np.count_nonzero(~wrong)


def test_points_are_fitted_as_scipy_fits_them_without_mirroring_what_is_flat():
    rng = np.random.default_rng(1)
    for spread in ([1.0, 1.0, 1.0], [1.0, 1.0, 0.0]):
        before = rng.normal(size=(5, 8, 3)) * spread
        after = before @ Rotation.random(random_state=2).as_matrix().T + [0.1, -0.2, 0.3]
        after += 0.1 * rng.normal(size=after.shape)
        for X, a, b in zip(recognition._rigid(before, after), before, after, strict=True):
            expected, _ = Rotation.align_vectors(b - b.mean(0), a - a.mean(0))
            np.testing.assert_allclose(X[:3, :3], expected.as_matrix(), atol=1e-9)
            np.testing.assert_allclose(X[:3, :3] @ a.mean(0) + X[:3, 3], b.mean(0), atol=1e-12)
