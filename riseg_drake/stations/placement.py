"""Whether objects that a person placed can be where they are said to be: on the table, apart, in view."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import DiagramBuilder

from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.stations.footprint import Footprint, inside
from riseg_drake.stations.object_models import SceneError
from riseg_drake.stations.placed_object import PlacedObject, add_scene

INTO = 0.002
"""m; so far a thing may reach into the table, or into another: what was measured by hand errs."""


def check_apart(placed: Sequence[PlacedObject]) -> None:
    """Raise SceneError, naming what to move, where a thing is in the table's top, z = 0, or in another one."""
    for k, item in enumerate(placed):
        low = float(_corners(item)[:, 2].min())
        if low < -INTO:
            raise SceneError(
                f"{_named(k, item)} reaches {-100 * low:.1f} cm below the table's top, z = 0; "
                f"its z would be {item.X_WB.translation()[2] - low:.3f} m or more"
            )
    depth, a, b = max(_overlaps(placed), default=(0.0, 0, 0))
    if depth > INTO:
        raise SceneError(
            f"{_named(a, placed[a])} and {_named(b, placed[b])} are {1e3 * depth:.0f} mm inside each other; "
            f"expected {1e3 * INTO:g} mm at most: move one of them"
        )


def check_on_top(placed: Sequence[PlacedObject], top: Footprint) -> None:
    """Raise SceneError where the footprint of a thing reaches over the edge of the table's `top`, in W."""
    edges = top.corners()
    for k, item in enumerate(placed):
        p_xy = _corners(item)[:, :2]
        if not np.any([inside(p_xy, piece) for piece in top.pieces], axis=0).all():
            x, y, _ = item.X_WB.translation()
            raise SceneError(
                f"{_named(k, item)} at x {x:g}, y {y:g} m is not on the table; its top is {_extent(edges)}"
            )


def check_in_view(placed: Sequence[PlacedObject], X_WC: RigidTransform, camera: Intrinsics) -> None:
    """Raise SceneError where a camera with pose X_WC sees no part of a thing's bounds."""
    for k, item in enumerate(placed):
        x, y, z = X_WC.inverse().multiply(_corners(item).T)
        ahead = z > 0
        u = camera.fx * x[ahead] / z[ahead] + camera.cx
        v = camera.fy * y[ahead] / z[ahead] + camera.cy
        size = camera.width, camera.height
        if not ahead.any() or any(p.max() < 0 or p.min() > n - 1 for p, n in zip((u, v), size, strict=True)):
            x, y, _ = item.X_WB.translation()
            raise SceneError(
                f"{_named(k, item)} at x {x:g}, y {y:g} m is out of the camera's first view"
                f"{_view(X_WC, camera)}"
            )


def _view(X_WC: RigidTransform, camera: Intrinsics) -> str:
    """Which part of the table a camera shows, in words; nothing where it sees over the horizon."""
    u, v = np.array([(0, 0), (1, 0), (0, 1), (1, 1)]).T * [[camera.width - 1], [camera.height - 1]]
    rays = np.stack([(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, np.ones(4)])
    rays_W = X_WC.rotation().multiply(rays).T
    if np.any(rays_W[:, 2] > -1e-3):
        return "; place it nearer to what the camera looks at, centre_W"
    p_WC = X_WC.translation()
    return f", which shows {_extent((p_WC - p_WC[2] / rays_W[:, 2:] * rays_W)[:, :2])} of the table"


def _extent(p_xy: NDArray) -> str:
    (x_0, y_0), (x_1, y_1) = p_xy.min(axis=0), p_xy.max(axis=0)
    return f"x {x_0:.2f} to {x_1:.2f}, y {y_0:.2f} to {y_1:.2f} m"


def _named(number: int, item: PlacedObject) -> str:
    return f"placed[{number}] ({item.name})"


def _corners(item: PlacedObject) -> NDArray:
    """Points [n, 3] in W whose convex hull holds a thing's collision geometry, m."""
    return item.X_WB.multiply(item.model.corners.T).T


def _overlaps(placed: Sequence[PlacedObject]) -> list[tuple[float, int, int]]:
    """How deep, m, convex pieces of two things are in each other, and which two; by Drake."""
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.002)
    bodies = add_scene(plant, scene_graph, placed)
    owner = {
        geometry: object_id - 1
        for object_id, body in bodies.items()
        for geometry in plant.GetCollisionGeometriesForBody(plant.get_body(body))
    }
    plant.Finalize()
    diagram = builder.Build()
    context = scene_graph.GetMyContextFromRoot(diagram.CreateDefaultContext())
    pairs = scene_graph.get_query_output_port().Eval(context).ComputePointPairPenetration()
    return [(pair.depth, *sorted((owner[pair.id_A], owner[pair.id_B]))) for pair in pairs]
