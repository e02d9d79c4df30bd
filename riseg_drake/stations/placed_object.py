"""An object in its place, and how a scene of them gets into a plant."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import SceneGraph
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BodyIndex

from riseg_drake.stations.contact import let_touch
from riseg_drake.stations.object_models import ObjectModel, parse_body


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


def add_scene(
    plant: MultibodyPlant, scene_graph: SceneGraph, placed: Sequence[PlacedObject]
) -> dict[int, BodyIndex]:
    """Add the objects to a plant that is not finalized, free, with their poses as default.

    Returns the body of each object id 1..N, in the order of `placed`.
    """
    bodies = {}
    for object_id, item in enumerate(placed, start=1):
        body = parse_body(plant, item.model_path)
        let_touch(plant, scene_graph, plant.GetCollisionGeometriesForBody(body))
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
