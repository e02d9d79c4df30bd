"""Body frames: points of one neighbourhood on what moves, tracked from t-1 to t."""

from dataclasses import replace

import numpy as np
import pytest

from riseg_drake.geometry.camera import project
from riseg_drake.geometry.se3 import move_points
from riseg_drake.segmentation.body_frames import BodyFrameParameters, sample_body_frames, track_points
from tests.segmentation.drawn_scene import (
    CAMERA,
    DrawnScene,
    flow_of_bodies,
    looking_down,
    motion_seen_from,
    planar,
)

SIZES = [(0.08, 0.07, 0.03), (0.05, 0.05, 0.06)]
PLACES = [planar(-0.06, 0.0, 0.3), planar(0.07, 0.02)]
MOVED = [planar(-0.057, 0.004, 0.33), PLACES[1]]
CAMERAS = (looking_down(), looking_down(x=0.006, y=-0.004))
X_1 = motion_seen_from(CAMERAS[0], PLACES[0], MOVED[0])
SIGMA = np.full(CAMERA.shape, 0.2, np.float32)

KINDS = pytest.mark.parametrize("kind", ["patches", "triplets"])


@pytest.fixture(scope="module")
def scene():
    """A pair in which body 1 moves, its true flow, and the labels at t-1."""
    pair, label_0, _ = DrawnScene(SIZES).pair(CAMERAS, (PLACES, MOVED))
    return pair, flow_of_bodies(pair, label_0, {1: X_1}), label_0


def sample(scene, moving, seed=0, **parameters):
    pair, flow, _ = scene
    rng = np.random.default_rng(seed)
    return sample_body_frames(pair, flow, moving, SIGMA, BodyFrameParameters(**parameters), rng)


def widths(frames) -> np.ndarray:
    """The largest distance between two points of each frame."""
    apart = np.linalg.norm(frames.p_C0Q0[:, :, None] - frames.p_C0Q0[:, None], axis=-1)
    apart[~(frames.used[:, :, None] & frames.used[:, None])] = 0
    return apart.max((1, 2))


@KINDS
@pytest.mark.parametrize("diameter", [0.012, 0.024])
def test_no_frame_is_wider_than_its_diameter(scene, kind: str, diameter: float) -> None:
    frames = sample(scene, scene[2] > 0, kind=kind, diameter=diameter)
    assert len(frames) > 20
    # Points are pixels: each end may be rounded by half a diagonal of one.
    pixel = np.sqrt(0.5) * 0.45 / CAMERA.fx
    assert widths(frames).max() <= diameter + 2 * pixel


@KINDS
def test_a_frame_does_not_reach_down_a_step_that_is_higher_than_it_is_wide(scene, kind: str) -> None:
    frames = sample(scene, np.ones(CAMERA.shape, bool), kind=kind, count=400)
    z = np.where(frames.used, frames.p_C0Q0[..., 2], np.nan)
    assert np.nanmax(np.nanmax(z, axis=1) - np.nanmin(z, axis=1)) <= BodyFrameParameters().diameter


@KINDS
def test_points_on_one_line_make_no_frame(scene, kind: str) -> None:
    line = np.zeros(CAMERA.shape, bool)
    v, u = (int(k.mean()) for k in np.nonzero(scene[2] == 1))
    line[v, u - 15 : u + 15] = True
    assert len(sample(scene, line, kind=kind)) == 0
    line[v - 8 : v + 8] |= line[v]
    assert len(sample(scene, line, kind=kind)) > 0


@KINDS
def test_no_frame_is_nearly_collinear(scene, kind: str) -> None:
    frames = sample(scene, scene[2] == 1, kind=kind)
    for p, used in zip(frames.p_C0Q0, frames.used, strict=True):
        q = p[used] - p[used].mean(0)
        first, second = np.linalg.svd(q, compute_uv=False)[:2]
        assert second > 0.05 * first


def test_a_triplet_has_three_points_and_a_patch_at_least_points_min(scene) -> None:
    triplets = sample(scene, scene[2] == 1, kind="triplets")
    assert triplets.p_C0Q0.shape[1:] == (3, 3)
    assert triplets.used.all()
    patches = sample(scene, scene[2] == 1, kind="patches", points_min=12)
    assert (patches.used.sum(1) >= 12).all()


