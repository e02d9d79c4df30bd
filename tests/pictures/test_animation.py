from io import BytesIO

import numpy as np
import pytest
from PIL import Image

from riseg_drake.pictures.animation import gif, side_by_side


def frames_of(content):
    image = Image.open(BytesIO(content))
    for number in range(image.n_frames):
        image.seek(number)
        yield np.asarray(image.convert("RGB")).astype(int), image.info["duration"]


def moving_square(count, noise=0.0):
    rng = np.random.default_rng(0)
    for k in range(count):
        picture = np.full((40, 60, 3), 180.0)
        picture[10:20, 3 * k : 3 * k + 10] = (230, 159, 0)
        yield np.clip(picture + noise * rng.uniform(-1, 1, picture.shape), 0, 255).astype(np.uint8)


def test_a_gif_shows_every_picture_in_its_colours():
    pictures = list(moving_square(8))
    shown = list(frames_of(gif(pictures, 10)))
    assert len(shown) == 8
    for (seen, _), picture in zip(shown, pictures, strict=True):
        assert np.abs(seen - picture).max() <= 8


def test_noise_does_not_flicker():
    shown = [seen for seen, _ in frames_of(gif(list(moving_square(8, noise=2.0)), 10))]
    assert all(np.array_equal(seen[25:], shown[0][25:]) for seen in shown)


def test_a_small_thing_keeps_its_colour_beside_a_large_gradient():
    picture = np.repeat(np.linspace(0, 255, 400).astype(np.uint8)[None, :, None], 300, axis=0) * np.ones(
        3, np.uint8
    )
    picture[100:110, 100:110] = (204, 121, 167)
    ((seen, _),) = frames_of(gif([picture], 10))
    assert np.abs(seen[105, 105] - (204, 121, 167)).max() <= 12


def test_the_last_picture_stays():
    durations = [duration for _, duration in frames_of(gif(list(moving_square(3)), 10, last=2.0))]
    assert durations == pytest.approx([100, 100, 2100])


def test_two_views_stand_side_by_side_above_their_captions():
    left, right = np.full((480, 640, 3), 100, np.uint8), np.full((480, 640, 3), 200, np.uint8)
    page = side_by_side(left, right, ("one", "two"), 404)
    assert page.shape[1] == 404
    np.testing.assert_array_equal(page[:150, :200], 100)
    np.testing.assert_array_equal(page[:150, 204:], 200)
    assert page[152:, :200].min() < 150
    assert page[152:, 204:].min() < 150
