"""Where one thing may lie on another, for heights that are known."""

import numpy as np
import pytest

from riseg_drake.segmentation.superpixels import Superpixels
from riseg_drake.segmentation.support import _reaching, in_a_hollow, may_lie_on

V, U = np.mgrid[:60, :60]
RADIUS = np.hypot(V - 30, U - 30)


def cut(label: np.ndarray) -> Superpixels:
    """Superpixels that touch from side to side and from above to below."""
    pairs = {
        (min(a, b), max(a, b))
        for one, other in ((label[1:], label[:-1]), (label[:, 1:], label[:, :-1]))
        for a, b in zip(one.ravel().tolist(), other.ravel().tolist(), strict=True)
        if a != b and min(a, b) >= 0
    }
    borders = np.array(sorted(pairs)).reshape(-1, 2)
    touch = np.zeros(len(borders), bool)
    return Superpixels(label, int(label.max()) + 1, borders, np.ones(len(borders)), touch, touch)


def halves_with(height_0: float, height_1: float) -> np.ndarray:
    return np.where(U < 30, height_0, height_1).astype(np.float32)


HALVES = cut((U >= 30).astype(np.intp))


@pytest.mark.parametrize(("step", "lies_on"), [(0.0, False), (0.0039, False), (0.0041, True), (0.05, True)])
def test_a_step_of_more_than_the_lowest_object_may_be_one_thing_on_another_whichever_side_is_higher(
    step, lies_on
):
    assert may_lie_on(HALVES, halves_with(0.03, 0.03 + step)) == [lies_on]
    assert may_lie_on(HALVES, halves_with(0.03 + step, 0.03)) == [lies_on]


def test_a_slope_is_no_step_however_steep():
    assert may_lie_on(HALVES, (0.003 * U).astype(np.float32)) == [False]


def test_a_slope_that_ends_at_a_step_is_one_with_it():
    # It rises by 1 mm a pixel and falls by 18 mm at the border: by 16 mm from two pixels before it.
    height = (0.02 + 0.001 * np.minimum(U, 29) - 0.018 * (U >= 30)).astype(np.float32)
    assert may_lie_on(HALVES, height) == [True]
    assert may_lie_on(HALVES, height[:, ::-1].copy()) == [True]


def test_a_wall_does_not_lie_on_the_floor_that_it_surrounds_nor_a_foot_on_what_surrounds_it():
    mug = np.where(RADIUS < 15, 0.01, np.where(RADIUS < 22, 0.09, 0.0)).astype(np.float32)
    label = np.where(RADIUS < 15, 0, np.where(RADIUS < 22, 1, -1))
    assert may_lie_on(cut(label), mug) == [False]
    foot = np.where(RADIUS < 15, 0.09, np.where(RADIUS < 22, 0.01, 0.0)).astype(np.float32)
    assert may_lie_on(cut(label), foot) == [False]


def test_what_sticks_out_over_the_edge_of_another_thing_may_lie_on_it():
    upper, lower = np.hypot(V - 30, U - 42) < 15, RADIUS < 22
    label = np.where(upper, 0, np.where(lower, 1, -1))
    height = np.where(upper, 0.05, np.where(lower, 0.01, 0.0)).astype(np.float32)
    assert may_lie_on(cut(label), height) == [True]
    # The picture's end may hide that it does.
    assert may_lie_on(cut(label[:, :34]), height[:, :34].copy()) == [True]
    # A foot as near to the edge as pixels are blurred sticks out, one that is farther from it does not.
    for distance, sticks_out in ((3, True), (7, False)):
        upper = np.hypot(V - 30, U - 30 - (22 - 8 - distance)) < 8
        label = np.where(upper, 0, np.where(lower, 1, -1))
        height = np.where(upper, 0.05, np.where(lower, 0.01, 0.0)).astype(np.float32)
        assert may_lie_on(cut(label), height) == [sticks_out]


def test_a_hollow_is_what_water_would_stay_in_up_to_its_lowest_rim():
    bowl = np.where(RADIUS < 10, 0.01, np.where(RADIUS < 20, 0.05, 0.0)).astype(np.float32)
    inside = RADIUS < 8  # to one of the two pixels that are asked as one
    assert in_a_hollow(bowl)[inside].all()
    assert not in_a_hollow(bowl)[RADIUS > 11].any()
    # A gap in the wall down to the floor lets it run off, one half way down does not.
    gap = (np.abs(V - 30) < 3) & (U > 30)
    for depth, holds in ((0.01, False), (0.03, True)):
        broken = np.where(gap & (bowl > 0.04), np.float32(depth), bowl)
        assert in_a_hollow(broken)[inside].all() == holds
        assert in_a_hollow(broken)[inside].any() == holds


def test_along_a_border_most_of_its_pixels_decide():
    for rows, lies_on in ((36, True), (24, False)):
        height = np.where((U >= 30) & (rows > V), 0.05, 0.03).astype(np.float32)
        assert may_lie_on(HALVES, height) == [lies_on]


def test_nothing_stands_nothing_lies():
    assert len(may_lie_on(cut(np.full((60, 60), -1)), np.zeros((60, 60), np.float32))) == 0


@pytest.mark.parametrize("turns", range(4))
@pytest.mark.parametrize(("apart", "connected"), [(5, True), (6, False)])
def test_places_twice_two_pixels_from_each_other_are_connected_in_every_direction(turns, apart, connected):
    contour, outside = np.zeros((2, 30, 30), bool)
    contour[15, 3] = contour[15, 3 + apart] = True  # the first within two pixels of the end, the other not
    reaching = np.rot90(_reaching(np.rot90(contour, turns).copy(), outside), -turns)
    assert reaching[15, 3]
    assert reaching[15, 3 + apart] == connected
    assert reaching.sum() == 1 + connected


@pytest.mark.parametrize("turns", range(4))
@pytest.mark.parametrize(("start", "reaches"), [(3, True), (4, False)])
def test_a_contour_reaches_the_pictures_end_or_the_outline_from_within_twice_two_pixels(turns, start, reaches):
    contour, outside = np.zeros((2, 30, 30), bool)
    contour[15, start] = True
    assert _reaching(np.rot90(contour, turns).copy(), outside).any() == reaches
    # As near to an outline: pixels up to column 9 are outside.
    contour, outside = np.zeros((2, 40, 40), bool)
    outside[:, :10], contour[20, 10 + start] = True, True
    turned = _reaching(np.rot90(contour, turns).copy(), np.rot90(outside, turns).copy())
    assert turned.any() == reaches
