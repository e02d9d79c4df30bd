"""A picture cut into superpixels, of boxes whose pixels are known."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from riseg_drake.geometry.camera import rays
from riseg_drake.geometry.reduction import reduced
from riseg_drake.geometry.se3 import move_points
from riseg_drake.segmentation.above_table import AboveTable, AboveTableParameters, objects_above_table
from riseg_drake.segmentation.keyframe import (
    Keyframe,
    KeyframeParameters,
    in_fewer_pixels,
    make_keyframe,
    seen_again,
)
from riseg_drake.segmentation.noise import MeasurementNoise, gray_variance
from tests.segmentation.drawn_scene import DrawnScene, looking_down, planar

SIZES = [(0.08, 0.06, 0.04), (0.05, 0.05, 0.02)]
NOISE = MeasurementNoise()


def seen(holes: np.ndarray | None = None) -> tuple:
    """Two boxes beside each other: the frame, objMask, and the true labels."""
    scene = DrawnScene(SIZES)
    frame, label = scene.frame(0, looking_down(), [planar(-0.04, 0.0), planar(0.06, 0.0)])
    if holes is not None:
        frame = replace(frame, depth=np.where(holes, np.float32(0), frame.depth))
    return frame, objects_above_table(frame, AboveTableParameters()), label


@pytest.fixture(scope="module")
def boxes() -> tuple:
    return seen()


@pytest.fixture(scope="module")
def keyframe(boxes) -> Keyframe:
    frame, above, _ = boxes
    return make_keyframe(frame, above, NOISE, KeyframeParameters())


def test_superpixels_cover_what_stands_there_and_nothing_else(keyframe, boxes):
    _, above, _ = boxes
    covered = keyframe.image_of(np.ones(keyframe.count, np.uint8))
    np.testing.assert_array_equal(covered > 0, above.mask)
    assert keyframe.area.sum() == np.count_nonzero(above.mask)
    assert len(keyframe.area) == keyframe.count


def test_they_are_about_as_large_as_they_shall_be_on_the_object(keyframe, boxes):
    frame, above, _ = boxes
    pixels = 0.006 * frame.intrinsics.fx / above.distance
    assert np.sqrt(np.median(keyframe.area)) == pytest.approx(pixels, rel=0.25)
    finer = make_keyframe(frame, above, NOISE, KeyframeParameters(superpixel=0.003))
    assert finer.count > 2.5 * keyframe.count


def test_what_a_metre_is_in_pixels_is_told_by_how_far_things_are(keyframe, boxes):
    frame, above, _ = boxes
    assert keyframe.pixels_per_metre == pytest.approx(frame.intrinsics.fx / above.distance)


def test_points_lie_on_every_second_pixel_two_from_all_outlines_and_belong_to_their_superpixel(keyframe, boxes):
    _, above, _ = boxes
    inside = cv2.erode(above.mask.astype(np.uint8), np.ones((5, 5), np.uint8), borderValue=0) > 0
    v, u = keyframe.points.pixel
    assert inside[v, u].all()
    assert ((v + u) % 2 == 1).all()
    assert len(v) == np.count_nonzero(
        inside & (np.add(*np.mgrid[: inside.shape[0], : inside.shape[1]]) % 2 == 1)
    )
    label = keyframe.image_of(np.arange(keyframe.count), -1)
    np.testing.assert_array_equal(keyframe.owner, label[v, u])
    np.testing.assert_array_equal(keyframe.point_count, np.bincount(label[v, u], minlength=keyframe.count))


def test_points_have_the_image_s_gray_values_gradients_and_noise(keyframe, boxes):
    frame, _, _ = boxes
    v, u = keyframe.points.pixel
    np.testing.assert_array_equal(keyframe.gray, frame.gray[v, u])
    np.testing.assert_array_equal(keyframe.gradient_squared, frame.gradient_squared[v, u])
    np.testing.assert_array_equal(keyframe.variance, gray_variance(frame.gradient_squared, NOISE)[v, u])
    np.testing.assert_array_equal(keyframe.points.depth, frame.depth[v, u])


def test_where_depth_is_missing_nothing_is_compared_but_in_pinholes(boxes):
    _, _, label = boxes
    v, u = (int(np.median(x)) for x in np.nonzero(label == 1))
    holes = np.zeros(label.shape, bool)
    holes[v - 4 : v + 5, u - 4 : u + 5] = True  # a hole, with its rim of two pixels
    holes[v + 12, u] = True  # a pinhole
    frame, above, _ = seen(holes)
    pixel = make_keyframe(frame, replace(above, mask=label > 0), NOISE, KeyframeParameters()).points.pixel
    around = (np.abs(pixel[0] - v) <= 6) & (np.abs(pixel[1] - u) <= 6)
    assert not around.any()
    beside = (np.abs(pixel[0] - v - 12) <= 1) & (np.abs(pixel[1] - u) <= 1)
    assert beside.any()


def test_heights_are_those_of_the_boxes_and_of_the_nearest_pixel_where_depth_is_missing(boxes):
    _, _, label = boxes
    v, u = (int(np.median(x)) for x in np.nonzero(label == 1))
    holes = np.zeros(label.shape, bool)
    holes[v - 3 : v + 4, u - 3 : u + 4] = True
    frame, above, _ = seen(holes)
    keyframe = make_keyframe(frame, replace(above, mask=label > 0), NOISE, KeyframeParameters())
    height = np.zeros(label.shape, np.float32)
    height[keyframe.region] = keyframe.height
    assert height[v, u] == pytest.approx(0.04, abs=1e-4)
    assert np.median(height[label == 2]) == pytest.approx(0.02, abs=1e-4)
    assert not height[label == 0].any()


def test_known_borders_between_bodies_cut(boxes):
    frame, above, label = boxes
    half = np.where((label == 1) & (np.arange(label.shape[1]) < np.median(np.nonzero(label == 1)[1])), 5, label)
    keyframe = make_keyframe(frame, above, NOISE, KeyframeParameters(), half)
    for k in np.unique(keyframe.superpixels.label[keyframe.superpixels.label >= 0]):
        ids, pixels = np.unique(half[keyframe.region][keyframe.superpixels.label == k], return_counts=True)
        of_bodies = pixels[ids > 0]
        assert of_bodies.max() >= of_bodies.sum() - 5  # but for crumbs


def test_shares_and_images_are_by_superpixel(keyframe):
    every = np.arange(len(keyframe.owner))
    np.testing.assert_allclose(keyframe.share_of_points(every), keyframe.point_count > 0)
    (first,) = np.flatnonzero(keyframe.owner == keyframe.owner[0])[:1]
    share = keyframe.share_of_points(np.array([first]))
    assert share[keyframe.owner[0]] == pytest.approx(1 / keyframe.point_count[keyframe.owner[0]])
    assert np.count_nonzero(share) == 1
    image = keyframe.image_of(np.arange(keyframe.count) + 7, 3)
    assert set(np.unique(image)) == {3, *range(7, 7 + keyframe.count)}


def test_borders_are_measured_in_sides_of_a_superpixel(keyframe):
    side = np.sqrt(np.median(keyframe.area))
    np.testing.assert_allclose(keyframe.length * side, keyframe.superpixels.length)


def test_what_stands_there_is_covered_with_four_pixels_around_it(keyframe, boxes):
    _, above, _ = boxes
    far = cv2.distanceTransform((~above.mask).astype(np.uint8), cv2.DIST_C, 3)
    np.testing.assert_array_equal(keyframe.covered, far <= 4)


def test_a_lower_box_in_front_of_a_higher_one_may_carry_it_and_a_flat_top_carries_nothing():
    frame, label = DrawnScene(SIZES).frame(0, looking_down(), [planar(0.0, 0.0), planar(0.065, 0.0)])
    above = AboveTable(label > 0, (0.45 - frame.depth).astype(np.float32), np.array([0, 0, 1.0, 0]), 2e-4, 0.42)
    keyframe = make_keyframe(frame, above, NOISE, KeyframeParameters(), label)
    number = keyframe.image_of(np.arange(keyframe.count), -1)
    body = np.array([np.bincount(label[number == k]).argmax() for k in range(keyframe.count)])
    a, b = keyframe.borders.T
    between = (body[a] != body[b]) & ~keyframe.superpixels.behind
    assert between.any()
    assert keyframe.over[between].mean() > 0.8
    assert keyframe.over[~between].mean() < 0.1


PLACES = [planar(-0.04, 0.0), planar(0.06, 0.0)]
NEARER = looking_down(0.01, 0.0, z=0.25)


def nearer(places=PLACES, **changed) -> tuple:
    """The boxes from half as far: the frame, and the true labels."""
    frame, label = DrawnScene(SIZES).frame(1, NEARER, places)
    return replace(frame, **changed), label


def again(keyframe: Keyframe, frame) -> Keyframe:
    above = objects_above_table(nearer()[0], AboveTableParameters())
    return seen_again(keyframe, frame, above, NOISE, KeyframeParameters())


def middles(keyframe: Keyframe) -> np.ndarray:
    """p_WQ [N, 3] of each superpixel's points, their mean."""
    v, u = keyframe.points.pixel
    p_WQ = rays(keyframe.frame.intrinsics)[v, u] * keyframe.points.depth[:, None]
    p_WQ = move_points(keyframe.frame.X_WC, p_WQ.astype(float))
    total = np.array([np.bincount(keyframe.owner, x, keyframe.count) for x in p_WQ.T])
    return (total / np.maximum(keyframe.point_count, 1)).T


