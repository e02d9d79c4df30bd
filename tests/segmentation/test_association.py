"""Whose are the pixels that move? One test for each rule, on label images drawn by hand."""

import numpy as np
import pytest

from riseg_drake.segmentation.association import (
    UNKNOWN,
    Association,
    AssociationParameters,
    KnownObjects,
    associate,
)

PIXELS_PER_METRE = 1000.0
EARLIER, NOW = 1, 2
"""Episodes of motion."""
CLEARLY = 5.0
"""Pixels by which two motions differ, where nothing else is said."""

LEFT = (slice(20, 60), slice(20, 60))
RIGHT = (slice(20, 60), slice(60, 100))
LOWER = (slice(80, 120), slice(20, 60))
RIM_OF_LEFT = (slice(20, 60), slice(60, 64))


def image(*patches: tuple[tuple, int]) -> np.ndarray:
    out = np.zeros((140, 140), np.uint16)
    for where, value in patches:
        out[where] = value
    return out


def decide(known, moving, born=None, previous=None, gap=None, next_id=None) -> Association:
    """The association of drawn labels; ids are born earlier unless `born` says otherwise."""
    ids = np.unique(known[(known > 0) & (known != UNKNOWN)]).tolist()
    born = {a: EARLIER for a in ids} | (born or {})
    groups = int(moving.max()) + 1
    motion_gap = CLEARLY * (1 - np.eye(groups)) if gap is None else np.array(gap)
    return associate(
        KnownObjects(known, born, next_id or max([0, *born]) + 1),
        moving.astype(np.int16),
        previous,
        motion_gap,
        NOW,
        PIXELS_PER_METRE,
        AssociationParameters(),
    )


def test_where_nothing_moves_everything_stays_as_it_was() -> None:
    known = image((LEFT, 3), (LOWER, UNKNOWN))
    after = decide(known, image(), gap=[[0.0]])
    np.testing.assert_array_equal(after.label, known)
    assert after.motion_of == {}
    assert (after.born, after.next_id) == ({3: EARLIER}, 4)


def test_a_known_object_moves_with_the_group_that_covers_it() -> None:
    known = image((LEFT, 3), (LOWER, 4))
    after = decide(known, image((LEFT, 2), (RIGHT, 1)))
    assert after.motion_of == {3: 1}
    np.testing.assert_array_equal(after.label, known)


def test_two_known_objects_that_move_together_keep_their_ids_and_share_the_motion() -> None:
    known = image((LEFT, 3), (RIGHT, 4))
    after = decide(known, image((LEFT, 1), (RIGHT, 1)))
    assert after.motion_of == {3: 0, 4: 0}
    np.testing.assert_array_equal(after.label, known)
    assert after.next_id == 5


def test_the_table_is_never_an_object() -> None:
    after = decide(image((LEFT, UNKNOWN)), image((LEFT, 1), (LOWER, 1)))
    assert not after.label[LOWER].any()


@pytest.mark.parametrize("rest", [0, 2], ids=["the rest stands still", "the rest moves otherwise"])
def test_a_known_object_whose_solid_part_moves_otherwise_was_two_and_the_larger_keeps_the_id(rest) -> None:
    part = (slice(20, 60), slice(45, 60))
    known = image((LEFT, 3))
    after = decide(known, image((LEFT, rest), (part, 1)))
    small, large = after.label[part], after.label[20:60, 20:45]
    assert (large == 3).all()
    assert len(np.unique(small)) == 1
    assert small[0, 0] not in (0, 3, UNKNOWN)
    assert after.born == {3: EARLIER, int(small[0, 0]): NOW}
    assert after.motion_of[int(small[0, 0])] == 0
    assert after.motion_of.get(3) == (None if rest == 0 else 1)


def test_the_larger_part_keeps_the_id_also_where_it_is_the_one_that_moves() -> None:
    still = (slice(20, 60), slice(45, 60))
    after = decide(image((LEFT, 3)), image((LEFT, 1), (still, 0)))
    assert (after.label[20:60, 20:45] == 3).all()
    assert 3 not in after.label[still]
    assert after.motion_of[3] == 0


def test_motions_that_hardly_differ_split_nothing() -> None:
    part = (slice(20, 60), slice(45, 60))
    known = image((LEFT, 3))
    after = decide(known, image((LEFT, 1), (part, 2)), gap=[[0, 5, 5], [5, 0, 0.5], [5, 0.5, 0]])
    np.testing.assert_array_equal(after.label, known)
    assert after.motion_of == {3: 0}


@pytest.mark.parametrize(
    "part",
    [(slice(20, 60), slice(56, 60)), (slice(30, 40), slice(30, 40))],
    ids=["a rim", "a small share"],
)
def test_a_rim_or_a_small_part_splits_nothing(part) -> None:
    known = image((LEFT, 3))
    after = decide(known, image((LEFT, 1), (part, 2)))
    np.testing.assert_array_equal(after.label, known)


def test_too_much_taken_in_this_episode_is_given_back_and_not_made_an_object() -> None:
    stayed = (slice(20, 60), slice(45, 60))
    after = decide(image((LEFT, 3)), image((LEFT, 1), (stayed, 0)), born={3: NOW})
    assert (after.label[stayed] == UNKNOWN).all()
    assert (after.label[20:60, 20:45] == 3).all()
    assert after.born == {3: NOW}