@KINDS
def test_frames_lie_on_moving_pixels_only(scene, kind: str) -> None:
    label_0 = scene[2]
    frames = sample(scene, label_0 == 1, kind=kind)
    assert len(frames) > 30
    assert (label_0[tuple(frames.pixel.T)] == 1).all()
    uvz = frames.p_C0Q0[frames.used]
    u = np.rint(uvz[:, 0] / uvz[:, 2] * CAMERA.fx + CAMERA.cx).astype(int)
    v = np.rint(uvz[:, 1] / uvz[:, 2] * CAMERA.fy + CAMERA.cy).astype(int)
    assert (label_0[v, u] == 1).all()


@KINDS
def test_points_are_tracked_by_the_bodys_motion_and_without_the_cameras(scene, kind: str) -> None:
    frames = sample(scene, scene[2] == 1, kind=kind)
    error = np.linalg.norm(frames.p_C0Q1 - move_points(X_1, frames.p_C0Q0), axis=-1)
    assert np.median(error[frames.used]) < 2e-4
    still = sample(scene, scene[2] == 2, kind=kind)
    assert np.median(np.linalg.norm(still.p_C0Q1 - still.p_C0Q0, axis=-1)[still.used]) < 2e-4


def test_a_point_that_the_robot_hides_at_t_or_that_leaves_the_view_is_not_tracked(scene) -> None:
    pair, flow, label_0 = scene
    v, u = (k[:6] for k in np.nonzero(label_0 == 1))
    assert (track_points(pair, flow, (v, u))[2] > 0).all()
    hidden = replace(pair, current=replace(pair.current, robot=np.ones(CAMERA.shape, bool)))
    assert (track_points(hidden, flow, (v, u))[2] == 0).all()
    away = np.full_like(flow, 1000)
    assert (track_points(pair, away, (v, u))[2] == 0).all()


def test_a_small_thing_gets_frames_beside_a_big_one(scene) -> None:
    moving = np.zeros(CAMERA.shape, bool)
    moving[60:180, 20:120] = True
    small = np.zeros_like(moving)
    small[60:84, 200:224] = True
    for seed in range(60):
        frames = sample(scene, moving | small, seed=seed, diameter=0.012)
        assert np.count_nonzero(small[tuple(frames.pixel.T)]) >= 3


def test_no_more_frames_than_asked_and_all_of_them_apart(scene) -> None:
    frames = sample(scene, scene[2] == 1, count=40)
    assert 20 < len(frames) <= 40
    assert len(np.unique(frames.pixel, axis=0)) == len(frames)


@KINDS
def test_the_same_generator_draws_the_same_frames(scene, kind: str) -> None:
    one, two, other = (sample(scene, scene[2] == 1, seed, kind=kind) for seed in (5, 5, 6))
    np.testing.assert_array_equal(one.pixel, two.pixel)
    np.testing.assert_array_equal(one.p_C0Q1, two.p_C0Q1)
    assert one.pixel.shape != other.pixel.shape or (one.pixel != other.pixel).any()


def test_an_unknown_kind_is_refused_with_the_choices(scene) -> None:
    with pytest.raises(ValueError, match=r"'quads'.*patches or triplets"):
        sample(scene, scene[2] == 1, kind="quads")


def test_where_nothing_moves_there_are_no_frames(scene) -> None:
    assert len(sample(scene, np.zeros(CAMERA.shape, bool))) == 0


@pytest.mark.parametrize("corner", [np.s_[:8, :8], np.s_[:8, -8:], np.s_[-8:, :8], np.s_[-8:, -8:]])
def test_in_each_corner_of_the_image_frames_reach_its_last_pixels_and_none_beyond(scene, corner) -> None:
    pair, _, _ = scene
    moving = np.zeros(CAMERA.shape, bool)
    moving[corner] = True
    depth = np.full(CAMERA.shape, 0.45, np.float32)
    flat = replace(
        pair, reference=replace(pair.reference, depth=depth), current=replace(pair.current, depth=depth)
    )
    flow = np.zeros((*CAMERA.shape, 2), np.float32)
    frames = sample_body_frames(
        flat, flow, moving, SIGMA, BodyFrameParameters(count=200), np.random.default_rng(0)
    )
    u, v = np.rint(project(frames.p_C0Q0[frames.used], CAMERA)).astype(int).T
    rows, columns = np.nonzero(moving)
    assert (v.min(), v.max(), u.min(), u.max()) == (rows.min(), rows.max(), columns.min(), columns.max())
