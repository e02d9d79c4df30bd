import numpy as np
import pytest

from riseg_drake.pictures.color_vision import (
    DEUTERANOPIA,
    PROTANOPIA,
    as_seen,
    linear_from_srgb,
    oklab_from_srgb,
    srgb_from_linear,
    srgb_from_oklab,
)

COLORS = np.random.default_rng(0).uniform(0, 1, (200, 3))
GRAYS = np.linspace(0, 1, 11)[:, None] * np.ones(3)


def test_there_and_back_gives_the_same_colour():
    np.testing.assert_allclose(srgb_from_linear(linear_from_srgb(COLORS)), COLORS, atol=1e-6)
    np.testing.assert_allclose(srgb_from_oklab(oklab_from_srgb(COLORS)), COLORS, atol=1e-6)


@pytest.mark.parametrize("vision", [PROTANOPIA, DEUTERANOPIA])
def test_the_colour_blind_see_gray_as_it_is(vision):
    np.testing.assert_allclose(as_seen(GRAYS, vision), GRAYS, atol=1e-3)


@pytest.mark.parametrize("vision", [PROTANOPIA, DEUTERANOPIA])
def test_red_and_green_look_alike_without_one_kind_of_cones_but_blue_does_not(vision):
    red, green, blue = (oklab_from_srgb(as_seen(c, vision))[1:] for c in 0.5 + 0.4 * np.eye(3))
    red_n, green_n = (oklab_from_srgb(c)[1:] for c in 0.5 + 0.4 * np.eye(3)[:2])
    assert np.linalg.norm(red - green) < 0.5 * np.linalg.norm(red_n - green_n)
    assert np.linalg.norm(blue - green) > 0.1


def test_oklab_has_the_published_values_of_white_and_red():
    np.testing.assert_allclose(oklab_from_srgb(np.ones(3)), [1, 0, 0], atol=1e-4)
    np.testing.assert_allclose(oklab_from_srgb(np.array([1.0, 0, 0])), [0.628, 0.225, 0.126], atol=1e-3)
