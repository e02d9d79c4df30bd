"""What is measured otherwise from another view, by hand."""

from dataclasses import replace

import numpy as np
import pytest

from riseg_drake.geometry.reduction import reduced
from riseg_drake.geometry.rgbd import Frame, FramePair
from riseg_drake.segmentation.comparison import Comparison, ViewError, renewed_view_error
from riseg_drake.segmentation.keyframe import Keyframe, KeyframeParameters, make_keyframe
from riseg_drake.segmentation.noise import MeasurementNoise
from tests.segmentation.drawn_scene import CAMERA, DrawnScene, looking_down, planar, standing

DEPTH = 0.42
"""m, of the box's upper side, and, about, of what is seen."""


def over(x: float) -> Frame:
    return DrawnScene([(0.9, 0.7, 0.03)]).frame(0, looking_down(x), [planar(0, 0)])[0]


@pytest.fixture(scope="module")
def keyframe() -> Keyframe:
    frame = over(0.0)
    return make_keyframe(
        frame, standing(frame, frame.depth < DEPTH + 0.001), MeasurementNoise(), KeyframeParameters()
    )


@pytest.mark.parametrize("aside", [0.0, 0.05, 0.1])
def test_what_stands_seems_to_move_by_a_share_of_the_cameras_motion(keyframe: Keyframe, aside: float) -> None:
    compared = Comparison(keyframe, over(aside), depth_noise=0.0023, view_error=0.02)
    assert compared.shift == pytest.approx(0.02 * CAMERA.fx * aside / DEPTH, rel=1e-3, abs=1e-9)
    assert compared.another_view == pytest.approx(CAMERA.fx * aside / DEPTH / 100, rel=1e-3, abs=1e-9)
    # And depth by as large a share, times how far it is another view, which it is from 100 pixels on.
    assert compared.depth_error == pytest.approx(compared.shift / 100)


def test_in_half_as_many_pixels_a_row_a_view_is_as_much_another_one_and_errs_by_half_as_many(keyframe) -> None:
    whole, few = over(0.05), reduced(over(0.05), 160)
    compared, in_few = (Comparison(keyframe, frame, 0.0023, view_error=0.02) for frame in (whole, few))
    assert in_few.another_view == pytest.approx(compared.another_view, rel=1e-3)
    assert in_few.depth_error == pytest.approx(compared.depth_error, rel=1e-3)
    assert in_few.shift == pytest.approx(compared.shift / 2, rel=1e-3)


def test_from_100_pixels_on_it_is_another_view_and_no_more_than_that(keyframe: Keyframe) -> None:
    # 20 cm are 147 pixels.
    compared = Comparison(keyframe, over(0.2), depth_noise=0.0023, view_error=0.02)
    assert (compared.shift, compared.depth_error) == pytest.approx((2.0, 0.02))
    assert compared.another_view == 1.0


def test_poses_that_err_shift_the_image_whatever_the_view_and_leave_depth_as_it_is(keyframe: Keyframe) -> None:
    at_once = Comparison(keyframe, over(0.0), 0.0023, view_error=0.02, pose_error=0.3)
    assert (at_once.shift, at_once.depth_error) == pytest.approx((0.3, 0.0))
    aside = Comparison(keyframe, over(0.2), 0.0023, view_error=0.02, pose_error=0.3)
    assert (aside.shift, aside.depth_error) == pytest.approx((2.3, 0.02))
    few = Comparison(keyframe, reduced(over(0.2), 160), 0.0023, view_error=0.02, pose_error=0.3)
    assert few.shift == pytest.approx(2.3 / 2)


def test_superpixels_of_a_known_body_are_one_whole_and_all_others_each_its_own(keyframe: Keyframe) -> None:
    body = np.zeros(keyframe.count, int)
    body[[1, 3]], body[2] = 7, 9
    known, unknown = (Comparison(keyframe, over(0.0), 0.0023, 0.01, body=ids) for ids in (body, None))
    assert known.whole[:5].tolist() == [-1, 7, 9, 7, -5]
    assert unknown.whole[:5].tolist() == [-1, -2, -3, -4, -5]
    number = keyframe.image_of(np.arange(1, keyframe.count + 1))
    np.testing.assert_array_equal(known.whole_image[number == 4], 7)
    np.testing.assert_array_equal(known.whole_image[number == 0], 0)


def test_without_pairs_it_is_what_is_assumed() -> None:
    assert ViewError().share(0.01) == pytest.approx(0.01)


def test_pairs_outweigh_what_is_assumed_by_their_squared_spans() -> None:
    # Sum of r^2 over sum of s^2, with one pair of 20 pixels by which 1 % is assumed: (36 + 0.04) / (600 + 400).
    assert ViewError(36.0, 600.0).share(0.01) == pytest.approx(np.sqrt(36.04 / 1000))


def test_pairs_that_agree_better_do_not_make_it_less_than_is_assumed() -> None:
    assert ViewError(1e-3, 1e5).share(0.01) == 0.01


def test_a_pair_adds_its_residual_and_its_span_and_old_ones_count_less() -> None:
    pair = FramePair(over(0.0), over(0.05), residual=0.7)
    known = renewed_view_error(ViewError(3.0, 900.0), pair)
    span = CAMERA.fx * 0.05 / DEPTH
    assert known.residual_squares == pytest.approx(3.0 * 29 / 30 + 0.49)
    assert known.span_squares == pytest.approx(900.0 * 29 / 30 + span**2, rel=1e-3)


def test_a_pair_whose_poses_are_exact_says_nothing() -> None:
    known = ViewError(3.0, 900.0)
    assert renewed_view_error(known, FramePair(over(0.0), over(0.05))) is known


def test_a_pair_whose_flow_was_lost_says_nothing() -> None:
    span = CAMERA.fx * 0.05 / DEPTH
    for share, says in ((0.095, True), (0.105, False)):
        pair = FramePair(over(0.0), over(0.05), residual=share * span)
        assert (renewed_view_error(ViewError(), pair) != ViewError()) is says


def test_it_takes_points_of_the_keyframe_to_the_frames_camera(keyframe: Keyframe) -> None:
    compared = Comparison(keyframe, replace(over(0.05), sequence=7), 0.0023, 0.01)
    np.testing.assert_allclose(compared.X_C1K[:3, 3], [-0.05, 0, 0], atol=1e-9)
    assert compared.pair.reference is keyframe.frame
    assert compared.pair.current.sequence == 7
