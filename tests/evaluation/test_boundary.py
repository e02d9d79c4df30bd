import numpy as np
import pytest

from riseg_drake.evaluation.boundary import boundary_map, dilate, tolerance


@pytest.mark.parametrize(
    ("shape", "pixels"), [((480, 640), 3), ((480, 848), 3), ((60, 80), 1), ((720, 1280), 5)]
)
def test_tolerance_is_a_share_of_the_diagonal_rounded_up(shape, pixels):
    assert tolerance(shape) == pixels


def test_the_boundary_of_a_box_runs_inside_its_lower_right_and_outside_its_upper_left_edges():
    mask = np.zeros((6, 6), bool)
    mask[2:4, 2:4] = True
    expected = np.array(
        [
            [0, 0, 0, 0, 0, 0],
            [0, 1, 1, 1, 0, 0],
            [0, 1, 0, 1, 0, 0],
            [0, 1, 1, 1, 0, 0],
            [0, 0, 0, 0, 0, 0],
            [0, 0, 0, 0, 0, 0],
        ],
        bool,
    )
    np.testing.assert_array_equal(boundary_map(mask), expected)


def test_at_the_last_row_and_column_only_the_neighbour_along_the_edge_counts():
    mask = np.zeros((4, 4), bool)
    mask[2:, 2:] = True
    expected = np.array([[0, 0, 0, 0], [0, 1, 1, 1], [0, 1, 0, 0], [0, 1, 0, 0]], bool)
    np.testing.assert_array_equal(boundary_map(mask), expected)


def test_dilation_reaches_exactly_the_pixels_within_the_radius():
    point = np.zeros((11, 11), bool)
    point[5, 5] = True
    v, u = np.mgrid[:11, :11]
    np.testing.assert_array_equal(dilate(point, 3), (v - 5) ** 2 + (u - 5) ** 2 <= 9)
