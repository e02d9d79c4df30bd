"""Pixels sought in another view, against projection point by point."""

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw

from riseg_drake.geometry.camera import Intrinsics, project
from riseg_drake.segmentation.surface import seek, surface_pixels

CAMERA = Intrinsics(64, 48, 60.0, 61.0, 30.5, 24.25)
RNG = np.random.default_rng(0)
DEPTH = RNG.uniform(0.4, 0.8, CAMERA.shape).astype(np.float32)
MASK = RNG.uniform(size=CAMERA.shape) < 0.3


def test_only_masked_pixels_with_depth_are_taken_row_by_row() -> None:
    depth = DEPTH.copy()
    depth[:10] = 0
    pixels = surface_pixels(MASK, depth, CAMERA)
    np.testing.assert_array_equal(pixels.pixel.T, np.argwhere(MASK & (depth > 0)))
    np.testing.assert_array_equal(pixels.depth, depth[MASK & (depth > 0)])


def test_points_are_sought_where_they_project_to() -> None:
    X = RigidTransform(RollPitchYaw(0.05, -0.1, 0.3), [0.02, -0.01, 0.05])
    pixels = surface_pixels(MASK, DEPTH, CAMERA)
    sought = seek(pixels, X.GetAsMatrix4())
    v, u = pixels.pixel
    rays = np.stack([(u - 30.5) / 60.0, (v - 24.25) / 61.0, np.ones(len(u))], axis=1)
    p_C1Q = (X @ (rays * pixels.depth[:, None]).T).T
    found = np.stack([sought.u.ravel(), sought.v.ravel()], axis=1)[: len(pixels)]
    np.testing.assert_allclose(found, project(p_C1Q, CAMERA), atol=1e-3)
    np.testing.assert_allclose(sought.depth, p_C1Q[:, 2], rtol=1e-5)


def test_standing_still_reads_back_each_pixels_own_value() -> None:
    pixels = surface_pixels(MASK, DEPTH, CAMERA)
    sought = seek(pixels, np.eye(4))
    np.testing.assert_array_equal(sought.read(DEPTH), pixels.depth)


def test_outside_the_other_view_and_behind_it_there_is_nothing_to_read() -> None:
    pixels = surface_pixels(MASK, DEPTH, CAMERA)
    for p in ([10.0, 0, 0], [0, 0, -1.0]):
        sought = seek(pixels, RigidTransform(p).GetAsMatrix4())
        assert not sought.read(DEPTH).any()
        assert np.isnan(sought.read_between(DEPTH)).all()


def test_what_an_image_shows_is_what_can_be_read_between_its_pixels() -> None:
    pixels = surface_pixels(MASK, DEPTH, CAMERA)
    for x in (0.0, 0.1, 0.2, 10.0):
        sought = seek(pixels, RigidTransform([x, 0.01, 0]).GetAsMatrix4())
        readable = np.isfinite(sought.read_between(np.ones_like(DEPTH)))
        # OpenCV reads between 32 steps a pixel.
        u, v = (k.ravel()[: len(pixels)] for k in (sought.u, sought.v))
        edges = np.array([u, v, u - (CAMERA.width - 1), v - (CAMERA.height - 1)])
        clear = np.abs(edges).min(0) > 1 / 16
        np.testing.assert_array_equal(sought.inside(CAMERA.shape)[clear], readable[clear])


def test_a_point_of_twice_the_depth_appears_where_it_projects_to() -> None:
    pixels = surface_pixels(MASK, DEPTH, CAMERA)
    X = RigidTransform(RollPitchYaw(0.02, -0.03, 0.1), [0.01, 0.02, -0.03]).GetAsMatrix4()
    far = seek(surface_pixels(MASK, 2 * DEPTH, CAMERA), X)
    found = seek(pixels, X, depth_factor=2.0)
    for one, other in ((found.u, far.u), (found.v, far.v)):
        np.testing.assert_allclose(one.ravel()[: len(pixels)], other.ravel()[: len(pixels)], atol=1e-3)
    np.testing.assert_allclose(found.depth, far.depth, rtol=1e-6)


def test_beside_a_value_that_is_not_known_nothing_is_read_between_pixels() -> None:
    image = DEPTH.copy()
    image[20:30, 20:30] = np.nan
    sought = seek(surface_pixels(MASK, DEPTH, CAMERA), RigidTransform([0.003, 0, 0]).GetAsMatrix4())
    values = sought.read_between(image)
    touches = (np.abs(sought.u - 24.5) < 5) & (np.abs(sought.v - 24.5) < 5)
    assert np.isnan(values[touches.ravel()[: len(values)]]).all()


def test_a_view_without_such_pixels_can_be_asked_too() -> None:
    sought = seek(surface_pixels(MASK & False, DEPTH, CAMERA), np.eye(4))
    assert len(sought.read(DEPTH)) == 0
