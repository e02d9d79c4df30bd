from dataclasses import dataclass, field

import numpy as np
import pytest

from riseg_drake.segmentation.border_prior import BorderPriorParameters
from riseg_drake.segmentation.observation import ObservationParameters
from riseg_drake.segmentation.partition import (
    Margins,
    PartitionParameters,
    apart,
    as_tested,
    margins,
    motions_of_parts,
    partition,
    redrawn,
    with_ids,
)


@dataclass
class Row:
    """Five superpixels in a row, 10 pixels each; an object has at least `least` pixels."""

    least: int = 10
    count: int = 5
    borders: np.ndarray = field(default_factory=lambda: np.array([[0, 1], [1, 2], [2, 3], [3, 4]]))
    length: np.ndarray = field(default_factory=lambda: np.ones(4))
    area: np.ndarray = field(default_factory=lambda: np.full(5, 10))
    across: np.ndarray = field(default_factory=lambda: np.zeros(4, bool))

    @property
    def pixels_per_metre(self) -> float:
        return float(np.sqrt(self.least / PartitionParameters().area_min))


def test_a_border_counts_by_its_length():
    row = Row()
    row.borders = np.array([[0, 1], [0, 2], [1, 2], [3, 4]])
    row.length = np.array([1.0, 3.0, 1.0, 1.0])
    # 2 is bound to 1 by 1 and held off 0 by 3 x 0.4: together they lose 0.2.
    part = partition(row, np.array([2.0, -0.4, 1.0, 1.0]), PartitionParameters())
    np.testing.assert_array_equal(part, [0, 0, 1, 2, 2])


def test_what_is_too_small_joins_the_neighbour_it_is_bound_to_most():
    bond = np.array([3.0, -2.0, -1.0, 3.0])
    np.testing.assert_array_equal(partition(Row(least=10), bond, PartitionParameters()), [0, 0, 1, 2, 2])
    np.testing.assert_array_equal(partition(Row(least=11), bond, PartitionParameters()), [0, 0, 1, 1, 1])


@pytest.mark.parametrize(("bond", "part"), [(-1.0, 1), (0.1, 0)])
def test_what_is_too_small_stays_alone_across_a_gap_unless_something_says_that_both_are_one(bond, part):
    row = Row(least=11, across=np.array([False, False, False, True]))
    np.testing.assert_array_equal(
        partition(row, np.array([3.0, 3.0, 3.0, bond]), PartitionParameters()), [0, 0, 0, 0, part]
    )


def test_small_parts_grow_until_they_are_large_enough():
    part = partition(Row(least=25), np.array([-1.0, -2.0, -3.0, -4.0]), PartitionParameters())
    # 0 joins 1, that is still too small and joins 2; 3 is pulled to that as well, and 4 to it.
    assert part.max() == 0


def test_that_two_parts_have_no_one_motion_is_remembered_at_all_borders_between_them():
    nats = np.array([[0.0, 0.0, 0.0, 70.0, 0.0], [50.0, 14.0, 0.0, 0.0, 0.0]])
    row, part = Row(), np.array([0, 0, 0, 1, 1])
    row.length = np.array([1.0, 1.0, 8.0, 1.0])
    # One motion for both would cost min(70, 64) = 64 nats, 4 more than are free, over a border of 8.
    evidence = apart(row, part, nats, PartitionParameters(rigid_min=60.0))
    np.testing.assert_allclose(evidence, [0, 0, -0.5, 0])
    assert not apart(row, part, nats, PartitionParameters(rigid_min=64.0)).any()
    most = apart(row, part, nats, PartitionParameters(rigid_min=0.0, most_apart=2.0))
    np.testing.assert_allclose(most, [0, 0, -2.0, 0])


def test_what_has_parted_outlives_the_best_of_pictures_and_one_push_along():
    along = np.log(1 / ObservationParameters().along)
    assert PartitionParameters().most_apart > BorderPriorParameters().most + along
    assert PartitionParameters().most_apart < BorderPriorParameters().most + 2 * along


def test_two_with_motions_of_their_own_are_two_though_the_border_says_one():
    nats = np.array([[0.0, 0.0, 0.0, 0.0, 70.0], [70.0, 0.0, 0.0, 0.0, 0.0]])
    bond = np.array([3.0, 3.0, 0.5, 3.0])
    assert partition(Row(), bond, PartitionParameters()).max() == 0
    np.testing.assert_array_equal(partition(Row(), bond, PartitionParameters(), nats=nats), [0, 0, 0, 1, 1])


