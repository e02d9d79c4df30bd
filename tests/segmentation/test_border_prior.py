"""What the still picture says of a border, for heights and colours that are known."""

from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from riseg_drake.segmentation.border_prior import BorderPriorParameters, border_cues, border_prior
from riseg_drake.segmentation.superpixels import Superpixels


def two_halves(
    height: np.ndarray,
    color: np.ndarray,
    depth: np.ndarray | None = None,
    *,
    behind: bool = False,
    across: bool = False,
) -> SimpleNamespace:
    """40 x 40 pixels, cut in the middle from top to bottom."""
    label = np.zeros((40, 40), np.intp)
    label[:, 20:] = 1
    cut = Superpixels(label, 2, np.array([[0, 1]]), np.array([40.0]), np.array([behind]), np.array([across]))
    return SimpleNamespace(
        region=(slice(0, 40), slice(0, 40)),
        count=2,
        borders=cut.borders,
        superpixels=cut,
        height=cv2.medianBlur(height.astype(np.float32), 5),
        area=np.array([800, 800]),
        frame=SimpleNamespace(color=color, depth=np.ones((40, 40), np.float32) if depth is None else depth),
    )


FLAT, GRAY = np.full((40, 40), 0.03), np.full((40, 40, 3), 100, np.uint8)
U = np.arange(40)[None, :] * np.ones((40, 1))


def test_a_flat_surface_of_one_colour_has_no_cue():
    (cues,) = border_cues(two_halves(FLAT, GRAY))
    np.testing.assert_allclose(cues, 0, atol=1e-6)
    assert border_prior(two_halves(FLAT, GRAY), BorderPriorParameters()) == pytest.approx([2.0])


def test_a_step_s_low_side_lies_below_the_mean_of_both_and_is_no_valley():
    (cues,) = border_cues(two_halves(np.where(U < 20, 0.03, 0.024), GRAY))
    # The border lies as low as the lower side, 3 mm below the mean of both.
    np.testing.assert_allclose(cues, [3, 0, 0, 0], atol=1e-4)


def test_a_valley_lies_below_both_sides():
    # A V of 0.5 mm a pixel, lowest between pixels 19 and 20; the median over 5 fills up its lowest part.
    height = 0.03 + 0.0005 * np.abs(U - 19.5)
    filtered = cv2.medianBlur(height.astype(np.float32), 5)
    (cues,) = border_cues(two_halves(height, GRAY))
    depth = 1e3 * (filtered[20, 15] - filtered[20, 19])
    np.testing.assert_allclose(cues[:2], [depth, depth], atol=1e-3)
    assert depth > 1


def test_a_ridge_is_no_dent():
    (cues,) = border_cues(two_halves(0.03 - 0.0005 * np.abs(U - 19.5), GRAY))
    np.testing.assert_allclose(cues[:2], 0, atol=1e-4)


def test_the_largest_difference_of_any_channel_counts():
    color = GRAY.copy()
    color[:, 20:] = [100, 130, 90]
    (cues,) = border_cues(two_halves(FLAT, color))
    # One and a half pixels to each side of a step blurred with sigma 1: 30 (2 Phi(1.5) - 1), in whole levels.
    assert cues[2] == pytest.approx(30 * 0.8664, abs=0.6)


def test_holes_are_a_share_of_the_border_beyond_that_of_its_sides():
    depth = np.ones((40, 40), np.float32)
    depth[:10, 19:21] = 0
    (cues,) = border_cues(two_halves(FLAT, GRAY, depth))
    # 10 of the 800 pixels on each side.
    assert cues[3] == pytest.approx(0.25 - 10 / 800)


def test_what_has_holes_everywhere_has_no_border_where_one_is():
    depth = np.ones((40, 40), np.float32)
    depth[::4] = 0
    (cues,) = border_cues(two_halves(FLAT, GRAY, depth))
    assert cues[3] == pytest.approx(0)


def test_every_cue_makes_one_body_less_likely_by_its_weight_and_the_picture_proves_nothing():
    color = np.where(U[..., None] < 20, 0, 255).astype(np.uint8).repeat(3, -1)
    parameters = BorderPriorParameters()
    # Colour saturates at 60 gray levels, a quarter of the border is without depth, and a fortieth of its sides.
    depth = np.ones((40, 40), np.float32)
    depth[:10, 18:22] = 0
    both = border_prior(two_halves(FLAT, color, depth), parameters)
    assert both == pytest.approx([2.5 - 0.045 * 60 - 1.6 * (0.25 - 0.025)])
    step = border_prior(two_halves(np.where(U < 20, 0.03, 0.024), color, depth), parameters)
    assert step == pytest.approx(both - 0.2 * 3)
    deep = two_halves(np.where(np.abs(U - 19.5) < 3, 0.0, 0.03), color, np.zeros((40, 40), np.float32))
    assert border_prior(deep, parameters) == pytest.approx([-1.5])


def test_mirroring_the_picture_changes_nothing():
    rng = np.random.default_rng(0)
    height, color = 0.03 + 0.002 * rng.normal(size=(40, 40)), rng.integers(0, 255, (40, 40, 3), np.uint8)
    one = border_cues(two_halves(height, color))
    other = border_cues(two_halves(height[:, ::-1].copy(), color[:, ::-1].copy()))
    np.testing.assert_allclose(one, other, rtol=1e-5)


def test_across_a_gap_the_picture_says_as_much_as_it_may_that_two_are_two():
    given = BorderPriorParameters(least=-1.25)
    assert border_prior(two_halves(FLAT, GRAY, across=True), given) == pytest.approx([-1.25])


def test_the_picture_says_nothing_of_what_may_go_on_behind_something():
    assert border_prior(two_halves(FLAT, GRAY, behind=True), BorderPriorParameters()) == pytest.approx([0.0])


def test_a_place_without_depth_on_one_side_is_one_without_depth():
    depth = np.ones((40, 40), np.float32)
    depth[:10, 19] = 0
    (cues,) = border_cues(two_halves(FLAT, GRAY, depth))
    # A quarter of the border; of both sides' pixels 10 of 1600.
    assert cues[3] == pytest.approx(0.25 - 10 / 1600)


def test_a_valley_makes_one_body_less_likely_by_its_own_weight():
    height = 0.03 + 0.0002 * np.abs(U - 19.5)
    (cues,) = border_cues(two_halves(height, GRAY))
    assert 0.3 < cues[1] < 1.0
    assert cues[0] == pytest.approx(cues[1], abs=1e-3)
    parameters = BorderPriorParameters(most=5.0)
    assert border_prior(two_halves(height, GRAY), parameters) == pytest.approx(
        2.5 - 0.2 * cues[0] - 0.6 * cues[1]
    )
