"""Lets things come to rest on a table, and builds piles by laying one on the other."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from pydrake.geometry import Box
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction
from pydrake.multibody.tree import RigidBody
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, DiagramBuilder

from riseg_drake.stations.contact import let_touch, set_contact_model
from riseg_drake.stations.object_models import ObjectModel
from riseg_drake.stations.physics import advance
from riseg_drake.stations.placed_object import PlacedObject, add_scene

TABLE_FRICTION = CoulombFriction(0.5, 0.5)
STILL = (2e-4, 2e-3)
"""m/s and rad/s below which an object is at rest."""
TREMBLING = (1e-3, 1e-2)
"""m/s and rad/s above which an object does not stay at rest: some piles tremble, and creep by it."""
STAYING = 1.0
"""s for which a pile must stay at rest."""
STEP_AT_POINTS, STEP_OVER_AREAS = 0.002, 0.004
"""s; contact over areas is stiff in no direction, and costs more a step."""
LONGEST = 3.0
"""s that objects are given to come to rest."""
LONGEST_OF_A_PILE = 4.0
"""s that a pile is given, where round things roll."""
LAYING = 0.6
"""s after which the next thing is laid on a pile."""
DROP = 0.004
"""m; from how high above the pile it is let go."""
TILT = 0.3
"""rad; how far it is turned out of its modelled posture, at most, about each of two axes."""
SCATTER = 0.028
"""m; how far from the middle, along x and y, it is laid."""

TABLE = 0
"""Stands for the table among object ids."""


def are_slower(bodies: Sequence[RigidBody], context: Context, limits: tuple[float, float]) -> bool:
    """Whether all bodies of a plant are slower than some m/s and rad/s."""
    velocities = [body.EvalSpatialVelocityInWorld(context) for body in bodies]
    return all(
        np.linalg.norm(V.translational()) < limits[0] and np.linalg.norm(V.rotational()) < limits[1]
        for V in velocities
    )


class SettlingTable:
    """A table with objects on it, which are let go. The same objects give the same, to the last bit.

    Letting go raises PhysicsError where the simulation cannot go on.
    """

    def __init__(self, placed: Sequence[PlacedObject], centre_W: Sequence[float]):
        self._placed = list(placed)
        over_areas = any(item.model.over_areas for item in placed)
        builder = DiagramBuilder()
        step = STEP_OVER_AREAS if over_areas else STEP_AT_POINTS
        self._plant, scene_graph = AddMultibodyPlantSceneGraph(builder, step)
        set_contact_model(self._plant, over_areas)
        top = self._plant.RegisterCollisionGeometry(
            self._plant.world_body(),
            RigidTransform([*centre_W, -0.25]),
            Box(4.0, 4.0, 0.5),
            "table",
            TABLE_FRICTION,
        )
        let_touch(self._plant, scene_graph, [top], rigid=True)
        self._ids = {top: TABLE}
        bodies = add_scene(self._plant, scene_graph, placed)
        self._bodies = [self._plant.get_body(index) for index in bodies.values()]
        for object_id, body in enumerate(self._bodies, start=1):
            for geometry in self._plant.GetCollisionGeometriesForBody(body):
                self._ids[geometry] = object_id
        self._plant.Finalize()
        self._simulator = Simulator(builder.Build())
        self._context = self._plant.GetMyContextFromRoot(self._simulator.get_context())

    def lay(self, number: int, X_WB: RigidTransform) -> None:
        """Put an object, by its place in the sequence, somewhere else, at rest."""
        body = self._bodies[number]
        self._plant.SetFloatingBaseBodyPoseInWorldFrame(self._context, body, X_WB)
        self._plant.SetVelocities(self._context, body.model_instance(), np.zeros(6))

    def settle(self, longest: float) -> bool:
        """Let go until all are at rest, or `longest` s are over; whether they are at rest."""
        start = self._simulator.get_context().get_time()
        for time in np.arange(0.2, longest, 0.1):
            advance(self._simulator, start + time)
            if are_slower(self._bodies, self._context, STILL):
                return True
        return False

    def stay(self, seconds: float) -> bool:
        """Let go for so long; whether all stay at rest from 0.2 s on, looked at ten times a second."""
        start = self._simulator.get_context().get_time()
        for time in np.arange(0.2, seconds + 0.05, 0.1):
            advance(self._simulator, start + time)
            if not are_slower(self._bodies, self._context, TREMBLING):
                return False
        return True

    def objects(self) -> list[PlacedObject]:
        """The objects where they are now."""
        poses = [body.EvalPoseInWorld(self._context) for body in self._bodies]
        return [replace(item, X_WB=X_WB) for item, X_WB in zip(self._placed, poses, strict=True)]

    def touching(self) -> set[frozenset[int]]:
        """Pairs of object ids, 1..N in the order of the objects, that touch; the table is TABLE."""
        results = self._plant.get_contact_results_output_port().Eval(self._context)
        surfaces = [
            results.hydroelastic_contact_info(k).contact_surface()
            for k in range(results.num_hydroelastic_contacts())
        ]
        points = [
            results.point_pair_contact_info(k).point_pair() for k in range(results.num_point_pair_contacts())
        ]
        pairs = [(surface.id_M(), surface.id_N()) for surface in surfaces]
        pairs += [(pair.id_A, pair.id_B) for pair in points]
        return {frozenset((self._ids[a], self._ids[b])) for a, b in pairs}


def settle(placed: Sequence[PlacedObject], centre_W: Sequence[float]) -> list[PlacedObject]:
    """The same objects after they were let go on a table, when all are at rest or time is up."""
    table = SettlingTable(placed, centre_W)
    table.settle(LONGEST)
    return table.objects()


def lay_pile(
    models: Sequence[ObjectModel], centre_W: Sequence[float], rng: np.random.Generator
) -> list[PlacedObject] | None:
    """Objects laid one after the other onto one place; None if they do not come to rest as a pile."""
    row = [[*np.add(centre_W, [-1.5, 0.25 * k]), -model.footprint.bottom] for k, model in enumerate(models)]
    waiting = [  # out of the way
        PlacedObject(model, RigidTransform(model.X_WB.rotation(), p_W))
        for model, p_W in zip(models, row, strict=True)
    ]
    table = SettlingTable(waiting, centre_W)
    for k, model in enumerate(models):
        tilt = TILT if k else 0.0
        turn = RollPitchYaw([*rng.uniform(-tilt, tilt, 2), rng.uniform(-np.pi, np.pi)])
        R_WB = turn.ToRotationMatrix().multiply(model.X_WB.rotation())
        p_W = np.array([*np.add(centre_W, rng.uniform(-SCATTER, SCATTER, 2)), 0.0])
        p_W[2] = _height_below(table.objects()[:k], RigidTransform(R_WB, p_W), model)
        table.lay(k, RigidTransform(R_WB, p_W))
        table.settle(LAYING)
    if not table.settle(LONGEST_OF_A_PILE) or not is_pile(table.touching(), len(models)):
        return None
    heap = _centred(table.objects(), centre_W)
    # Still at one moment is what trembles, too, where it turns. A station's plant begins with no velocities.
    return heap if SettlingTable(heap, centre_W).stay(STAYING) else None


def is_pile(touching: set[frozenset[int]], count: int) -> bool:
    """Whether at least half of the objects 1..count touch another, and one lies on others alone."""
    among = [pair for pair in touching if TABLE not in pair]
    against = set().union(*among)
    on_table = set().union(*(pair for pair in touching if TABLE in pair)) - {TABLE}
    return 2 * len(against) >= count and len(against - on_table) > 0


def _centred(placed: Sequence[PlacedObject], centre_W: Sequence[float]) -> list[PlacedObject]:
    """The same, moved along the table so that the middle of what they cover is there."""
    corners = np.vstack([item.X_WB.multiply(item.model.corners.T).T for item in placed])[:, :2]
    shift = np.array([*np.subtract(centre_W, 0.5 * (corners.min(axis=0) + corners.max(axis=0))), 0.0])
    moved = RigidTransform(shift)
    return [replace(item, X_WB=moved.multiply(item.X_WB)) for item in placed]


def _height_below(placed: Sequence[PlacedObject], X_WB: RigidTransform, model: ObjectModel) -> float:
    """The z of a body's origin, m, at which it is clear by DROP of whatever is under its bounding box."""
    corners = X_WB.multiply(model.corners.T).T
    low, high = corners.min(axis=0), corners.max(axis=0)
    top = 0.0
    for item in placed:
        others = item.X_WB.multiply(item.model.corners.T).T
        if np.all(others.min(axis=0)[:2] < high[:2]) and np.all(others.max(axis=0)[:2] > low[:2]):
            top = max(top, float(others[:, 2].max()))
    return top + DROP - float(low[2])
