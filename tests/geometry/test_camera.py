"""The pinhole camera against its own equations."""

import numpy as np

from riseg_drake.geometry.camera import (
    Intrinsics,
    back_project,
    bounding_region,
    pixel_grid,
    project,
    rays_at,
)

CAMERA = Intrinsics(64, 48, 60.0, 61.0, 30.5, 24.25)


def test_projecting_what_was_back_projected_gives_the_pixel_grid() -> None:
    depth = np.random.default_rng(0).uniform(0.3, 2, CAMERA.shape).astype(np.float32)
    np.testing.assert_allclose(project(back_project(depth, CAMERA), CAMERA), pixel_grid(48, 64), atol=1e-4)


def test_the_principal_point_lies_on_the_optical_axis() -> None:
    np.testing.assert_allclose(rays_at(np.array([30.5, 24.25]), CAMERA), [0, 0, 1])


def test_points_behind_the_camera_have_no_pixel() -> None:
    points = np.array([[0.0, 0.0, 1.0], [0.1, 0.1, -1.0], [0.1, 0.1, 0.0]])
    pixel = project(points, CAMERA)
    assert np.isfinite(pixel[0]).all()
    assert np.isnan(pixel[1:]).all()


def test_invalid_depth_stays_at_the_origin() -> None:
    assert not back_project(np.zeros(CAMERA.shape, np.float32), CAMERA).any()


def test_the_bounding_region_is_tight_and_its_margin_stays_in_the_image() -> None:
    mask = np.zeros((10, 12), bool)
    mask[1:4, 5:7] = True
    assert mask[bounding_region(mask)].shape == (3, 2)
    assert mask[bounding_region(mask, margin=2)].shape == (6, 6)
