"""What may be one surface behind what stands before it, on heights drawn by hand."""

import numpy as np
import pytest

from riseg_drake.segmentation.occlusion import seen_in_pieces, with_occlusions
from riseg_drake.segmentation.superpixels import Superpixels, superpixels

LEVEL = 0.012


_SIDE = 5
"""Pixels of a superpixel."""
WIDE = 4
"""Superpixels that each strip is wide."""


def strips(heights: list[float], rows: int = 20) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Superpixels of 5 x 5 pixels in strips of 20 pixels, each so high, m (-1 is the table, NaN unknown).

    The label image, heights, where the table is seen, and the strip of each superpixel.
    """
    columns = WIDE * len(heights)
    high = np.repeat(np.array(heights, np.float32), WIDE)
    strip = np.tile(np.repeat(np.arange(len(heights)), WIDE), rows // _SIDE)
    number = np.arange(rows // _SIDE * columns).reshape(-1, columns)
    stands = np.tile(high >= 0, (rows // _SIDE, 1))
    kept = np.where(stands, np.cumsum(stands).reshape(stands.shape) - 1, -1)
    whole = np.ones((_SIDE, _SIDE))
    label = np.kron(kept, whole).astype(np.intp)
    height = np.kron(np.where(stands, high, 0.0), whole).astype(np.float32)
    table = np.kron(np.tile(high == -1, (len(number), 1)), whole).astype(bool)
    return label, height, table, strip[stands.ravel()]


def joined(heights: list[float], level: float = LEVEL) -> list[list[int]]:
    """The strips between which there are pairs."""
    *scene, strip = strips(heights)
    pairs, width = seen_in_pieces(*scene, level)
    assert (width > 0).all()
    return np.unique(np.sort(strip[pairs], axis=1), axis=0).tolist()


@pytest.mark.parametrize(
    ("heights", "expected"),
    [
        ([0.02, 0.05, 0.02], [[0, 2]]),  # a plate under a bar
        ([0.02, 0.05, 0.031], [[0, 2]]),  # within 12 mm
        ([0.02, 0.05, 0.033], []),
        ([0.033, 0.05, 0.02], []),
        ([0.02, 0.023, 0.018], []),  # nothing is in front
        ([0.05, 0.02, 0.05], []),  # a gap
        ([0.02, 0.05, -1, 0.05, 0.02], []),  # the table is seen between
        ([0.02, 0.04, 0.06, 0.04, 0.02], [[0, 4], [1, 3]]),
        ([0.02, 0.04, 0.06, 0.02], [[0, 3]]),  # what is at 0.04 ends behind
        ([0.02, 0.05, 0.02, 0.05, 0.02], [[0, 2], [2, 4]]),
        ([0.02, 0.05, 0.03, 0.05, 0.02], [[0, 2], [0, 4], [2, 4]]),  # or what is between is in front, too
        ([0.03, 0.05, 0.02, 0.05, 0.03], [[0, 2], [2, 4]]),  # which what is lower cannot be
        ([0.02, 0.03, 0.05, 0.025], [[0, 3], [1, 3]]),
    ],
)
def test_what_is_as_high_on_both_sides_of_what_is_in_front_may_be_one(
    heights: list[float], expected: list[list[int]]
) -> None:
    assert joined(heights) == expected


@pytest.mark.parametrize(("between", "expected"), [(-1, []), (np.nan, [[0, 4]])])
def test_a_hole_in_depth_is_no_table(between: float, expected: list[list[int]]) -> None:
    assert joined([0.02, 0.05, between, 0.05, 0.02]) == expected


def test_no_two_surfaces_are_on_one_level_if_none_is_asked_for() -> None:
    assert joined([0.02, 0.05, 0.02], level=0.0) == []


def test_a_face_that_is_seen_from_aside_rises_over_more_than_a_superpixel() -> None:
    label, height, table, strip = strips([0.02, 0.05, 0.02])
    height[:, 20:40] = 0.02 + 0.001 * np.arange(20)
    pairs, _ = seen_in_pieces(label, height, table, LEVEL)
    assert ((strip[pairs] == 0).any(1) & (strip[pairs] == 2).any(1)).any()


@pytest.mark.parametrize("degrees", range(0, 180, 15))
def test_a_thing_is_one_behind_another_in_whatever_direction_it_lies(degrees: int) -> None:
    """A ruler, 10 times as long as wide, under a box."""
    v, u = np.indices((200, 200)) - 99.5
    along = np.cos(np.radians(degrees)) * u + np.sin(np.radians(degrees)) * v
    beside = np.cos(np.radians(degrees)) * v - np.sin(np.radians(degrees)) * u
    ruler = (np.abs(along) < 90) & (np.abs(beside) < 9)
    box = np.maximum(np.abs(u), np.abs(v)) < 40
    height = np.where(box, 0.05, np.where(ruler, 0.005, 0.0)).astype(np.float32)
    color = np.zeros((200, 200, 3), np.uint8)
    cut = superpixels(color, height, ruler | box, 6)
    pairs, width = seen_in_pieces(cut.label, height, ~(ruler | box), LEVEL)
    centre = np.array([along[cut.label == n].mean() for n in range(cut.count)])
    assert (np.sign(centre[pairs]).prod(1) == -1).all()
    # All of what is seen beside the box has a part in it, and it is as wide as the ruler, about.
    assert 9 < width.sum() < 54


def test_superpixels_that_touch_keep_their_border_and_the_others_get_one() -> None:
    label, height, table, _ = strips([0.02, 0.05, 0.02])
    pairs, width = seen_in_pieces(label, height, table, LEVEL)
    none = np.zeros(len(pairs), bool)
    # Every other one touches, as at the end of what is in front.
    known = Superpixels(label, label.max() + 1, pairs[::2], np.full(len(pairs[::2]), 4.0), none[::2], none[::2])
    more = with_occlusions(known, height, table, LEVEL)
    np.testing.assert_array_equal(more.borders, pairs)
    np.testing.assert_array_equal(more.length[::2], known.length)
    np.testing.assert_array_equal(more.length[1::2], width[1::2])
    np.testing.assert_array_equal(more.behind, np.arange(len(pairs)) % 2 == 1)


def test_nothing_has_no_pairs() -> None:
    pairs, width = seen_in_pieces(
        np.full((20, 20), -1), np.zeros((20, 20), np.float32), np.ones((20, 20), bool), LEVEL
    )
    assert pairs.shape == (0, 2)
    assert width.shape == (0,)
