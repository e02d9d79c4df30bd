"""Scenes: a few objects close together on the table, some touching, drawn from a seed and at rest."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import AddContactMaterial, Box, ProximityProperties, Sphere
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import (
    AddMultibodyPlantSceneGraph,
    ContactModel,
    CoulombFriction,
    DiscreteContactApproximation,
    MultibodyPlant,
)
from pydrake.multibody.tree import BodyIndex
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from riseg_drake.stations.footprint import Footprint, separation, travel
from riseg_drake.stations.object_models import (
    FOOT_RADIUS,
    ObjectModel,
    SceneError,
    find_models,
    parse_body,
)

__all__ = ["PlacedObject", "SceneConfig", "SceneError", "add_scene", "draw_scene", "object_id_table"]

TABLE_FRICTION = CoulombFriction(0.5, 0.5)
DROP = 2e-4  # m; how far above its resting height an object starts
CLEAR = 1e-4  # m; smallest gap, so that nothing starts inside its neighbour
TRIES = 24  # ways to approach the cluster that are compared for each object
LAYOUTS = 20  # whole layouts tried before a scene is called impossible
STILL = (2e-4, 2e-3)  # m/s and rad/s below which an object is at rest
LONGEST_SETTLING = 3.0  # s


@dataclass
class SceneConfig:
    """What is drawn. The paper: 20 scenes of 4 to 6 objects in close proximity on a flat white table."""

    objects: str = "package://riseg_drake_models/objects"
    """Folder, or `package://` URL of one, of SDF or URDF models of one body each."""
    names: list[str] = field(default_factory=list)
    """Draw from these models only; empty: from all in the folder."""
    count_min: int = 4
    """Fewest objects in a scene (paper: 4)."""
    count_max: int = 6
    """Most objects in a scene (paper: 6)."""
    centre_W: list[float] = field(default_factory=lambda: [0.5, 0.0])
    """Middle of the work area on the table, x and y in W, m."""
    radius: float = 0.15
    """No part of an object is further from the middle than this, m."""
    touch_probability: float = 0.6
    """How likely an object is laid against another; else it gets a gap."""
    touch_gap: float = 0.001
    """Largest gap between objects that count as touching, m."""
    gap_min: float = 0.003
    """Smallest gap otherwise, m."""
    gap_max: float = 0.012
    """Largest gap otherwise, m."""


@dataclass(frozen=True)
class PlacedObject:
    """One object of a scene."""

    model: ObjectModel
    X_WB: RigidTransform

    @property
    def name(self) -> str:
        """Name of the model, by its file."""
        return self.model.name

    @property
    def model_path(self) -> Path:
        """The SDF or URDF file."""
        return self.model.path


def draw_scene(config: SceneConfig, rng: np.random.Generator) -> list[PlacedObject]:
    """Draw a scene and let it settle; the same for the same generator state. Raises SceneError."""
    _check(config)
    models = find_models(config.objects, config.names)
    if len(models) < config.count_min:
        raise SceneError(
            f"count_min: {config.count_min} different objects wanted, but {config.objects} offers "
            f"{len(models)}; add models or ask for fewer"
        )
    count = int(rng.integers(config.count_min, min(config.count_max, len(models)) + 1))
    chosen = [models[i] for i in rng.permutation(len(models))[:count]]
    restless = ""
    for _ in range(LAYOUTS):
        layout = _lay_out(chosen, config, rng)
        if layout is None:
            continue
        placed = [_stand(model, *spot) for model, spot in zip(chosen, layout, strict=True)]
        settled = settle(placed, config)
        restless = _restless(placed, settled)
        if not restless:
            return settled
    if restless:
        raise SceneError(f"{restless}; model it with z up, standing on a face or on three points or more")
    raise SceneError(
        f"{count} objects ({', '.join(model.name for model in chosen)}) do not fit within "
        f"{config.radius:g} m of the middle; ask for fewer, smaller ones, or enlarge radius"
    )


def add_scene(plant: MultibodyPlant, placed: Sequence[PlacedObject]) -> dict[int, BodyIndex]:
    """Add the objects to a plant that is not finalized, free, with their poses as default.

    Returns the body of each object id 1..N, in the order of `placed`.
    """
    bodies = {}
    for object_id, item in enumerate(placed, start=1):
        body = parse_body(plant, item.model_path)
        for k, p_BF in enumerate(item.model.feet):
            plant.RegisterCollisionGeometry(
                body,
                RigidTransform(p_BF),
                Sphere(FOOT_RADIUS),
                f"added_foot_{k}",
                _foot_properties(item.model.foot_friction),
            )
        plant.SetDefaultFloatingBaseBodyPose(body, item.X_WB)
        bodies[object_id] = body.index()
    return bodies


def object_id_table(bodies: Mapping[int, BodyIndex]) -> NDArray[np.int16]:
    """Object id for every label that Drake's label camera renders, [32768]: `table[label_image]`.

    A MultibodyPlant labels what it draws with the body's index; everything but the objects becomes 0.
    """
    table = np.zeros(2**15, np.int16)
    for object_id, body in bodies.items():
        table[int(body)] = object_id
    return table


def settle(placed: Sequence[PlacedObject], config: SceneConfig) -> list[PlacedObject]:
    """The same objects after they were let go on a table, when all are at rest or time is up."""
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, time_step=0.002)
    plant.set_contact_model(ContactModel.kPoint)
    plant.set_discrete_contact_approximation(DiscreteContactApproximation.kLagged)
    table = Box(4.0, 4.0, 0.5)
    X_WT = RigidTransform([*config.centre_W, -0.25])
    plant.RegisterCollisionGeometry(plant.world_body(), X_WT, table, "table", TABLE_FRICTION)
    bodies = [plant.get_body(index) for index in add_scene(plant, placed).values()]
    plant.Finalize()
    simulator = Simulator(builder.Build())
    context = plant.GetMyContextFromRoot(simulator.get_context())
    for time in np.arange(0.2, LONGEST_SETTLING, 0.1):
        simulator.AdvanceTo(time)
        velocities = [body.EvalSpatialVelocityInWorld(context) for body in bodies]
        if all(
            np.linalg.norm(V.translational()) < STILL[0] and np.linalg.norm(V.rotational()) < STILL[1]
            for V in velocities
        ):
            break
    return [
        PlacedObject(item.model, body.EvalPoseInWorld(context))
        for item, body in zip(placed, bodies, strict=True)
    ]


def _check(config: SceneConfig) -> None:
    """Raise SceneError for settings that can never make a scene."""
    if not 1 <= config.count_min <= config.count_max:
        raise SceneError(
            f"count_min, count_max: {config.count_min}, {config.count_max}; expected 1 <= min <= max"
        )
    if len(config.centre_W) != 2:
        raise SceneError(f"centre_W: {config.centre_W}; expected x and y in metres")
    if config.radius <= 0:
        raise SceneError(f"radius: {config.radius:g}; expected metres, more than 0")
    if not 0 <= config.touch_probability <= 1:
        raise SceneError(f"touch_probability: {config.touch_probability:g}; expected 0 to 1")
    if config.touch_gap < 0 or not 0 <= config.gap_min <= config.gap_max:
        raise SceneError("touch_gap, gap_min, gap_max: expected 0 <= touch_gap, 0 <= gap_min <= gap_max")


def _lay_out(
    models: Sequence[ObjectModel], config: SceneConfig, rng: np.random.Generator
) -> list[tuple[float, NDArray]] | None:
    """A yaw and a place (x, y) for each model, packed around the middle; None if they need more room.

    Each object comes in along a straight line from outside until it touches what lies there already,
    then steps back by its gap. Of a number of ways in, the one that ends nearest to the middle is taken.
    """
    spots: list[tuple[float, NDArray]] = []
    prints: list[Footprint] = []
    for model in models:
        touching = rng.uniform() < config.touch_probability
        low, high = (0.0, config.touch_gap) if touching else (config.gap_min, config.gap_max)
        gap = max(rng.uniform(low, high), CLEAR)
        if not prints:
            spots.append((rng.uniform(-np.pi, np.pi), np.zeros(2)))
            prints.append(model.footprint.moved(*spots[0]))
            continue
        middle = np.mean([p.corners().mean(axis=0) for p in prints], axis=0)
        ways = []
        for _ in range(TRIES):
            yaw, heading = rng.uniform(-np.pi, np.pi, 2)
            direction = np.array([np.cos(heading), np.sin(heading)])
            start = middle + rng.uniform(-0.03, 0.03, 2) - direction
            outside = model.footprint.moved(yaw, start)
            way = min(travel(outside, other, direction) for other in prints)
            if np.isfinite(way):
                touch = start + way * direction
                extent = np.linalg.norm(outside.corners() - start + touch - middle, axis=1).max()
                ways.append((float(extent), yaw, touch, direction))
        for _, yaw, touch, direction in sorted(ways, key=lambda way: way[0]):
            spot = _step_back(model.footprint, prints, yaw, touch, direction, gap)
            if spot is not None:
                break
        else:
            return None
        spots.append((yaw, spot))
        prints.append(model.footprint.moved(yaw, spot))
    return _centred(spots, prints, config)


def _step_back(
    shape: Footprint,
    prints: Sequence[Footprint],
    yaw: float,
    touch: NDArray,
    direction: NDArray,
    gap: float,
) -> NDArray | None:
    """Where a shape stands that came in along `direction` to `touch` and then gave way by `gap`."""
    back = gap
    for _ in range(12):  # a slanting contact gives less room than the step back: step again
        spot = touch - back * direction
        room = min(separation(shape.moved(yaw, spot), other) for other in prints)
        if room >= 0.8 * gap:
            return spot
        back += max(gap - room, 1e-4)
    return None


def _centred(
    spots: list[tuple[float, NDArray]], prints: Sequence[Footprint], config: SceneConfig
) -> list[tuple[float, NDArray]] | None:
    """The layout moved into the middle of the work area; None if it is too wide."""
    corners = np.vstack([p.corners() for p in prints])
    middle = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
    if np.linalg.norm(corners - middle, axis=1).max() > config.radius - 0.001:
        return None
    return [(yaw, xy - middle + np.array(config.centre_W)) for yaw, xy in spots]


def _stand(model: ObjectModel, yaw: float, p_xy: NDArray) -> PlacedObject:
    """A model turned by `yaw` about the vertical, its lowest point a little above the table."""
    R_WB = RotationMatrix.MakeZRotation(yaw).multiply(model.X_WB.rotation())
    X_WB = RigidTransform(R_WB, [*p_xy, DROP - model.footprint.bottom])
    return PlacedObject(model, X_WB)


def _restless(placed: Sequence[PlacedObject], settled: Sequence[PlacedObject]) -> str:
    """What is wrong with a settled scene: an object that fell over, rolled away or sank; or nothing."""
    for before, after in zip(placed, settled, strict=True):
        shift = np.linalg.norm(after.X_WB.translation() - before.X_WB.translation())
        angle = (before.X_WB.rotation().inverse().multiply(after.X_WB.rotation())).ToAngleAxis().angle()
        if shift > 0.005 or angle > np.radians(3.0):
            return (
                f"{before.name} does not stay where it is put: it moved {1e3 * shift:.0f} mm and turned "
                f"{np.degrees(angle):.0f} degrees while settling"
            )
    return ""


def _foot_properties(friction: CoulombFriction) -> ProximityProperties:
    properties = ProximityProperties()
    AddContactMaterial(dissipation=2.0, point_stiffness=2e4, friction=friction, properties=properties)
    return properties
