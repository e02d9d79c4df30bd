from io import BytesIO

import numpy as np
import pytest
from PIL import Image

from riseg_drake.pictures.animation import film, side_by_side


def frames_of(content):
    image = Image.open(BytesIO(content))
    for number in range(image.n_frames):
        image.seek(number)
        yield np.asarray(image.convert("RGB")).astype(int), image.info["duration"]


def moving_square(count):
    for k in range(count):
        picture = np.full((40, 60, 3), 184, np.uint8)
        picture[10:20, 3 * k : 3 * k + 10] = (230, 159, 0)
        yield picture


def test_a_film_shows_every_picture_in_its_colours():
    pictures = list(moving_square(8))
    shown = list(frames_of(film(pictures, 10)))
    assert len(shown) == 8
    for k, ((seen, _), picture) in enumerate(zip(shown, pictures, strict=True)):
        assert np.abs(seen - picture).mean() <= 3
        within = seen[13:17, 3 * k + 3 : 3 * k + 7]  # colours have half the resolution: borders are soft
        np.testing.assert_allclose(within.mean(axis=(0, 1)), (230, 159, 0), atol=12)


def test_a_film_begins_again():
    assert Image.open(BytesIO(film(list(moving_square(3)), 10))).info["loop"] == 0


def test_the_last_picture_stays():
    durations = [duration for _, duration in frames_of(film(list(moving_square(3)), 10, last=2.0))]
    assert durations == pytest.approx([100, 100, 2100])


def test_two_views_stand_side_by_side_above_their_captions():
    left, right = np.full((480, 640, 3), 100, np.uint8), np.full((480, 640, 3), 200, np.uint8)
    page = side_by_side(left, right, ("one", "two"), 404)
    assert page.shape[1] == 404
    np.testing.assert_array_equal(page[:150, :200], 100)
    np.testing.assert_array_equal(page[:150, 204:], 200)
    assert page[152:, :200].min() < 150
    assert page[152:, 204:].min() < 150
