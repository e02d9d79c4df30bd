"""The motions that groups of body frames share, from points moved by known ones."""

import numpy as np
import pytest

from riseg_drake.geometry.se3 import exp_se3, inverse, log_se3, move_points, translation
from riseg_drake.segmentation.body_frames import BodyFrames
from riseg_drake.segmentation.motions import (
    MotionParameters,
    flow_difference,
    group_motions,
    merge_equal_motions,
)
from riseg_drake.segmentation.twists import point_precision

FOCAL_LENGTH, DEPTH_NOISE, FLOW_NOISE = 600.0, 0.002, 0.2
CENTRE = np.array([0.02, -0.01, 0.42])


def about_centre(omega: float, x: float, y: float) -> np.ndarray:
    """The motion of a body that turns about C0's z axis through CENTRE and shifts."""
    X = translation(CENTRE) @ exp_se3(np.array([0, 0, omega, 0, 0, 0])) @ translation(-CENTRE)
    return translation(np.array([x, y, 0.0])) @ X


def precision(frames: BodyFrames) -> np.ndarray:
    return point_precision(frames.p_C0Q0, frames.depth_1, frames.flow_sigma, DEPTH_NOISE, FOCAL_LENGTH)


def moved_frames(
    motions: list[np.ndarray], rng: np.random.Generator, count: int = 25, noisy: bool = True
) -> tuple[BodyFrames, np.ndarray]:
    """`count` frames for each motion, within 5 cm of CENTRE, with flow and depth noise; and their groups."""
    group = np.repeat(np.arange(len(motions)), count)
    seed = CENTRE + rng.uniform(-0.05, 0.05, (len(group), 1, 3)) * [1, 1, 0.4]
    p_0 = seed + rng.uniform(-0.01, 0.01, (len(group), 21, 3))
    p_0[:, 0] = seed[:, 0]
    p_1 = np.stack([move_points(motions[g], p) for g, p in zip(group, p_0, strict=True)])
    z = p_1[..., 2:]
    if noisy:
        across = rng.normal(size=p_1.shape) * [1, 1, 0] * z * FLOW_NOISE / FOCAL_LENGTH
        along = p_1 / z * rng.normal(size=z.shape) * np.sqrt(2) * DEPTH_NOISE * z**2
        p_1 = p_1 + across + along
    ones = np.ones(p_0.shape[:2])
    pixel = np.zeros((len(group), 2), np.intp)
    return BodyFrames(pixel, p_0, p_1, p_1[..., 2], FLOW_NOISE * ones, ones > 0), group


@pytest.mark.parametrize(
    "X", [about_centre(0.0, 0.004, -0.003), about_centre(0.1, 0.0, 0.0), about_centre(-0.05, 0.01, 0.004)]
)
def test_a_groups_motion_is_found_in_noisy_points(X: np.ndarray) -> None:
    frames, group = moved_frames([X], np.random.default_rng(0))
    (found,) = group_motions(frames, group, precision(frames))
    assert np.linalg.norm(log_se3(inverse(X) @ found)[:3]) < np.deg2rad(1)
    assert np.linalg.norm(move_points(found, CENTRE) - move_points(X, CENTRE)) < 5e-4


def test_each_group_gets_its_own_motion_and_frames_of_none_count_for_none() -> None:
    truth = [about_centre(0.1, 0.0, 0.0), about_centre(0.0, 0.005, 0.0), about_centre(0.0, -0.05, 0.05)]
    frames, group = moved_frames(truth, np.random.default_rng(1), noisy=False)
    group[group == 2] = -1
    np.testing.assert_allclose(group_motions(frames, group, precision(frames)), truth[:2], atol=1e-7)


def test_no_groups_have_no_motions() -> None:
    frames, _ = moved_frames([np.eye(4)], np.random.default_rng(2), count=4)
    assert group_motions(frames, np.full(4, -1), precision(frames)).shape == (0, 4, 4)


def merged(motions: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """The groups before and after merging frames that move so."""
    frames, group = moved_frames(motions, np.random.default_rng(3), noisy=False)
    fitted = group_motions(frames, group, precision(frames))
    return group, merge_equal_motions(frames, group, fitted, FOCAL_LENGTH, MotionParameters())


def test_equal_motions_are_one_group() -> None:
    # A twentieth of a millimetre at this distance is seven hundredths of a pixel.
    _, after = merged([about_centre(0.05, 0.004, 0), about_centre(0.05, 0.00405, 0)])
    np.testing.assert_array_equal(after, 0)


@pytest.mark.parametrize("other", [about_centre(0.05, -0.004, 0), about_centre(-0.05, 0.004, 0)])
def test_different_motions_stay_different_groups(other: np.ndarray) -> None:
    before, after = merged([about_centre(0.05, 0.004, 0), other])
    np.testing.assert_array_equal(after, before)


def test_a_group_that_stands_still_is_dropped_and_the_rest_renumbered() -> None:
    before, after = merged([about_centre(0, 1e-4, 0), about_centre(0.05, 0.004, 0), np.eye(4)])
    np.testing.assert_array_equal(after, np.where(before == 1, 0, -1))


def test_two_shifts_differ_by_focal_length_over_distance() -> None:
    p = np.array([[0.0, 0.0, 0.5], [0.1, 0.0, 0.5]])
    X = translation(np.array([0.001, 0.0, 0.0]))
    assert flow_difference(p, X, np.eye(4), FOCAL_LENGTH) == pytest.approx(1.2)