@pytest.mark.parametrize("measured", [True, False], ids=["with depth", "too near for depth"])
def test_seen_again_from_nearer_every_superpixel_is_where_it_was_and_larger(keyframe, measured):
    frame, label = nearer()
    frame = frame if measured else replace(frame, depth=np.zeros_like(frame.depth))
    near = again(keyframe, frame)
    shown = near.image_of(np.ones(near.count, np.uint8)) > 0
    # From nearby sides are seen, too, which were not: they are of no superpixel.
    assert np.mean(label[shown] > 0) > 0.995
    assert np.mean(shown[label > 0]) > 0.96
    both = (keyframe.point_count > 5) & (near.point_count > 5)
    assert np.count_nonzero(both) > 0.97 * np.count_nonzero(keyframe.point_count > 5)
    apart = np.linalg.norm(middles(near) - middles(keyframe), axis=1)[both]
    # A pixel of the first view is 1.3 mm.
    assert np.median(apart) < 0.0007
    assert apart.max() < 0.002
    # As (0.45 - 0.04) / (0.25 - 0.04) squared on the higher box.
    assert np.median(near.area[both] / keyframe.area[both]) == pytest.approx((0.41 / 0.21) ** 2, rel=0.1)


def test_seen_again_it_is_cut_as_it_was(keyframe):
    near = again(keyframe, nearer()[0])
    np.testing.assert_array_equal(near.borders, keyframe.borders)
    np.testing.assert_array_equal(near.length, keyframe.length)
    np.testing.assert_array_equal(near.over, keyframe.over)
    assert near.count == keyframe.count


