from io import BytesIO

import numpy as np
import pytest
from PIL import Image

from riseg_drake.pictures.animation import gif, side_by_side
from riseg_drake.pictures.object_colors import object_colors


def frames_of(content):
    image = Image.open(BytesIO(content))
    for number in range(image.n_frames):
        image.seek(number)
        yield np.asarray(image.convert("RGB")).astype(int), image.info["duration"]


def moving_square(count, noise=0.0):
    rng = np.random.default_rng(0)
    for k in range(count):
        picture = np.full((40, 60, 3), 184.0)  # noise crosses from one colour of the palette to the next
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


def test_the_first_objects_have_their_own_colours_to_the_bit():
    x, y = np.meshgrid(np.linspace(0, 255, 600), np.linspace(0, 200, 400))
    picture = np.stack([x, y, 0.5 * x], axis=-1).astype(np.uint8)
    picture[100, 100:112] = object_colors(np.arange(1, 13))
    ((seen, _),) = frames_of(gif([picture], 10))
    np.testing.assert_array_equal(seen[100, 100:112], object_colors(np.arange(1, 13)))


def test_a_large_table_does_not_use_up_the_palette():
    table = np.random.default_rng(0).normal(180, 12, (400, 600, 3))
    x, y = np.meshgrid(np.linspace(0, 255, 40), np.linspace(0, 255, 40))
    table[100:140, 100:140] = np.stack([x, y, 255 - x], axis=-1)
    picture = table.clip(0, 255).astype(np.uint8)
    ((seen, _),) = frames_of(gif([picture], 10))
    assert np.abs(seen - picture)[100:140, 100:140].max(axis=-1).mean() < 30


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
