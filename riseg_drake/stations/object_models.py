"""The models that a scene may be drawn from: one rigid body each, found in a folder and measured."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import SceneGraph, Sphere
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import PackageMap, Parser
from pydrake.multibody.plant import CoulombFriction, MultibodyPlant
from pydrake.multibody.tree import RigidBody
from scipy.spatial import ConvexHull

from riseg_drake.host.model_files import ModelFileError, check_model
from riseg_drake.host.terminal import one_line
from riseg_drake.stations.footprint import Footprint, footprint, shape_corners

FOOT_RADIUS = 0.002
FOOT_REACH = 0.0003
"""How far a foot stands out below a flat underside, m: beyond what its contact is pressed in."""


class SceneError(ValueError):
    """A scene that cannot be made; the message says in one line why, and what would be right."""


@dataclass(frozen=True)
class ObjectModel:
    """A model that a scene can use."""

    name: str
    path: Path
    X_WB: RigidTransform
    """The body's pose as modelled."""
    footprint: Footprint
    """Of the body in its modelled pose, about its origin."""
    feet: NDArray
    """Centres p_BF [k, 3] of balls to be added below a flat underside; none where it needs none."""
    foot_friction: CoulombFriction
    """Of those balls: that of the geometry they stand for."""


def find_models(folder_or_url: str, names: Sequence[str] = ()) -> list[ObjectModel]:
    """The models of a folder (`*.sdf`, `*.urdf`, there or one folder down), sorted by name, measured.

    A `package://` URL may be given for the folder. `names` selects some of them. Raises SceneError.
    """
    folder = _resolve(folder_or_url)
    found = [path for end in ("sdf", "urdf") for deep in ("", "*/") for path in folder.glob(f"{deep}*.{end}")]
    if not found:
        raise SceneError(
            f"objects: no models in {folder}; expected *.sdf or *.urdf files, there or one folder down"
        )
    paths: dict[str, Path] = {}
    for path in sorted(found):
        name = path.parent.name if path.stem == "model" else path.stem
        if name in paths:
            raise SceneError(f"objects: {path} and {paths[name]} are both called {name}; rename one")
        paths[name] = path
    unknown = sorted(set(names) - set(paths))
    if unknown:
        raise SceneError(f"names: no model {', '.join(unknown)}; there are {', '.join(sorted(paths))}")
    return [measure(name, paths[name]) for name in sorted(names or paths)]


def parse_body(plant: MultibodyPlant, path: Path) -> RigidBody:
    """Add a model of one body to a plant, renamed where its name is taken. Raises SceneError."""
    parser = Parser(plant)
    parser.SetAutoRenaming(True)
    parser.package_map().Add("riseg_drake_models", Path(str(files("riseg_drake.models"))))
    try:
        check_model(path)
        instances = parser.AddModels(path)
    except (ModelFileError, RuntimeError, ValueError, SystemExit) as error:  # SystemExit: Drake's assertions
        raise SceneError(f"{path} cannot be read: {one_line(error)}") from error
    bodies = [plant.get_body(index) for instance in instances for index in plant.GetBodyIndices(instance)]
    if len(bodies) != 1:
        raise SceneError(f"{path} has {len(bodies)} bodies; an object of a scene is a single rigid body")
    return bodies[0]


def measure(name: str, path: Path) -> ObjectModel:
    """Read a model, find its footprint and how it stands. Raises SceneError if it cannot be used."""
    scene_graph = SceneGraph()
    plant = MultibodyPlant(0.002)
    plant.RegisterAsSourceForSceneGraph(scene_graph)
    body = parse_body(plant, path)
    try:
        plant.Finalize()
    except (RuntimeError, ValueError, SystemExit) as error:
        raise SceneError(f"{path} cannot be read: {one_line(error)}") from error
    if not body.is_floating_base_body():
        raise SceneError(f"{path} is fixed to the world; an object of a scene must be free to move")
    if not body.default_mass() > 0:
        raise SceneError(f"{path} has mass {body.default_mass():g}; an object needs a positive mass in kg")
    geometries = plant.GetCollisionGeometriesForBody(body)
    if not geometries:
        raise SceneError(f"{path} has no collision geometry; without it nothing can push the object")
    inspector = scene_graph.model_inspector()
    R_WB = plant.GetDefaultFloatingBaseBodyPose(body).rotation()
    X_WB = RigidTransform(R_WB)
    try:
        outline = footprint(inspector, geometries, X_WB)
        lowest = [
            X_WB.multiply(inspector.GetPoseInFrame(g).multiply(shape_corners(inspector.GetShape(g)).T)).T
            for g in geometries
            if not isinstance(inspector.GetShape(g), Sphere)
        ]
    except ValueError as error:
        raise SceneError(f"{path}: {error}") from error
    feet = _feet(np.vstack(lowest), outline.bottom) if lowest else np.zeros((0, 3))
    p_BF = R_WB.inverse().multiply(feet.T).T if len(feet) else feet
    if len(feet):
        outline = Footprint(outline.pieces, float(feet[:, 2].min()) - FOOT_RADIUS)
    surface = inspector.GetProximityProperties(geometries[0]).GetProperty("material", "coulomb_friction")
    # A copy: what the inspector hands out dies with the scene graph.
    friction = CoulombFriction(surface.static_friction(), surface.dynamic_friction())
    return ObjectModel(name, path, X_WB, outline, p_BF, friction)


def _feet(corners: NDArray, bottom: float) -> NDArray:
    """Ball centres [k, 3] below a flat underside, or none where the underside is not flat.

    Point contact gives a flat face one point to stand on, and two boxes in contact sink into each other;
    four balls at the face's corners stand still and slide as the face would.
    """
    face = corners[corners[:, 2] < bottom + 0.5 * FOOT_REACH][:, :2]
    if len(face) < 3 or np.linalg.matrix_rank(face - face.mean(axis=0), tol=FOOT_RADIUS) < 2:
        return np.zeros((0, 3))
    face = face[ConvexHull(face).vertices]
    centre = face.mean(axis=0)
    chosen = [int(np.argmax(np.linalg.norm(face - centre, axis=1)))]
    for _ in range(min(4, len(face)) - 1):
        spread = np.linalg.norm(face[:, None] - face[chosen], axis=-1).min(axis=1)
        chosen.append(int(np.argmax(spread)))
    arm = face[chosen] - centre
    length = np.linalg.norm(arm, axis=1, keepdims=True)
    inset = centre + arm * np.maximum(1.0 - 1.5 * FOOT_RADIUS / length, 0.5)
    return np.column_stack([inset, np.full(len(inset), bottom - FOOT_REACH + FOOT_RADIUS)])


def _resolve(folder_or_url: str) -> Path:
    if not folder_or_url.startswith("package://"):
        try:
            folder = Path(folder_or_url).expanduser()
        except RuntimeError as error:  # nobody knows where ~ is
            raise SceneError(f"objects: {folder_or_url}: {error}") from None
    else:
        packages = PackageMap()
        packages.Add("riseg_drake_models", Path(str(files("riseg_drake.models"))))
        try:
            folder = Path(packages.ResolveUrl(folder_or_url))
        except RuntimeError as error:
            raise SceneError(f"objects: {' '.join(str(error).split())}") from error
    if not os.path.isdir(folder):
        raise SceneError(f"objects: {folder} is not a folder; expected one with *.sdf or *.urdf models")
    return folder