def test_seen_again_points_have_the_new_frame_s_gray_values_and_where_there_is_none_the_old_depth(keyframe):
    frame, label = nearer()
    blind = replace(frame, depth=np.where(label == 1, np.float32(0), frame.depth))
    near = again(keyframe, blind)
    v, u = near.points.pixel
    np.testing.assert_array_equal(near.gray, frame.gray[v, u])
    np.testing.assert_allclose(near.points.depth, frame.depth[v, u], atol=1e-4)
    assert (label[v, u] == 1).sum() > 1000


def test_seen_again_what_the_robot_hides_or_stands_elsewhere_is_of_no_superpixel(keyframe):
    robot = np.zeros(keyframe.frame.depth.shape, bool)
    robot[:, :100] = True
    frame, _ = nearer(robot=robot)
    assert not again(keyframe, frame).image_of(np.ones(keyframe.count, np.uint8))[robot].any()
    # The second box was taken away: the table is 20 mm behind what was its top.
    frame, label = nearer([PLACES[0], planar(0.5, 0.5)])
    near = again(keyframe, frame)
    shown = near.image_of(np.ones(near.count, np.uint8)) > 0
    assert np.count_nonzero(shown & (label == 0)) < 0.05 * np.count_nonzero(shown)


def test_in_fewer_pixels_it_is_cut_as_it_was_in_a_quarter_of_the_pixels(keyframe, boxes):
    frame, _, _ = boxes
    few = reduced(frame, 160)
    small = in_fewer_pixels(
        keyframe, few, objects_above_table(few, AboveTableParameters()), NOISE, KeyframeParameters()
    )
    assert small.frame is few
    np.testing.assert_array_equal(small.borders, keyframe.borders)
    # Of each two by two pixels that one counts whose depth the reduced frame has.
    number = np.arange(1, keyframe.count + 1)
    np.testing.assert_array_equal(small.image_of(number), keyframe.image_of(number)[1::2, 1::2])
    np.testing.assert_array_equal(
        small.area, np.bincount(small.image_of(number).ravel(), minlength=keyframe.count + 1)[1:]
    )
    v, u = small.points.pixel
    np.testing.assert_array_equal(small.owner, small.image_of(number)[v, u] - 1)
    np.testing.assert_array_equal(small.gray, few.gray[v, u])
    assert small.pixels_per_metre == pytest.approx(keyframe.pixels_per_metre / 2, rel=0.01)


def test_in_the_pixels_of_a_whole_frame_it_is_itself(keyframe, boxes):
    frame, above, _ = boxes
    assert in_fewer_pixels(keyframe, frame, above, NOISE, KeyframeParameters()) is keyframe
