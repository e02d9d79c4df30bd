"""Prompts: points well inside and spread out, a box that is tight."""

import numpy as np
import pytest

from riseg_drake.learned.prompts import grid_prompts, intersection_over_union, prompt_of_mask


def bar() -> np.ndarray:
    mask = np.zeros((60, 100), bool)
    mask[20:40, 10:91] = True
    return mask


def test_points_lie_inside_the_first_deepest_and_the_others_spread():
    prompt = prompt_of_mask(bar(), points=5, with_mask=False)
    u, v = prompt.points.T.astype(int)
    assert bar()[v, u].all()
    assert v[0] in (29, 30)  # on the middle line
    assert min(abs(v - 19.5)) > 4  # none at the rim
    gaps = np.linalg.norm(prompt.points[:, None] - prompt.points, axis=-1)
    assert gaps[np.triu_indices(5, 1)].min() > 10
    assert np.ptp(u) > 60


def test_the_box_is_the_first_and_last_pixel():
    prompt = prompt_of_mask(bar(), points=3, with_mask=False)
    np.testing.assert_array_equal(prompt.box, [10, 20, 90, 39])
    assert prompt.mask is None


def test_the_mask_goes_along_if_wanted():
    np.testing.assert_array_equal(prompt_of_mask(bar(), points=1, with_mask=True).mask, bar())


def test_a_single_pixel_is_named_as_often_as_needed():
    mask = np.zeros((5, 5), bool)
    mask[4, 2] = True
    prompt = prompt_of_mask(mask, points=3, with_mask=False)
    np.testing.assert_array_equal(prompt.points, [[2, 4]] * 3)


def test_the_edge_of_the_image_is_not_deep_inside():
    mask = np.zeros((30, 90), bool)
    mask[:, 60:] = True
    u, v = prompt_of_mask(mask, points=1, with_mask=False).points[0]
    assert u == pytest.approx(74.5, abs=1)
    assert v == pytest.approx(14.5, abs=1)


def test_a_grid_divides_the_image_evenly():
    prompts = grid_prompts(height=40, width=80, side=4)
    points = np.array([prompt.points[0] for prompt in prompts])
    assert len(prompts) == 16
    np.testing.assert_allclose(np.unique(points[:, 0]), [9.5, 29.5, 49.5, 69.5])
    np.testing.assert_allclose(np.unique(points[:, 1]), [4.5, 14.5, 24.5, 34.5])


def test_masks_agree_by_the_share_that_they_have_in_common():
    a, b = np.zeros((4, 4), bool), np.zeros((4, 4), bool)
    assert intersection_over_union(a, b) == 0
    a[:2], b[1:3] = True, True
    assert intersection_over_union(a, b) == pytest.approx(1 / 3)
