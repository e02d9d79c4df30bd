"""Shapes as the corners of their convex hulls."""

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import Box, Capsule, Convex, Cylinder, Ellipsoid, HalfSpace, Mesh, Shape, Sphere

_CIRCLE = np.stack([np.cos(t := np.linspace(0, 2 * np.pi, 32, endpoint=False)), np.sin(t)], axis=-1)
_POLAR = np.linspace(0, np.pi, 17)
_SPHERE = np.concatenate(
    [np.column_stack([np.sin(p) * _CIRCLE, np.full(len(_CIRCLE), np.cos(p))]) for p in _POLAR]
)


def shape_corners(shape: Shape) -> NDArray:
    """Points [n, 3] whose convex hull is the shape, or very nearly. Raises ValueError for an unknown shape."""
    match shape:
        case Box():
            half = np.asarray(shape.size()) / 2
            return np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * half
        case Sphere():
            return _SPHERE * shape.radius()
        case Ellipsoid():
            return _SPHERE * (shape.a(), shape.b(), shape.c())
        case Cylinder():
            top = 0.5 * shape.length()
            return np.vstack(
                [np.column_stack([_CIRCLE * shape.radius(), np.full(len(_CIRCLE), z)]) for z in (-top, top)]
            )
        case Capsule():
            top_xyz = np.array([0.0, 0.0, 0.5 * shape.length()])
            return np.vstack([_SPHERE * shape.radius() - top_xyz, _SPHERE * shape.radius() + top_xyz])
        case Convex() | Mesh():
            hull = shape.GetConvexHull()
            return np.array([hull.vertex(i) for i in range(hull.num_vertices())])
        case HalfSpace():
            raise ValueError("a half space has no extent; a box or a mesh would do")
        case _:
            raise ValueError(f"a shape of type {type(shape).__name__} is not supported")
