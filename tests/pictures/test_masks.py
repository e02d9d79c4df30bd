import numpy as np

from riseg_drake.pictures.masks import draw_masks
from riseg_drake.pictures.object_colors import object_colors

MASK = np.zeros((60, 80), np.uint16)
MASK[20:40, 20:40] = 1
MASK[20:40, 40:60] = 2
ORANGE, BLUE = object_colors(np.array([1, 2]))


def test_the_background_stays_as_it_is_and_so_does_the_image_given():
    color = np.full((60, 80, 3), 200, np.uint8)
    picture = draw_masks(color, MASK)
    np.testing.assert_array_equal(picture[MASK == 0], 200)
    np.testing.assert_array_equal(color, 200)


def test_touching_objects_are_parted_by_a_dark_rim_between_lines_in_their_colours():
    # Without numbers: OpenCV 4 and 5 write them in different fonts.
    picture = draw_masks(np.full((60, 80, 3), 200, np.uint8), MASK, numbers=False)
    np.testing.assert_array_equal(picture[25, 37:39], [ORANGE, ORANGE])
    np.testing.assert_array_equal(picture[25, 41:43], [BLUE, BLUE])
    assert picture[25, 39:41].max() < 70


def test_a_tint_does_not_depend_on_the_colour_of_the_object():
    yellow, gray = np.full((60, 80, 3), (200, 170, 20), np.uint8), np.full((60, 80, 3), 162, np.uint8)
    np.testing.assert_allclose(draw_masks(yellow, MASK)[24, 24], draw_masks(gray, MASK)[24, 24], atol=1)


def test_numbers_can_be_left_out():
    color = np.full((60, 80, 3), 200, np.uint8)
    assert (draw_masks(color, MASK) != draw_masks(color, MASK, numbers=False)).any()
    assert len(np.unique(draw_masks(color, MASK, numbers=False)[26:34, 26:34].reshape(-1, 3), axis=0)) == 1


def test_a_wide_picture_has_thicker_lines():
    mask = np.kron(MASK, np.ones((20, 20), np.uint16))
    picture = draw_masks(np.full((*mask.shape, 3), 200, np.uint8), mask)
    np.testing.assert_array_equal(picture[600, 402:406], [ORANGE] * 4)


def test_confidence_stands_beside_the_number_of_its_object_and_nowhere_else():
    color = np.full((60, 80, 3), 200, np.uint8)
    plain, sure = draw_masks(color, MASK), draw_masks(color, MASK, confidence={2: 0.97})
    np.testing.assert_array_equal(draw_masks(color, MASK, confidence={}), plain)
    changed = (plain != sure).any(-1)
    assert changed.any()
    assert np.nonzero(changed)[1].min() > 45  # the number 2 stands in the middle of its object, at 50
    assert not (
        draw_masks(color, MASK, numbers=False, confidence={2: 0.97}) != draw_masks(color, MASK, False)
    ).any()
