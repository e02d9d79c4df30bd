"""Outlines by hand: where a thing is in a frame, and which files say so."""

import json

import numpy as np
import pytest

from riseg_drake.evaluation.true_things import ThingsError, TrueThing, true_things

SHAPE = (40, 60)
NONE = np.zeros((0, 4))


def written(folder, **things):
    folder.mkdir(exist_ok=True)
    (folder / "things.json").write_text(json.dumps({"things": things}))
    return true_things(folder)


def disk(u, v, radius):
    """Pixels at most a radius away."""
    at_v, at_u = np.mgrid[: SHAPE[0], : SHAPE[1]]
    return np.hypot(at_u - u, at_v - v) <= radius


@pytest.mark.parametrize(
    ("frame", "circle"),
    [
        (0, (10, 20, 5)),  # before the first it is where it will be
        (4, (10, 20, 5)),
        (6, (20, 15, 6)),
        (8, (30, 10, 7)),
        (9, (30, 11, 8)),
        (12, (30, 14, 11)),
    ],
)
def test_a_circle_goes_evenly_in_place_and_size_from_each_of_its_frames_to_the_next(tmp_path, frame, circle):
    circles = {"12": [30, 14, 11], "4": [10, 20, 5], "8": [30, 10, 7]}
    (ball,) = written(tmp_path, ball={"settled_at": 5, "circle": circles})
    np.testing.assert_array_equal(ball.mask(frame, SHAPE), disk(*circle))
    assert ball.settled_at == 5
    assert ball.outlines == {}


def test_a_circle_has_the_pixels_on_its_edge_and_ends_after_its_last_frame():
    ball = TrueThing("ball", 0, np.array([[2.0, 30, 20, 5]]), {})
    mask = ball.mask(2, SHAPE)
    assert [mask[20, 35], mask[20, 36], mask[24, 33], mask[25, 33]] == [True, False, True, False]
    assert ball.mask(3, SHAPE) is None


def test_frames_are_in_order_of_their_number_not_of_its_first_digit(tmp_path):
    (ball,) = written(tmp_path, ball={"settled_at": 0, "circle": {"10": [1, 2, 3], "9": [4, 5, 6]}})
    np.testing.assert_array_equal(ball.circles, [[9, 4, 5, 6], [10, 1, 2, 3]])


def test_an_outline_holds_from_half_way_before_its_frame_on(tmp_path):
    def box(u):
        return [[u, 10], [u + 4, 10], [u + 4, 12], [u, 12]]

    (thing,) = written(tmp_path, box={"settled_at": 3, "outline": {"2": box(10), "8": box(30)}})
    for frame, u in ((0, 10), (4, 10), (6, 30), (100, 30)):
        expected = np.zeros(SHAPE, bool)
        expected[10:13, u : u + 5] = True
        np.testing.assert_array_equal(thing.mask(frame, SHAPE), expected)
    assert thing.settled_at == 3
    assert thing.circles.shape == NONE.shape


def test_things_keep_their_names_and_their_order(tmp_path):
    about = {"settled_at": 0, "circle": {"0": [1, 2, 3]}}
    assert [thing.name for thing in written(tmp_path, pear=about, apple=about)] == ["pear", "apple"]


def test_a_film_that_this_project_knows_is_told_by_its_folders_name_behind_links_too(tmp_path):
    film, link = tmp_path / "ball_by_hand", tmp_path / "link"
    film.mkdir()
    link.symlink_to(film)
    names = [thing.name for thing in true_things(film)]
    assert names == [thing.name for thing in true_things(link)] != []
    assert true_things(tmp_path) == []


def test_what_lies_beside_the_film_comes_before_what_this_project_knows(tmp_path):
    (thing,) = written(tmp_path / "ball_by_hand", mine={"settled_at": 0, "circle": {"0": [1, 2, 3]}})
    assert thing.name == "mine"


@pytest.mark.parametrize(
    "content",
    [
        "no JSON",
        "[]",
        "{}",
        '{"things": []}',
        '{"things": {"a": 3}}',
        '{"things": {"a": {"settled_at": 0}}}',
        '{"things": {"a": {"circle": {"0": [1, 2, 3]}}}}',
        '{"things": {"a": {"settled_at": 0, "circle": {"x": [1, 2, 3]}}}}',
        '{"things": {"a": {"settled_at": 0, "circle": {"0": [1, 2]}}}}',
    ],
)
def test_a_file_that_is_none_of_things_is_named_in_one_line(tmp_path, content):
    (tmp_path / "things.json").write_text(content)
    with pytest.raises(ThingsError, match=r"things\.json must hold .*settled_at") as error:
        true_things(tmp_path)
    assert "\n" not in str(error.value)
