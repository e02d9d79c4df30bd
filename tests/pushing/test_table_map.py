from types import SimpleNamespace

import numpy as np
import pytest

from riseg_drake.geometry.rgbd import Frame
from riseg_drake.pushing.table_map import TableMapParameters, binarize_mask, map_table

FLAT = np.array([0.0, 0.0, 1.0, 0.0])


def map_of(view, mask=None, robot=None, parameters=None):
    mask = np.zeros_like(view.number) if mask is None else mask
    return map_table(frame_of(view, robot), above_in(view, FLAT), mask, parameters)


def frame_of(view, robot=None):
    robot = np.zeros(view.depth.shape, bool) if robot is None else robot
    color = np.zeros((*view.depth.shape, 3), np.uint8)
    return Frame(0, 0.0, view.intrinsics, color, view.depth, view.X_WC, robot)


def above_in(view, plane_W):
    return SimpleNamespace(mask=view.objects, height=view.height, plane_W=plane_W)


def test_binarized_mask_is_true_where_there_is_an_id():
    np.testing.assert_array_equal(binarize_mask(np.array([[0, 3], [65535, 0]])), [[0, 1], [1, 0]])


@pytest.mark.parametrize("tilt", [0.0, 0.25])
@pytest.mark.parametrize("place", [(0.5, 0.0), (0.42, 0.12), (0.58, -0.1)])
def test_outline_of_a_tall_box_is_its_true_one_wherever_the_camera_sees_it(view, place, tilt):
    x, y = place
    table = map_of(view([(x, y, 0.05, 0.03, 0.08)], tilt=tilt, x=0.5 - 0.5 * np.tan(tilt)))
    P = table.points(table.objects)
    np.testing.assert_allclose(P.min(axis=0), [x - 0.025, y - 0.015], atol=1.01 * table.cell)
    np.testing.assert_allclose(P.max(axis=0), [x + 0.025, y + 0.015], atol=1.01 * table.cell)
    assert table.objects.sum() * table.cell_area == pytest.approx(0.05 * 0.03, rel=0.12)
    assert table.height.max() == pytest.approx(0.08, abs=1e-4)


def test_cell_is_segmented_where_its_highest_point_has_an_id(view):
    seen = view([(0.5, 0.05, 0.04, 0.04, 0.05), (0.5, -0.05, 0.04, 0.04, 0.05)])
    table = map_of(seen, mask=np.where(seen.number == 2, 7, 0))
    assert table.lookup(table.segmented, np.array([0.5, -0.05]))
    assert not table.lookup(table.segmented, np.array([0.5, 0.05]))


def test_height_of_a_cell_is_that_of_its_highest_point(view):
    seen = view([(0.57, 0.1, 0.05, 0.05, 0.08)])  # off to the side: its flanks show
    table = map_of(seen, parameters=TableMapParameters(cell=0.02))
    assert (seen.height[seen.objects] < 0.05).any()
    heights = table.height[table.objects]
    assert np.count_nonzero(heights > 0.0799) >= 6
    assert np.count_nonzero(heights < 0.0799) <= 1


def test_what_a_box_hides_and_what_the_robot_covers_is_not_seen(view):
    seen = view([(0.5, 0.1, 0.05, 0.05, 0.1)])
    robot = np.zeros(seen.depth.shape, bool)
    robot[-60:] = True
    table = map_of(seen, robot=robot)
    assert table.lookup(table.seen, np.array([0.5, 0.0]))
    assert not table.lookup(table.seen, np.array([0.5, 0.135]))  # in the shadow
    assert not table.lookup(table.seen, np.array([0.33, 0.0]))  # under the robot


def test_lookup_outside_of_the_map_finds_nothing(drawn):
    table = drawn.box(0.5, 0.0, 1.0, 1.0).map()
    assert not table.lookup(table.objects, np.array([5.0, 0.0]))
    assert table.lookup(table.height, np.array([-1.0, 0.0])) == 0.0


def test_cells_are_no_finer_than_the_pixels(view):
    table = map_of(view([], z=2.0), parameters=TableMapParameters(cell=0.001))
    assert table.cell == pytest.approx(1.5 * 2.0 / 615.778, rel=1e-3)


def test_ground_follows_a_sloped_table(view):
    seen = view([])
    slope = np.array([-0.1, 0.0, 1.0, -0.02]) / np.hypot(1, 0.1)
    table = map_table(frame_of(seen), above_in(seen, slope), seen.number)
    assert table.ground(np.array([0.5, 0.3])) == pytest.approx(0.07)


@pytest.mark.parametrize("cell", [0.0033, 0.0047])
def test_the_map_covers_the_work_area_and_its_surround_and_no_cell_more(view, cell):
    parameters = TableMapParameters([0.3, 0.7, -0.2, 0.4], surround=0.05, cell=cell)
    table = map_of(view([]), parameters=parameters)
    np.testing.assert_allclose(table.origin_W, [0.25, -0.25])
    assert table.work_area_W == (0.3, 0.7, -0.2, 0.4)
    last = table.origin_W + table.cell * (np.array(table.objects.shape[::-1]) - 1)
    assert np.all((last >= [0.75, 0.45]) & (last < np.array([0.75, 0.45]) + table.cell))
    for array in (table.segmented, table.height, table.seen):
        assert array.shape == table.objects.shape


def test_a_cell_is_beside_free_ones_where_one_of_its_eight_neighbours_is_free(drawn):
    cells = np.zeros(drawn.objects.shape, bool)
    cells[100:110, 120:135] = True
    inner = np.zeros_like(cells)
    inner[101:109, 121:134] = True
    table = drawn.put(cells, 0.05, False).map()
    np.testing.assert_array_equal(table.beside_free, ~inner)
    assert table.to_object[100, 118] == pytest.approx(2 * 0.002, rel=0.01)
    np.testing.assert_array_equal(table.to_object[cells], 0)


def test_points_are_the_cells_centres_row_by_row_with_x_along_the_columns(drawn):
    cells = np.zeros(drawn.objects.shape, bool)
    cells[3, [5, 7]] = cells[4, 1] = True
    expected = np.array([[0.2, -0.3]]) + 0.002 * np.array([[5, 3], [7, 3], [1, 4]])
    np.testing.assert_allclose(drawn.map().points(cells), expected)
