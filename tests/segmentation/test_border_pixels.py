"""Pixels along borders, in a picture of which every pixel is known."""

import numpy as np

from riseg_drake.segmentation.border_pixels import border_pixels
from riseg_drake.segmentation.superpixels import Superpixels

#   0 0 1
#   0 2 1
#   . 2 2
LABEL = np.array([[0, 0, 1], [0, 2, 1], [-1, 2, 2]])
BORDERS = np.array([[0, 1], [0, 2], [1, 2]])
CUT = Superpixels(LABEL, 3, BORDERS, np.ones(3), np.zeros(3, bool), np.zeros(3, bool))


def test_every_place_at_which_two_superpixels_touch_is_listed_once_with_its_border():
    down, right = border_pixels(CUT)
    assert down.axis == 0
    assert list(zip(*down.pixel.tolist(), down.border.tolist(), strict=True)) == [(0, 1, 1), (1, 2, 2)]
    assert right.axis == 1
    places = [(0, 1, 0), (1, 0, 1), (1, 1, 2)]
    assert list(zip(*right.pixel.tolist(), right.border.tolist(), strict=True)) == places


def test_beside_a_border_0_is_the_last_pixel_before_it_and_1_the_first_behind_it_up_to_the_image_s_end():
    image = np.arange(9).reshape(3, 3)
    down, right = border_pixels(CUT)
    assert down.beside(image, 0).tolist() == [1, 5]
    assert down.beside(image, 1).tolist() == [4, 8]
    assert down.beside(image, 5).tolist() == [7, 8]
    assert right.beside(image, -4).tolist() == [0, 3, 3]
    colors = np.stack([image, -image], axis=-1)
    assert right.beside(colors, 1).tolist() == [[2, -2], [4, -4], [5, -5]]


def test_borders_are_told_by_both_their_superpixels_though_others_share_one_of_them():
    # Every two of five superpixels touch or not: 0 1 | 2 3 | 4 in three rows.
    label = np.array([[0, 1, 1], [2, 3, 1], [2, 4, 4]])
    borders = np.array([[0, 1], [0, 2], [1, 3], [1, 4], [2, 3], [2, 4], [3, 4]])
    none = np.zeros(7, bool)
    cut = Superpixels(label, 5, borders, np.ones(7), none, none)
    for places in border_pixels(cut):
        sides = np.stack([places.beside(label, 0), places.beside(label, 1)], axis=1)
        np.testing.assert_array_equal(np.sort(sides, axis=1), borders[places.border])
