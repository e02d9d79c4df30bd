"""The path of the hand, in closed form; the frames are those of the filmed world."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from riseg_drake.stations.filmed_world import looking_at
from riseg_drake.stations.still_film import StillFilmParameters, hand_path

MIDDLE = np.array([0.5, 0.1, 0.02])


def path(seed=0, **changed):
    parameters = StillFilmParameters(**changed)
    return list(hand_path(parameters, MIDDLE, np.random.default_rng(seed)))


@pytest.mark.parametrize(
    ("eye", "axes"),
    [
        # From -x at the same height: ahead is +x, right is -y, the image's v goes down.
        ([-1.0, 0.0, 0.0], [[0, -1, 0], [0, 0, -1], [1, 0, 0]]),
        ([0.0, -1.0, 0.0], [[1, 0, 0], [0, 0, -1], [0, 1, 0]]),
        ([-3.0, 0.0, 3.0], [[0, -1, 0], [-(0.5**0.5), 0, -(0.5**0.5)], [0.5**0.5, 0, -(0.5**0.5)]]),
    ],
)
def test_a_camera_looks_at_its_target_with_the_worlds_z_up(eye, axes):
    target = np.array([0.3, -0.2, 0.1])
    X_WC = looking_at(target + eye, target)
    np.testing.assert_allclose(X_WC.rotation().matrix().T, axes, atol=1e-12)
    np.testing.assert_array_equal(X_WC.translation(), target + eye)


def test_a_hand_that_does_not_sway_stands_at_its_distance_and_looks_at_the_middle():
    poses = path(sway=0.0, turn=0.0, distance=0.4, flattest=50.0, steepest=50.0)
    assert len(poses) == 45
    for X_WC in poses:
        p_CM = X_WC.inverse().multiply(MIDDLE)
        np.testing.assert_allclose(p_CM, [0, 0, 0.4], atol=1e-12)
        assert X_WC.translation()[2] - MIDDLE[2] == pytest.approx(0.4 * np.sin(np.radians(50)))


def test_over_many_films_the_camera_stands_within_its_angles_on_either_side_and_never_by_the_arm():
    eyes = [path(seed, sway=0.0, turn=0.0, frames=1)[0].translation() - MIDDLE for seed in range(400)]
    x, y, z = np.transpose(eyes) / 0.55
    elevation = np.degrees(np.arcsin(z))
    azimuth = np.degrees(np.arctan2(np.abs(y), x))
    assert np.all((elevation > 40) & (elevation < 80))
    assert np.ptp(elevation) > 39
    assert np.all((azimuth > 90) & (azimuth < 125))
    assert np.ptp(azimuth) > 34
    assert 150 < np.count_nonzero(y > 0) < 250


def test_the_hand_sways_by_less_than_it_may_along_each_axis_and_comes_near_it():
    swayed = [
        np.abs([X.translation() - Y.translation() for X, Y in zip(path(s), path(s, sway=0.0), strict=True)])
        for s in range(12)
    ]
    most = np.max(swayed, axis=(0, 1))
    assert np.all(most <= 0.04)
    assert np.all(most > 0.032)


def test_the_hand_misses_the_middle_by_less_than_it_may():
    turned = [
        [
            Rotation.from_matrix((Y.inverse() @ X).rotation().matrix()).as_rotvec()
            for X, Y in zip(path(seed), path(seed, turn=0.0), strict=True)
        ]
        for seed in range(12)
    ]
    most = np.abs(turned).max(axis=(0, 1))
    assert np.all(most <= 0.02 + 1e-9)
    assert np.all(most > 0.015)


def test_the_hand_sways_in_seconds_whatever_the_cameras_rate():
    slow, fast = StillFilmParameters(frames=10), StillFilmParameters(frames=19)
    slow.camera.rate, fast.camera.rate = 15.0, 30.0
    few, many = (list(hand_path(p, MIDDLE, np.random.default_rng(3))) for p in (slow, fast))
    for one, other in zip(few, many[::2], strict=True):
        assert one.IsNearlyEqualTo(other, 1e-12)


def test_the_sway_holds_no_wave_faster_than_a_second_nor_slower_than_three():
    # Of x(t) - rest, a mean of three sines of periods 1 to 3 s: |x''| <= (2 pi)^2 sway, at 15 Hz.
    for seed in range(5):
        eye = np.array([X.translation() for X in path(seed, frames=150)])
        second = np.diff(eye, 2, axis=0) * 15**2
        assert np.abs(second).max() <= (2 * np.pi) ** 2 * 0.04
        # ... and it comes back: its mean over ten seconds is at rest within a quarter of the sway.
        rest = np.array(path(seed, frames=1, sway=0.0)[0].translation())
        assert np.abs(eye.mean(0) - rest).max() < 0.01
