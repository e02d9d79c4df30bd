"""What lies still sleeps until the robot comes near: physics costs what moves, not what is there.

Contact over areas between a dozen things that rest takes thirty times as long as the arm, and says every time
that they rest. Asleep, their joints are locked, and contacts are looked for with the robot alone: they lie as
they lay, to the bit.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import (
    CollisionFilterDeclaration,
    CollisionFilterManager,
    FilterId,
    GeometryId,
    GeometrySet,
    Obb,
    QueryObject,
    SceneGraph,
)
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BodyIndex, ModelInstanceIndex, RigidBody
from pydrake.systems.framework import Context

from riseg_drake.stations.settling import STILL, are_slower

ROOM = 0.003
"""m to the robot within which a body is awake, ..."""
SUDDEN = 0.05
"""... and m/s by which the robot may come nearer until the next look, beyond what it does now."""
FASTEST = 1.5
"""m/s that no part of the robot exceeds."""


class Sleep:
    """Puts the free bodies of one simulation to sleep, all together, and wakes them before they are touched."""

    def __init__(
        self,
        plant: MultibodyPlant,
        scene_graph: SceneGraph,
        robot: Sequence[ModelInstanceIndex],
        bodies: Sequence[BodyIndex],
        period: float,
    ):
        """Of a finalized plant.

        Args:
            plant: where they are.
            scene_graph: its shapes.
            robot: the models that may touch them.
            bodies: which are free.
            period: between two looks, s.
        """
        self._plant, self._scene_graph, self._period = plant, scene_graph, period
        self._bodies = [plant.get_body(index) for index in bodies]
        joints = [plant.get_joint(index) for index in plant.GetJointIndices()]
        self._joints = [joint for joint in joints if joint.child_body().index() in set(bodies)]
        parts = [plant.get_body(index) for instance in robot for index in plant.GetBodyIndices(instance)]
        shapes = plant.GetCollisionGeometriesForBody
        self._robot: list[tuple[RigidBody, GeometryId]] = [
            (part, shape) for part in parts for shape in shapes(part)
        ]
        self._things = [shape for body in self._bodies for shape in shapes(body)]
        inspector = scene_graph.model_inspector()
        every = [*(shape for _, shape in self._robot), *self._things]
        self._spheres = [(shape, *_sphere(inspector.GetObbInGeometryFrame(shape))) for shape in every]
        self._filter: FilterId | None = None

    @property
    def asleep(self) -> bool:
        """Whether the bodies sleep."""
        return self._filter is not None

    def look(self, root: Context) -> None:
        """Once a period: wake the bodies, or let them sleep. `root` is the simulation's own context."""
        context = self._plant.GetMyMutableContextFromRoot(root)
        if self._filter is not None:
            if self._robot_is_near(context):
                for joint in self._joints:
                    joint.Unlock(context)
                self._filters(root).RemoveDeclaration(self._filter)
                self._filter = None
        elif are_slower(self._bodies, context, STILL) and not self._robot_is_near(context):
            for joint in self._joints:
                joint.Lock(context)
            robot = {shape for _, shape in self._robot}
            shapes = self._scene_graph.model_inspector().GetAllGeometryIds()
            others = GeometrySet([shape for shape in shapes if shape not in robot])
            apart = CollisionFilterDeclaration().ExcludeBetween(GeometrySet(self._things), others)
            self._filter = self._filters(root).ApplyTransient(apart)

    def _filters(self, root: Context) -> CollisionFilterManager:
        return self._scene_graph.collision_filter_manager(self._scene_graph.GetMyMutableContextFromRoot(root))

    def _robot_is_near(self, context: Context) -> bool:
        """Whether the robot may touch a body before the next look."""
        query: QueryObject = self._plant.get_geometry_query_input_port().Eval(context)
        middle_W = np.array([query.GetPoseInWorld(shape) @ middle for shape, middle, _ in self._spheres])
        radius = np.array([radius for _, _, radius in self._spheres])
        robot, things = slice(len(self._robot)), slice(len(self._robot), None)
        gap = np.linalg.norm(middle_W[robot, None] - middle_W[None, things], axis=2)
        gap -= radius[robot, None] + radius[things]
        pairs = np.argwhere(gap < ROOM + self._period * (FASTEST + SUDDEN))
        return any(self._may_touch(context, query, a, b) for a, b in pairs)

    def _may_touch(self, context: Context, query: QueryObject, a: int, b: int) -> bool:
        """Whether shape a of the robot may touch shape b of the things by the next look, as it moves now."""
        part, shape, thing = *self._robot[a], self._things[b]
        closest = query.ComputeSignedDistancePairClosestPoints(shape, thing)
        own = closest.id_A == shape  # Drake puts them in the order of their ids
        p_WQ = query.GetPoseInWorld(shape) @ (closest.p_ACa if own else closest.p_BCb)
        X_WP, V_WP = part.EvalPoseInWorld(context), part.EvalSpatialVelocityInWorld(context)
        leaving = V_WP.Shift(p_WQ - X_WP.translation()).translational() @ closest.nhat_BA_W
        closing = -leaving if own else leaving
        return bool(closest.distance < ROOM + self._period * (max(closing, 0.0) + SUDDEN))


def _sphere(box: Obb | None) -> tuple[NDArray[np.float64], float]:
    """Centre [3], m, in its own frame, and radius, m, around a shape with this box; infinite without one."""
    return (np.zeros(3), np.inf) if box is None else (box.center(), float(np.linalg.norm(box.half_width())))
