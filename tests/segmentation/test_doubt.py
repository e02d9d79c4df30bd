"""Which objects are pushed once more, on drawn masks."""

import numpy as np

from riseg_drake.segmentation.doubt import DoubtParameters, doubtful_ids

PIXELS_PER_METRE = 1000.0


def two_squares(neck: int) -> np.ndarray:
    """Label 1: two squares of 4 cm, one beside the other, joined by a bar of `neck` mm."""
    label = np.zeros((60, 120), np.uint16)
    label[10:50, 10:50] = label[10:50, 60:100] = 1
    label[30 - neck // 2 : 30 + neck // 2, 50:60] = 1
    return label


def doubt(
    label: np.ndarray, episode: int = 0, moved: float = 10.0, before: frozenset = frozenset()
) -> frozenset:
    parameters = DoubtParameters(neck=0.012)
    return doubtful_ids(label, {1: 0}, episode, {1: moved}, before, PIXELS_PER_METRE, parameters)


def test_an_object_that_hangs_together_by_a_thin_neck_is_in_doubt() -> None:
    assert doubt(two_squares(neck=6)) == {1}


def test_an_object_with_a_stout_neck_is_not() -> None:
    assert doubt(two_squares(neck=24)) == frozenset()


def test_the_doubt_goes_when_it_moves_as_one_in_a_later_push() -> None:
    assert doubt(two_squares(neck=6), episode=1, before=frozenset({1})) == frozenset()


def test_the_doubt_stays_when_it_hardly_moves_in_a_later_push() -> None:
    assert doubt(two_squares(neck=6), episode=1, moved=1.0, before=frozenset({1})) == {1}


def test_an_id_that_was_not_needed_after_all_is_forgotten() -> None:
    assert doubt(two_squares(neck=24), before=frozenset({7})) == frozenset()
