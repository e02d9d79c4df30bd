"""What counts in a film: what is no object, the ids on what is one, and how well the best of them fits."""

import json

import numpy as np
import pytest

from riseg_drake.evaluation.film_scores import FilmScores, best_overlap, film_table
from riseg_drake.evaluation.true_things import ThingsError, true_things

SHAPE = (60, 80)


def square(v: int, u: int, side: int = 10) -> np.ndarray:
    mask = np.zeros(SHAPE, bool)
    mask[v : v + side, u : u + side] = True
    return mask


def things_of(tmp_path, content) -> list:
    (tmp_path / "things.json").write_text(json.dumps(content))
    return true_things(tmp_path)


@pytest.fixture
def box(tmp_path):
    corners = {"0": [[20, 20], [29, 20], [29, 29], [20, 29]], "10": [[40, 20], [49, 20], [49, 29], [40, 29]]}
    return things_of(tmp_path, {"things": {"box": {"settled_at": 2, "outline": corners}}})


def test_an_outline_holds_for_the_frames_that_are_nearest_to_its_own(box) -> None:
    (thing,) = box
    np.testing.assert_array_equal(thing.mask(4, SHAPE), square(20, 20))
    np.testing.assert_array_equal(thing.mask(6, SHAPE), square(20, 40))
    np.testing.assert_array_equal(thing.mask(30, SHAPE), square(20, 40))


def test_a_circle_goes_evenly_from_one_frame_to_the_next_and_ends_with_the_last(tmp_path) -> None:
    circles = {"10": [40, 20, 9], "0": [20, 30, 7]}
    (ball,) = things_of(tmp_path, {"things": {"ball": {"settled_at": 0, "circle": circles}}})
    mask = ball.mask(5, SHAPE)
    v, u = np.nonzero(mask)
    assert (u.mean(), v.mean()) == (30, 25)
    assert mask.sum() == pytest.approx(np.pi * 8**2, rel=0.03)
    assert ball.mask(11, SHAPE) is None


def test_of_a_recording_that_nobody_knows_nothing_moves_and_a_wrong_file_is_named(tmp_path) -> None:
    assert true_things(tmp_path) == []
    with pytest.raises(ThingsError, match=r"things\.json must hold .*ball has neither"):
        things_of(tmp_path, {"things": {"ball": {"settled_at": 0}}})


def test_an_id_that_lies_mostly_on_a_thing_is_not_false_and_another_one_is(box) -> None:
    scores = FilmScores(box)
    for number, extra in enumerate((0, 3, 0, 0)):
        mask = np.zeros(SHAPE, np.uint16)
        mask[square(20, 20)] = 1 if number < 3 else 2
        mask[square(45, 60, extra)] = 7
        scores.add(number, mask, None, 0.1)
    assert (scores.frames, scores.false_frames, scores.false_pixels) == (4, 1, 9)
    row = scores.as_dict()
    assert row["things"] == {"box": {"ids": 2, "iou": 1.0}}
    assert row["ms_a_frame"] == pytest.approx(100)


def labels(*squares) -> np.ndarray:
    """A mask with the ids 1, 2, ... in these squares."""
    mask = np.zeros(SHAPE, np.uint16)
    for number, each in enumerate(squares, start=1):
        mask[each] = number
    return mask


def test_a_thing_counts_from_the_frame_on_in_which_it_has_settled(box) -> None:
    scores = FilmScores(box)
    for number, mask in enumerate((labels(), labels(), labels(square(20, 20)), labels(square(20, 20, 5)))):
        scores.add(number, mask, None, 0.1)
    assert scores.of_thing["box"].overlaps == [1.0, 0.25]
    assert scores.as_dict()["things"]["box"]["iou"] == pytest.approx(0.625)
    unsettled = FilmScores(box)
    unsettled.add(1, labels(square(20, 20)), None, 0.1)
    assert unsettled.as_dict()["things"] == {"box": {"ids": 1, "iou": 0.0}}


def test_an_id_belongs_to_a_thing_if_more_than_half_of_it_lies_there(box) -> None:
    half, more = labels(square(20, 15)), labels(square(20, 16))
    for mask, false in ((half, 100), (more, 0)):
        scores = FilmScores(box)
        scores.add(0, mask, None, 0.1)
        assert scores.as_dict()["false_pixels_a_frame"] == false
        assert scores.as_dict()["frames_with_a_false_object"] == (false > 0)
        assert len(scores.of_thing["box"].found_ids) == (false == 0)


def test_false_pixels_are_over_all_frames_and_work_is_the_median(box) -> None:
    scores = FilmScores(box)
    for number, seconds in enumerate((0.01, 0.02, 0.9)):
        scores.add(number, labels(square(45, 60, 3 if number == 1 else 0)), None, seconds)
    row = scores.as_dict()
    assert row["frames"] == 3
    assert row["false_pixels_a_frame"] == 3
    assert row["ms_a_frame"] == pytest.approx(20)


def test_where_it_is_not_known_what_is_true_nothing_is_false(tmp_path) -> None:
    things = things_of(tmp_path, {"things": {"ball": {"settled_at": 0, "circle": {"3": [40, 20, 9]}}}})
    scores = FilmScores(things)
    for number in (3, 4):
        scores.add(number, labels(square(45, 60)), None, 0.1)
    assert (scores.frames, scores.false_frames, scores.false_pixels) == (2, 1, 100)
    assert scores.of_thing["ball"].overlaps == [0.0]


def test_a_thing_that_is_all_hidden_does_not_count(box) -> None:
    scores = FilmScores(box)
    scores.add(2, labels(), np.ones(SHAPE, bool), 0.1)
    assert scores.of_thing["box"].overlaps == []


def test_what_hands_hide_does_not_count(box) -> None:
    scores, mask = FilmScores(box), np.zeros(SHAPE, np.uint16)
    mask[square(20, 20)] = 1
    mask[:, 25:30] = 0
    hidden = np.zeros(SHAPE, bool)
    hidden[:, 25:30] = True
    scores.add(2, mask, hidden, 0.1)
    assert scores.as_dict()["things"]["box"]["iou"] == 1


def test_the_best_overlap_is_that_of_one_id_alone() -> None:
    mask = np.zeros(SHAPE, np.uint16)
    mask[square(20, 20)] = 1
    mask[20:30, 25:30] = 4
    assert best_overlap(mask, square(20, 20)) == 0.5
    assert best_overlap(np.zeros(SHAPE, np.uint16), square(20, 20)) == 0


def test_the_table_has_a_row_for_each_film(box) -> None:
    scores = FilmScores(box)
    scores.add(2, square(20, 20).astype(np.uint16), None, 0.05)
    scores.without_table = 3
    lines = film_table([("desk", FilmScores().as_dict()), ("pushed", scores.as_dict())])
    assert lines[2] == "| desk | 0 | 0 | 0 | 0 | - | - | 0 |"
    assert lines[3] == "| pushed | 1 | 3 | 0 | 0 | box 1 | box 1.00 | 50 |"
