from dataclasses import replace
from types import SimpleNamespace

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw

from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.geometry.rgbd import NO_FRAME
from riseg_drake.geometry.se3 import inverse
from riseg_drake.segmentation.bodies import Bodies
from riseg_drake.segmentation.displacements import Displacements
from riseg_drake.segmentation.segmentation import Segmentation
from tests.segmentation.drawn_scene import looking_down

CAMERA = Intrinsics(40, 30, 40.0, 40.0, 19.5, 14.5)
SHOVE = RigidTransform(RollPitchYaw(0, 0, 0.4), [0.03, 0.01, 0]).GetAsMatrix4()
SLIDE = RigidTransform([0, 0.02, 0]).GetAsMatrix4()
STILL = np.eye(4)


def frame(number):
    return replace(
        NO_FRAME, sequence=number, time=number / 10, intrinsics=CAMERA, X_WC=looking_down(x=0.01 * number)
    )


def keyframe(number):
    """Of two superpixels, with a point each."""
    points = SimpleNamespace(pixel=np.array([[10, 20], [10, 30]]), depth=np.array([0.4, 0.4]))
    return SimpleNamespace(frame=frame(number), points=points, owner=np.array([0, 1]))


def bodies(key, ids, *motions_W):
    """Ids of both superpixels, and the motion of each in W since a keyframe."""
    X_WK = key.frame.X_WC
    motions_K = np.array([STILL, *(inverse(X_WK) @ X @ X_WK for X in motions_W)])
    return Bodies(np.array(ids), np.array([1, 2]), motions_K, 3, np.zeros((3, 3)), np.array(ids))


def segmentation(number, key, by_frame, label=0):
    return Segmentation(
        sequence=number,
        label=np.full(CAMERA.shape, label, np.uint16),
        belief=SimpleNamespace(keyframe=key),
        bodies=by_frame,
        seen=frame(number),
    )


def followed(*segmentations):
    displacements = Displacements()
    for each in segmentations:
        displacements.take(each)
    return displacements


K, N = keyframe(0), keyframe(2)
FOUND = segmentation(1, K, {1: bodies(K, [1, 0], SHOVE, STILL)})
RENEWED = segmentation(2, N, {1: bodies(N, [1, 0], inverse(SLIDE), STILL), 2: bodies(N, [1, 0], STILL, STILL)})
BEGUN = segmentation(0, K, {})


def test_a_track_begins_at_the_keyframe_and_goes_on_over_the_next_one():
    on = segmentation(3, N, {3: bodies(N, [1, 0], SLIDE, STILL)})
    tracks = followed(BEGUN, FOUND, RENEWED, on).tracks
    assert list(tracks) == [1]
    assert list(tracks[1]) == [0.0, 0.1, 0.2, 0.3]
    for X, expected in zip(
        tracks[1].values(), (STILL, SHOVE, SLIDE @ SHOVE, SLIDE @ SLIDE @ SHOVE), strict=True
    ):
        np.testing.assert_allclose(X, expected, atol=1e-12)


def test_what_the_frame_of_a_new_keyframe_finds_stood_as_the_old_one_shows_it():
    found = segmentation(
        2, N, {1: bodies(N, [5, 0], inverse(SHOVE), STILL), 2: bodies(N, [5, 0], STILL, STILL)}
    )
    displacements = followed(BEGUN, segmentation(1, K, {1: bodies(K, [0, 0], STILL, STILL)}), found)
    assert list(displacements.tracks[5]) == [0.0, 0.2]
    np.testing.assert_allclose(displacements.now[5], SHOVE, atol=1e-12)


def test_an_id_that_was_found_in_motion_and_is_gone_has_no_track():
    gone = segmentation(2, K, {2: bodies(K, [0, 0], STILL, STILL)})
    displacements = followed(BEGUN, FOUND, gone)
    assert displacements.tracks == {}
    assert displacements.now == {}


def test_an_id_out_of_sight_keeps_its_place_and_gets_no_lines():
    hidden = segmentation(3, N, {3: bodies(N, [0, 0], STILL, STILL)})
    displacements = followed(BEGUN, FOUND, RENEWED, hidden)
    assert list(displacements.tracks[1]) == [0.0, 0.1, 0.2]
    np.testing.assert_allclose(displacements.now[1], SLIDE @ SHOVE, atol=1e-12)


def test_where_a_motion_cannot_be_chained_nothing_is_claimed_any_more():
    unchained = segmentation(2, N, {2: bodies(N, [1, 0], STILL, STILL)})
    displacements = followed(BEGUN, FOUND, unchained)
    assert displacements.now == {}
    assert list(displacements.tracks[1]) == [0.0, 0.1]


def test_of_a_segmentation_that_keeps_no_bodies_no_motion_is_known():
    literal = replace(FOUND, belief=None, bodies={})
    assert followed(literal).tracks == {}
