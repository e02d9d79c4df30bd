"""What came to where nothing stood before has moved; what was there, or may have been, has not for that."""

from types import SimpleNamespace

import numpy as np
import pytest

from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.geometry.se3 import exp_se3, inverse
from riseg_drake.segmentation.arrivals import have_come, with_arrivals

CAMERA = Intrinsics(20, 12, 20.0, 20.0, 9.5, 5.5)


def keyframe(depth, owner, X_WC=None):
    """What `have_come` asks of a keyframe, with superpixels 0.. by `owner` [H, W], -1 = none."""
    X_WC = np.eye(4) if X_WC is None else X_WC
    count = int(owner.max()) + 1

    def image_of(values, outside=0):
        return np.append(values, np.array(outside, values.dtype))[owner]

    frame = SimpleNamespace(depth=depth.astype(np.float32), intrinsics=CAMERA, X_WC=X_WC)
    area = np.bincount(owner[owner >= 0], minlength=count)
    return SimpleNamespace(frame=frame, count=count, area=area, image_of=image_of)


def halves():
    """Left of the middle superpixel 0, right of it 1; nothing in the outer columns."""
    owner = np.full(CAMERA.shape, -1)
    owner[:, 4:10], owner[:, 10:16] = 0, 1
    return owner


@pytest.mark.parametrize(
    ("before", "comes"),
    [(0.52, True), (0.516, True), (0.514, False), (0.5, False), (0.4, False), (0.0, False)],
)
def test_what_was_seen_behind_a_place_left_it_free(before, comes):
    # Both stand 0.5 m away now; on the left the old picture saw what it saw, on the right the same as now.
    depth = np.full(CAMERA.shape, 0.5)
    depth[:, :10] = before
    come = have_come(keyframe(depth, halves()), keyframe(np.full(CAMERA.shape, 0.5), halves()))
    assert come.tolist() == [comes, False]


def test_most_of_a_superpixel_must_have_come_and_what_has_no_depth_now_has_not():
    depth, now = np.full(CAMERA.shape, 0.5), np.full(CAMERA.shape, 0.5)
    depth[:7, 4:10] = 0.6  # 7 of 12 rows
    depth[:6, 10:16] = 0.6  # 6 of 12
    assert have_come(keyframe(depth, halves()), keyframe(now, halves())).tolist() == [True, False]
    now[:2] = 0  # of 7 rows 5 are left
    assert have_come(keyframe(depth, halves()), keyframe(now, halves())).tolist() == [False, False]


def test_the_place_is_looked_for_in_the_old_picture_as_its_camera_stood():
    # The new camera is 5 cm to the right, which is two pixels at 0.5 m: what was free is seen two to the left.
    X_WC = exp_se3(np.array([0, 0, 0, 0.05, 0, 0]))
    depth = np.full(CAMERA.shape, 0.5)
    depth[:, 12:18] = 0.6
    now = keyframe(np.full(CAMERA.shape, 0.5), halves(), X_WC)
    assert have_come(keyframe(depth, halves()), now).tolist() == [False, True]
    now = keyframe(np.full(CAMERA.shape, 0.5), halves(), inverse(X_WC))
    depth = np.full(CAMERA.shape, 0.5)
    depth[:, 2:8] = 0.6
    assert have_come(keyframe(depth, halves()), now).tolist() == [True, False]


def test_a_part_that_came_gets_an_id_of_its_own_if_nothing_of_it_is_known():
    part, area = np.array([0, 0, 1, 1, 2, 3]), np.array([60, 40, 60, 40, 100, 100])
    come = np.array([True, False, False, True, True, True])
    # 60 of part 0 came, 40 of part 1, all of 2, of which something is known, and all of 3.
    ids, following = with_arrivals(np.array([0, 0, 0, 0, 4, 0]), part, come, area, 100, 7)
    assert ids.tolist() == [7, 7, 0, 0, 4, 8]
    assert following == 9
    # Of a part of which something is known the rest is asked, if it is the larger one, and keeps that id apart.
    for area_known, ids_then in ((99, [4, 7, 7]), (100, [4, 0, 0])):
        sizes = np.array([area_known, 60, 40])
        ids, _ = with_arrivals(np.array([4, 0, 0]), np.zeros(3, int), np.array([1, 1, 0], bool), sizes, 100, 7)
        assert ids.tolist() == ids_then
    # What is too small for an object is none.
    ids, following = with_arrivals(np.zeros(6, int), part, come, area, 101, 7)
    assert (ids.tolist(), following) == ([0] * 6, 7)
