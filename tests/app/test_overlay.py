import numpy as np

from riseg_drake.app.overlay import draw_overlay, object_colors


def test_the_first_twenty_one_objects_have_colours_of_their_own():
    colors = object_colors(np.arange(1, 22))
    assert len(np.unique(colors, axis=0)) == 21


def test_a_colour_belongs_to_the_id_and_not_to_its_company():
    alone, together = object_colors(np.array([5])), object_colors(np.array([1, 5, 9]))
    np.testing.assert_array_equal(alone[0], together[1])


def test_background_stays_as_it_is_and_touching_objects_are_parted_by_their_outlines():
    color = np.full((60, 80, 3), 200, np.uint8)
    mask = np.zeros((60, 80), np.uint16)
    mask[20:40, 20:40] = 1
    mask[20:40, 40:60] = 2
    before = color.copy()
    picture = draw_overlay(color, mask)
    np.testing.assert_array_equal(picture[mask == 0], 200)
    np.testing.assert_array_equal(color, before)
    np.testing.assert_array_equal(picture[25, 39], object_colors(np.array(1)))
    np.testing.assert_array_equal(picture[22, 40], object_colors(np.array(2)))
