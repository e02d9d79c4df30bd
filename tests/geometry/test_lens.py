"""Lenses against OpenCV's own forward model, and pinholes, which change nothing."""

import cv2
import numpy as np
import pytest

from riseg_drake.geometry.camera import Intrinsics, rays
from riseg_drake.geometry.lens import Lens, grid_rays

K = Intrinsics(160, 120, 150.0, 152.0, 81.0, 58.0)
MATRIX = np.array([[150.0, 0, 81], [0, 152, 58], [0, 0, 1]])
BENT = Lens(K, (0.14, -0.45, 0.001, -0.0005, 0.4))
FISHEYE = Lens(K, (0.05, -0.02, 0.01, -0.003), fisheye=True)


def distorted(points, lens):
    zero, D = np.zeros(3), np.array(lens.distortion)
    if lens.fisheye:
        return cv2.fisheye.projectPoints(points.reshape(-1, 1, 3), zero, zero, MATRIX, D)[0].reshape(-1, 2)
    return cv2.projectPoints(points.reshape(-1, 3), zero, zero, MATRIX, D)[0].reshape(-1, 2)


@pytest.mark.parametrize("lens", [BENT, FISHEYE])
def test_the_ray_of_a_pixel_is_seen_in_that_pixel(lens):
    uv = np.stack(np.meshgrid(np.arange(160.0), np.arange(120.0)), axis=-1) + np.array([0.25, -0.5])
    directions = grid_rays(lens, 0.25, -0.5)
    assert directions.shape == (120, 160, 3)
    np.testing.assert_allclose(distorted(directions, lens), uv.reshape(-1, 2), atol=1e-5)


@pytest.mark.parametrize("lens", [BENT, FISHEYE])
def test_an_undistorted_image_shows_in_each_pixel_what_lies_on_its_ray(lens):
    v, u = np.mgrid[:120, :160].astype(np.float32)
    seen = lens.undistorted(np.stack([u, v], axis=-1))
    expected = distorted(rays(K).astype(np.float64), lens).reshape(120, 160, 2)
    inside = ((expected > 0) & (expected < (159, 119))).all(2)
    assert np.count_nonzero(inside) > 0.9 * inside.size
    # Between pixels OpenCV goes by steps of 1/32 px.
    np.testing.assert_allclose(seen[inside], expected[inside], atol=1 / 32)
    assert set(np.unique(lens.undistorted((u > 80).astype(np.uint8) * 7, nearest=True))) == {0, 7}


def test_a_pinhole_leaves_images_and_rays_as_they_are():
    image = np.zeros((120, 160), np.uint16)
    assert Lens(K, (0.0,) * 5).undistorted(image) is image
    np.testing.assert_allclose(grid_rays(Lens(K), 0.0, 0.0), rays(K), atol=1e-6)