def test_a_part_moves_where_two_sure_superpixels_say_so():
    nats = np.array([[4.0, 4.1, 0.0, 4.0, 3.9], [0.0] * 5])
    motion = motions_of_parts(np.array([0, 0, 0, 1, 1]), nats, PartitionParameters())
    np.testing.assert_array_equal(motion, [1, 0])


@pytest.mark.parametrize("mirrored", [False, True])
def test_an_outline_goes_where_the_motions_part_and_not_where_the_picture_does(mirrored):
    # 0 and 1 did the first, 2 to 4 the second: 2 says so by 3 nats, and to cut there costs only 1 more.
    nats = np.array([[0.0, 0.0, 3.0, 20.0, 20.0], [20.0, 20.0, 0.0, 0.0, 0.0]])
    weight, part, right = np.array([5.0, 0.5, -0.5, 5.0]), np.array([0, 0, 0, 1, 1]), [0, 0, 1, 1, 1]
    if mirrored:
        nats, weight, part, right = nats[:, ::-1], weight[::-1], 1 - part[::-1], [0, 0, 0, 1, 1]
    row, parameters = Row(), PartitionParameters()
    np.testing.assert_array_equal(redrawn(part, row.borders, weight, nats, parameters), right)
    # 4 nats more for the cut are too many.
    weight = np.where(weight == 0.5, 4.5, weight)
    np.testing.assert_array_equal(redrawn(part, row.borders, weight, nats, parameters), part)


def test_parts_beside_none_of_another_motion_stay_and_the_others_are_redrawn_as_if_alone():
    # The row of before, 3 to 7 now, behind three parts that stand still as its first one does: none of them is
    # beside what moves.
    nats = np.array([[0.0, 0, 0, 0, 0, 3.0, 20.0, 20.0], [20.0, 20, 20, 20, 20, 0, 0, 0]])
    borders = np.array([[k, k + 1] for k in range(7)])
    weight = np.array([-1.0, -1.0, -1.0, 5.0, 0.5, -0.5, 5.0])
    part = np.array([0, 1, 2, 3, 3, 3, 4, 4])
    found = redrawn(part, borders, weight, nats, PartitionParameters())
    np.testing.assert_array_equal(found, [0, 1, 2, 3, 3, 4, 4, 4])


def test_parts_of_one_motion_keep_their_outline():
    nats = np.array([[9.0] * 5, [0.0] * 5])
    part = np.array([0, 0, 0, 1, 1])
    bond = np.array([-1.0, -9.0, 9.0, -1.0])
    np.testing.assert_array_equal(redrawn(part, Row().borders, bond, nats, PartitionParameters()), part)


def test_a_part_has_the_one_motion_that_explains_all_of_it():
    # Each superpixel has a motion that explains it, the second to one half, the third to the other; the fourth
    # explains none best and all well: 3 + 3 + 3 against 4 + 4 + 0 and 0 + 0 + 40.
    nats = np.array([[20.0, 20.0, 20.0], [0.0, 0.0, 40.0], [40.0, 40.0, 0.0], [3.0, 3.0, 3.0]])
    assert motions_of_parts(np.zeros(3, int), nats, PartitionParameters()) == [3]


def test_blank_superpixels_do_not_outvote_those_that_saw_it_move():
    nats = np.zeros((2, 103))
    nats[0, :3] = 4.0
    assert motions_of_parts(np.zeros(103, int), nats, PartitionParameters()) == [1]


def test_the_larger_part_of_what_was_one_keeps_its_id():
    part, area = np.array([0, 0, 0, 1, 1]), np.full(5, 10)
    ids, following = with_ids(part, np.array([True, True]), area, [np.full(5, 7)], 9)
    np.testing.assert_array_equal(ids, [7, 7, 7, 9, 9])
    assert following == 10


def test_of_two_that_turn_out_to_be_one_the_larger_gives_the_id():
    ids, following = with_ids(
        np.zeros(5, int), np.array([True]), np.full(5, 10), [np.array([3, 3, 8, 8, 8])], 9
    )
    np.testing.assert_array_equal(ids, [8] * 5)
    assert following == 9


def test_what_has_not_moved_has_no_id():
    ids, _ = with_ids(np.array([0, 0, 1, 1, 1]), np.array([False, True]), np.full(5, 10), [np.zeros(5, int)], 1)
    np.testing.assert_array_equal(ids, [0, 0, 1, 1, 1])


