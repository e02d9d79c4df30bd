import numpy as np

from riseg_drake.pushing.objects_to_segment import (
    ObjectsToSegmentParameters,
    objects_to_segment,
)


def test_nothing_is_left_when_everything_is_segmented(drawn):
    table = drawn.box(0.5, 0.0, 0.05, 0.05, segmented=True).map()
    assert not objects_to_segment(table).any()


def test_sliver_along_a_segmented_object_does_not_count(drawn):
    drawn.box(0.5, 0.0, 0.062, 0.062)
    drawn.box(0.5, 0.0, 0.054, 0.054, segmented=True)  # 4 mm of rim, 9 cm^2 in all
    table = drawn.map()
    assert (table.objects & ~table.segmented).sum() * table.cell_area > 3e-4
    assert not objects_to_segment(table).any()


def test_speck_below_the_minimum_area_does_not_count(drawn):
    table = drawn.box(0.5, 0.0, 0.016, 0.016).map()
    assert not objects_to_segment(table).any()
    assert objects_to_segment(table, ObjectsToSegmentParameters(minimum_area=1.5e-4)).any()


def test_object_that_touches_a_segmented_one_keeps_its_whole_outline(drawn):
    drawn.box(0.5, 0.02, 0.04, 0.04)
    drawn.box(0.5, -0.0205, 0.04, 0.04, segmented=True)
    table = drawn.map()
    np.testing.assert_array_equal(objects_to_segment(table), table.objects & ~table.segmented)


def test_cells_without_depth_do_not_cut_an_object_into_specks(drawn):
    drawn.box(0.5, 0.0, 0.024, 0.024)
    line = np.abs(drawn.centres()[..., 0] - 0.5) < 0.001
    drawn.objects[line] = False
    assert objects_to_segment(drawn.map()).any()
