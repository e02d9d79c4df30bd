import numpy as np

from riseg_drake.pushing.objects_to_segment import (
    ObjectsToSegmentParameters,
    objects_to_segment,
    things_to_push,
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


def test_what_has_moved_and_is_in_doubt_is_told_from_what_never_moved_by_its_id(drawn):
    drawn.box(0.4, 0.1, 0.04, 0.04, doubtful=3).box(0.5, 0.1, 0.016, 0.016, doubtful=4)
    drawn.box(0.5, -0.1, 0.04, 0.04).box(0.4, -0.1, 0.04, 0.04, segmented=True)
    table = drawn.map()
    unmoved, doubtful = things_to_push(table)
    np.testing.assert_array_equal(unmoved, (drawn.doubtful == 0) & drawn.objects & ~drawn.segmented)
    np.testing.assert_array_equal(doubtful, np.where(drawn.doubtful == 3, 3, 0))  # 4 is a speck
    # Told to take specks, they are taken.
    small = ObjectsToSegmentParameters(minimum_area=1e-4)
    np.testing.assert_array_equal(things_to_push(table, small)[1], drawn.doubtful)


def test_the_rim_of_a_known_thing_does_not_count_towards_the_smallest_area(drawn):
    # Beside it, of one width with it, 20 x 11 cells of 2 mm, of which three columns are rim.
    known, unknown = np.zeros((2, *drawn.objects.shape), bool)
    known[140:151, 100:130] = unknown[140:151, 130:150] = True
    drawn.put(known, 0.05, True).put(unknown, 0.05, False)
    enough = ObjectsToSegmentParameters(minimum_area=(17 * 11 - 0.5) * 4e-6)
    np.testing.assert_array_equal(objects_to_segment(drawn.map(), enough), unknown)
    too_much = ObjectsToSegmentParameters(minimum_area=(17 * 11 + 0.5) * 4e-6)
    assert not objects_to_segment(drawn.map(), too_much).any()
    wide = ObjectsToSegmentParameters(minimum_area=(14 * 11 - 0.5) * 4e-6, rim=0.0121)
    np.testing.assert_array_equal(objects_to_segment(drawn.map(), wide), unknown)


def test_what_is_in_doubt_is_a_thing_from_the_smallest_area_on_whatever_its_id_and_where_it_touches(drawn):
    # 1 and 2 touch and are of one width: each counts by itself, 1 with 10 x 12 cells of 2 mm, 2 with 12 fewer.
    one, two = np.zeros((2, *drawn.objects.shape), bool)
    one[140:150, 100:112] = two[150:159, 100:112] = True
    drawn.put(one, 0.05, False, 1).put(two, 0.05, False, 2)
    table = drawn.map()
    exactly = ObjectsToSegmentParameters(minimum_area=120 * table.cell_area)
    unmoved, doubtful = things_to_push(table, exactly)
    assert not unmoved.any()
    np.testing.assert_array_equal(doubtful, np.where(one, 1, 0))
    more = ObjectsToSegmentParameters(minimum_area=120.5 * table.cell_area)
    assert not things_to_push(table, more)[1].any()
    less = ObjectsToSegmentParameters(minimum_area=108 * table.cell_area)
    np.testing.assert_array_equal(things_to_push(table, less)[1], drawn.doubtful)