def test_unknown_pixels_that_move_with_an_object_of_this_episode_belong_to_it() -> None:
    after = decide(image((LEFT, 3), (RIGHT, UNKNOWN)), image((LEFT, 1), (RIGHT, 1)), born={3: NOW})
    assert (after.label[LEFT] == 3).all()
    assert (after.label[RIGHT] == 3).all()
    assert after.born == {3: NOW}


def test_unknown_pixels_that_move_with_an_object_of_an_earlier_episode_are_another_object() -> None:
    after = decide(image((LEFT, 3), (RIGHT, UNKNOWN)), image((LEFT, 1), (RIGHT, 1)))
    assert (after.label[LEFT] == 3).all()
    assert (after.label[RIGHT] == 4).all()
    assert after.born == {3: EARLIER, 4: NOW}
    assert after.motion_of == {3: 0, 4: 0}


def test_a_rim_that_moves_with_an_object_of_an_earlier_episode_is_part_of_it() -> None:
    after = decide(image((LEFT, 3), (RIM_OF_LEFT, UNKNOWN)), image((LEFT, 1), (RIM_OF_LEFT, 1)))
    assert (after.label[RIM_OF_LEFT] == 3).all()
    assert after.born == {3: EARLIER}


def test_a_rim_that_moves_alone_is_no_object() -> None:
    after = decide(image((RIM_OF_LEFT, UNKNOWN)), image((RIM_OF_LEFT, 1)))
    assert (after.label[RIM_OF_LEFT] == UNKNOWN).all()
    assert after.born == {}


def test_a_piece_smaller_than_the_least_area_is_no_object() -> None:
    speck = (slice(20, 34), slice(20, 34))
    after = decide(image((LEFT, UNKNOWN)), image((speck, 1)))
    assert (after.label[LEFT] == UNKNOWN).all()
    assert after.born == {}


def test_a_solid_unknown_piece_that_moves_is_a_new_object() -> None:
    after = decide(image((LEFT, UNKNOWN), (LOWER, UNKNOWN)), image((LEFT, 1)), next_id=7)
    assert (after.label[LEFT] == 7).all()
    assert (after.label[LOWER] == UNKNOWN).all()
    assert (after.born, after.motion_of, after.next_id) == ({7: NOW}, {7: 0}, 8)


def test_two_groups_are_two_new_objects_though_they_touch() -> None:
    after = decide(image((LEFT, UNKNOWN), (RIGHT, UNKNOWN)), image((LEFT, 1), (RIGHT, 2)))
    left, right = np.unique(after.label[LEFT]), np.unique(after.label[RIGHT])
    assert len(left) == len(right) == 1
    assert {int(left[0]), int(right[0])} == {1, 2}
    assert after.next_id == 3


def test_two_pieces_apart_that_move_alike_are_two_new_objects() -> None:
    after = decide(image((LEFT, UNKNOWN), (LOWER, UNKNOWN)), image((LEFT, 1), (LOWER, 1)))
    assert {int(after.label[30, 30]), int(after.label[90, 30])} == {1, 2}


def test_a_new_object_keeps_the_id_it_was_given_in_the_frame_before() -> None:
    known, moving = image((LEFT, UNKNOWN), (RIGHT, UNKNOWN)), image((LEFT, 1), (RIGHT, 2))
    # In the frame before the numbers were the other way round, and the outline a little different.
    previous = image(((slice(20, 58), slice(22, 60)), 9), ((slice(20, 60), slice(62, 100)), 8))
    after = decide(known, moving, previous=previous, next_id=8)
    assert (after.label[LEFT] == 9).all()
    assert (after.label[RIGHT] == 8).all()
    assert after.next_id == 10


def test_an_id_of_the_frame_before_goes_to_one_piece_only_to_the_larger() -> None:
    part = (slice(20, 60), slice(85, 100))
    moving = image((LEFT, 1), (RIGHT, 1), (part, 2))
    known = image((LEFT, UNKNOWN), (RIGHT, UNKNOWN))
    after = decide(known, moving, previous=image((LEFT, 8), (RIGHT, 8)), next_id=8)
    assert (after.label[LEFT] == 8).all()
    assert 8 not in after.label[part]


def test_a_known_id_of_the_frame_before_is_not_given_to_another_piece() -> None:
    previous = image((LEFT, 3), (RIGHT, 3))
    after = decide(image((LEFT, 3), (RIGHT, UNKNOWN)), image((RIGHT, 1)), previous=previous)
    assert (after.label[RIGHT] == 4).all()


def test_the_arguments_are_left_as_they_were() -> None:
    known = KnownObjects(image((LEFT, 3), (RIGHT, UNKNOWN)), {3: EARLIER}, 4)
    moving = image((LEFT, 1), (RIGHT, 1)).astype(np.int16)
    gap = CLEARLY * (1 - np.eye(2))
    associate(known, moving, None, gap, NOW, PIXELS_PER_METRE, AssociationParameters())
    np.testing.assert_array_equal(known.label, image((LEFT, 3), (RIGHT, UNKNOWN)))
    assert known.born == {3: EARLIER}
