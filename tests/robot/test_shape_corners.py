"""Points whose hull is a shape: on it, and hardly a direction missed."""

import numpy as np
import pytest
from pydrake.geometry import Box, Capsule, Convex, Cylinder, Ellipsoid, HalfSpace, MeshcatCone, Sphere
from scipy.spatial import ConvexHull

from riseg_drake.robot.shape_corners import shape_corners


def as_set(points):
    return {tuple(point) for point in np.round(points, 9) + 0.0}


def test_a_box_has_its_corners():
    expected = [(x, y, z) for x in (-1, 1) for y in (-2, 2) for z in (-3, 3)]
    assert as_set(shape_corners(Box(2, 4, 6))) == set(expected)


@pytest.mark.parametrize("shape", [Sphere(0.3), Ellipsoid(0.1, 0.2, 0.3)])
def test_points_of_a_ball_are_on_it_and_hardly_a_direction_is_missed(shape):
    half = np.array([0.3] * 3 if isinstance(shape, Sphere) else [0.1, 0.2, 0.3])
    unit = shape_corners(shape) / half
    np.testing.assert_allclose(np.linalg.norm(unit, axis=1), 1.0)
    assert as_set(np.vstack([np.eye(3), -np.eye(3)])) <= as_set(unit)
    # 32 meridians and 15 circles of latitude: a direction is within 1/32 of a half turn of both.
    directions = np.random.default_rng(0).normal(size=(500, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    assert (directions @ unit.T).max(axis=1).min() >= np.cos(np.pi / 32) ** 2


def test_a_cylinder_has_two_rims():
    corners = shape_corners(Cylinder(radius=0.2, length=0.6))
    np.testing.assert_allclose(np.linalg.norm(corners[:, :2], axis=1), 0.2)
    for z in (-0.3, 0.3):
        rim = corners[corners[:, 2] == z, :2]
        # An inscribed polygon of n corners has the area n/2 sin(2 pi / n) r^2.
        assert ConvexHull(rim).volume == pytest.approx(16 * np.sin(2 * np.pi / 32) * 0.2**2)
    assert as_set(np.abs(corners[:, 2:])) == {(0.3,)}


def test_a_capsule_is_two_balls_apart():
    corners = shape_corners(Capsule(radius=0.2, length=0.6))
    for sign in (1, -1):
        cap = corners[sign * corners[:, 2] >= 0.3] - [0, 0, sign * 0.3]
        np.testing.assert_allclose(np.linalg.norm(cap, axis=1), 0.2)
    assert as_set(corners) == as_set(-corners)
    assert {(0, 0, 0.5), (0.2, 0, 0.3), (0, 0.2, 0.3), (0.2, 0, -0.3)} <= as_set(corners)


def test_a_mesh_has_the_corners_of_its_hull(tmp_path):
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0.1, 0.1, 0.1]])
    lines = [f"v {x} {y} {z}\n" for x, y, z in points]
    faces = ["f 1 3 2\n", "f 1 2 4\n", "f 1 4 3\n", "f 2 3 5\n", "f 3 4 5\n", "f 4 2 5\n"]
    (tmp_path / "dented.obj").write_text("".join(lines + faces))
    assert as_set(shape_corners(Convex(str(tmp_path / "dented.obj"), 2.0))) == as_set(2 * points[:4])


@pytest.mark.parametrize(
    ("shape", "words"), [(HalfSpace(), "no extent"), (MeshcatCone(1, 1, 1), "MeshcatCone is not supported")]
)
def test_a_shape_without_corners_is_refused(shape, words):
    with pytest.raises(ValueError, match=words):
        shape_corners(shape)
