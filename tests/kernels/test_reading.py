import cv2
import numpy as np
import pytest

from riseg_drake.geometry.camera import Intrinsics, project, rays
from riseg_drake.geometry.se3 import exp_se3, move_points
from riseg_drake.kernels.reading import between, nearest, projected
from riseg_drake.segmentation.expected_flow import pixel_projection

IMAGE = np.random.default_rng(0).uniform(0, 255, (12, 17)).astype(np.float32)
INSIDE = [(3.25, 4.5), (0.0, 0.0), (15.96875, 10.96875), (7.0, 3.5)]
"""(u, v), in 32nds of a pixel, at which OpenCV reads."""


@pytest.mark.parametrize(("u", "v"), INSIDE)
def test_between_pixels_it_reads_what_opencv_does(u, v):
    expected = cv2.remap(IMAGE, np.float32([[u]]), np.float32([[v]]), cv2.INTER_LINEAR)[0, 0]
    assert between(IMAGE, np.float32(u), np.float32(v)) == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize(("u", "v"), [(-0.1, 3), (3, -0.1), (16.0, 3), (3, 11.0), (np.nan, 3), (3, np.nan)])
def test_there_is_nothing_between_pixels_beyond_the_edges(u, v):
    assert np.isnan(between(IMAGE, np.float32(u), np.float32(v)))


def test_beside_a_pixel_that_says_nothing_there_is_nothing_between():
    image = IMAGE.copy()
    image[4, 5] = np.nan
    assert np.isnan(between(image, np.float32(4.5), np.float32(3.5)))
    assert np.isfinite(between(image, np.float32(3.5), np.float32(2.5)))


@pytest.mark.parametrize(("u", "v"), [(3.3, 4.6), (-0.4, 0.2), (16.4, 11.4), (7.9, 3.1)])
def test_the_nearest_pixel_is_the_rounded_one(u, v):
    assert nearest(IMAGE, np.float32(u), np.float32(v)) == IMAGE[round(v), round(u)]


@pytest.mark.parametrize(("u", "v"), [(-0.6, 3), (3, -0.6), (16.6, 3), (3, 11.6), (np.nan, 3)])
def test_beyond_the_edges_the_nearest_is_0(u, v):
    assert nearest(IMAGE, np.float32(u), np.float32(v)) == 0


def test_a_pixel_is_projected_to_where_its_point_is_seen():
    intrinsics = Intrinsics(640, 480, 600.0, 610.0, 320.0, 240.0)
    X_C1C0 = exp_se3(np.array([0.1, -0.2, 0.05, 0.03, 0.02, -0.05]))
    p_C1Q = move_points(X_C1C0, 0.7 * rays(intrinsics)[200, 100].astype(float)[None])
    pixel = np.array([[100], [200], [1], [1 / 0.7]], np.float32)
    u, v, growth = projected(pixel_projection(X_C1C0, intrinsics), pixel, 0)
    np.testing.assert_allclose([u, v], project(p_C1Q, intrinsics)[0], rtol=1e-5)
    assert growth * 0.7 == pytest.approx(p_C1Q[0, 2], rel=1e-5)
    behind = exp_se3(np.array([0, 0, 0, 0, 0, -1.0]))
    assert np.isnan(projected(pixel_projection(behind, intrinsics), pixel, 0)).all()
