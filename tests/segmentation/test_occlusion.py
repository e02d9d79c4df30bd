"""What may be one surface behind what stands before it, on heights drawn by hand."""

import numpy as np
import pytest

from riseg_drake.segmentation.occlusion import seen_in_pieces
from riseg_drake.segmentation.superpixels import Superpixels, with_occlusions

LEVEL = 0.012


def strips(heights: list[float], rows: int = 20) -> tuple[np.ndarray, np.ndarray]:
    """Superpixels 0, 1, ... side by side, 10 pixels wide, and how high each is, m; -1 is the table."""
    label = np.repeat(np.arange(len(heights)), 10)
    high = np.array(heights, np.float32)
    label = np.where(high[label] < 0, -1, label)
    return np.tile(label, (rows, 1)), np.tile(np.repeat(np.maximum(high, 0), 10), (rows, 1))


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
    label, height = strips(heights)
    pairs, width = seen_in_pieces(label, height, LEVEL)
    np.testing.assert_array_equal(pairs, np.array(expected).reshape(-1, 2))
    np.testing.assert_array_equal(width, np.full(len(expected), 20.0))  # of 20 rows


def test_a_turned_or_mirrored_picture_has_the_same_pairs() -> None:
    label, height = strips([0.02, 0.04, 0.06, 0.04, 0.02])
    pairs, width = seen_in_pieces(label, height, LEVEL)
    for turn in (np.transpose, np.fliplr, np.flipud):
        other, same = seen_in_pieces(turn(label).copy(), turn(height).copy(), LEVEL)
        np.testing.assert_array_equal(other, pairs)
        np.testing.assert_array_equal(same, width)


def test_a_superpixel_on_both_sides_has_no_border_with_itself() -> None:
    label, height = strips([0.02, 0.05, 0.02])
    assert len(seen_in_pieces(np.where(label == 2, 0, label), height, LEVEL)[0]) == 0


def test_no_two_surfaces_are_on_one_level_if_none_is_asked_for() -> None:
    assert len(seen_in_pieces(*strips([0.02, 0.05, 0.02]), 0.0)[0]) == 0


def test_superpixels_that_touch_keep_their_border_and_the_others_get_one() -> None:
    label, height = strips([0.02, 0.05, 0.02])
    # The two outer ones touch at the bottom.
    label[16:, 10:15], label[16:, 15:20], height[16:] = 0, 2, 0.02
    touching = Superpixels(
        label, 3, np.array([[0, 1], [0, 2], [1, 2]]), np.array([21.0, 4.0, 21.0]), *np.zeros((2, 3), bool)
    )
    np.testing.assert_array_equal(with_occlusions(touching, height, LEVEL).behind, [False] * 3)
    np.testing.assert_array_equal(with_occlusions(touching, height, LEVEL).length, touching.length)
    apart = Superpixels(label, 3, np.array([[0, 1], [1, 2]]), np.array([21.0, 21.0]), *np.zeros((2, 2), bool))
    joined = with_occlusions(apart, height, LEVEL)
    np.testing.assert_array_equal(joined.borders, [[0, 1], [0, 2], [1, 2]])
    np.testing.assert_array_equal(joined.length, [21, 16, 21])
    np.testing.assert_array_equal(joined.behind, [False, True, False])