def test_what_was_believed_binds_more_than_what_the_frame_before_said():
    believed, said = np.array([2, 2, 0, 0, 0]), np.array([5, 5, 2, 2, 2])
    part = np.array([0, 0, 1, 1, 1])
    ids, following = with_ids(part, np.array([True, True]), np.full(5, 10), [believed, said], 6)
    np.testing.assert_array_equal(ids, [2, 2, 6, 6, 6])
    assert following == 7


def test_the_margin_is_what_the_weakest_seam_withstands():
    parameters = PartitionParameters(margins=[0.5, 1.0, 2.0, 4.0])
    # One body whose seam between 2 and 3 is worth 0.8 nats: it holds at 0.5 and falls apart at 1.
    body = np.ones(5, int)
    sure = margins(Row(), np.array([9.0, 9.0, 0.8, 9.0]), body, parameters)
    assert (sure.whole, sure.alone, sure.least) == ({1: 1.0}, {1: 8.0}, {1: 1.0})
    assert margins(Row(), np.array([9.0, 9.0, 9.0, 9.0]), body, parameters).least == {1: 8.0}


def test_two_that_nearly_merge_are_both_in_doubt():
    parameters = PartitionParameters(margins=[0.5, 1.0, 2.0, 4.0])
    body = np.array([1, 1, 1, 2, 2])
    sure = margins(Row(), np.array([9.0, 9.0, -0.4, 9.0]), body, parameters)
    assert (sure.whole, sure.alone) == ({1: 8.0, 2: 8.0}, {1: 0.5, 2: 0.5})
    assert sure.least == {1: 0.5, 2: 0.5}
    # Merging with what has not moved is no doubt about which objects there are.
    body = np.array([1, 1, 1, 0, 0])
    assert margins(Row(), np.array([9.0, 9.0, -0.4, 9.0]), body, parameters).least[1] == 8.0


@pytest.mark.parametrize("mirrored", [False, True])
def test_parts_do_not_depend_on_which_end_is_first(mirrored):
    bond = np.array([2.0, -1.0, 0.5, 3.0])
    part = partition(Row(), bond[::-1] if mirrored else bond, PartitionParameters())
    sizes = [np.count_nonzero(part == p) for p in part]
    assert sizes == ([3, 3, 3, 2, 2] if mirrored else [2, 2, 3, 3, 3])


def test_what_stood_still_is_as_whole_as_it_was_and_what_it_may_merge_with_is_asked_anew():
    before = Margins(whole={1: 1.0, 2: 1.0, 3: 4.0, 5: 2.0}, alone={1: 0.5, 3: 4.0})
    now = Margins(whole={1: 1.5, 2: 1.5, 3: 0.5, 4: 3.0}, alone={1: 2.0, 2: 4.0, 3: 1.0, 4: 4.0})
    told = as_tested(now, before, {2})
    assert told.whole == {1: 1.0, 2: 1.5, 3: 4.0, 4: 3.0}
    assert told.alone == now.alone
    assert told.least == {1: 1.0, 2: 1.5, 3: 1.0, 4: 3.0}


@pytest.mark.parametrize(("least", "margin"), [(10, 0.5), (11, 8.0)])
def test_less_of_a_body_than_an_object_that_may_be_something_else_s_is_no_doubt_about_it(least, margin):
    # 2 goes with what has not moved as soon as bonds are a little weaker: 10 pixels of 30.
    parameters = PartitionParameters(margins=[0.5, 1.0, 2.0, 4.0])
    bond, body = np.array([9.0, 0.3, 9.0, 9.0]), np.array([1, 1, 1, 0, 0])
    assert margins(Row(least=least), bond, body, parameters).least == {1: margin}


def test_what_was_told_apart_stays_two_though_all_between_would_join_both():
    # 0 and 1 are known as one body, 3 and 4 as another; 2 came into sight between them.
    bond, known = np.full(4, 2.0), np.array([[0.0, 0.0, 0.0, 10.0, 10.0], [10.0, 10.0, 0.0, 0.0, 0.0]])
    assert partition(Row(), bond, PartitionParameters()).max() == 0
    part = partition(Row(), bond, PartitionParameters(), known)
    np.testing.assert_array_equal(part[[0, 1, 3, 4]], [part[0], part[0], part[4], part[4]])
    assert part[0] != part[4]
    # No bond is strong enough then to put it in doubt.
    body, bond = np.array([1, 1, 0, 2, 2]), np.array([9.0, -0.4, -0.4, 9.0])
    assert margins(Row(), bond, body, PartitionParameters()).alone == {1: 0.5, 2: 0.5}
    assert margins(Row(), bond, body, PartitionParameters(), known).alone == {1: 8.0, 2: 8.0}
