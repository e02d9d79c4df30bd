from itertools import combinations

import numpy as np
import pytest
from skimage.color import deltaE_ciede2000, rgb2lab

from riseg_drake.pictures.color_vision import DEUTERANOPIA, NORMAL, PROTANOPIA, as_seen
from riseg_drake.pictures.object_colors import hex_color, object_colors

VISIONS = {"normal": NORMAL, "protanopia": PROTANOPIA, "deuteranopia": DEUTERANOPIA}


def closest(count, vision):
    """The smallest CIEDE2000 between two of the first colours; 1 can just be seen, 10 at a glance."""
    lab = rgb2lab(as_seen(object_colors(np.arange(1, count + 1)) / 255, vision))
    return min(float(deltaE_ciede2000(lab[a], lab[b])) for a, b in combinations(range(count), 2))


@pytest.mark.parametrize("vision", VISIONS.values(), ids=VISIONS)
def test_the_first_eight_colours_are_told_apart_at_a_glance_by_any_eyes(vision):
    assert closest(8, vision) > 10


@pytest.mark.parametrize("vision", VISIONS.values(), ids=VISIONS)
def test_sixteen_colours_can_still_be_told_apart(vision):
    assert closest(16, vision) > 5


def test_the_first_thirty_two_objects_have_colours_of_their_own():
    assert len(np.unique(object_colors(np.arange(1, 33)), axis=0)) == 32


def test_a_colour_belongs_to_the_id_and_not_to_its_company():
    alone, together = object_colors(np.array([5])), object_colors(np.array([1, 5, 9]))
    np.testing.assert_array_equal(alone[0], together[1])


def test_the_first_colours_are_those_of_okabe_and_ito():
    assert [hex_color(object_id) for object_id in (1, 4, 7)] == ["#e69f00", "#f0e442", "#cc79a7"]


def test_the_background_is_black():
    np.testing.assert_array_equal(object_colors(np.zeros((2, 3), np.uint16)), np.zeros((2, 3, 3)))
