"""The models that a scene may be drawn from: one rigid body each, found in a folder and measured."""

import difflib
import os
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import Convex, Mesh, SceneGraph, Shape
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import RigidBody
from scipy.spatial import ConvexHull, QhullError

from riseg_drake.host.files import near_name
from riseg_drake.host.model_files import ModelFileError, reading_model
from riseg_drake.host.terminal import Notice, one_line
from riseg_drake.robot.description import find_packages, register_models
from riseg_drake.robot.shape_corners import shape_corners
from riseg_drake.stations.contact import touches_over_area
from riseg_drake.stations.footprint import Footprint, footprint
from riseg_drake.stations.roundness import axes_of_revolution

SMALLEST, LARGEST = 0.003, 1.0
"""m; of the longest side of an object."""
HEAVIEST = 20.0
"""kg; what a Panda can push at all is a tenth of it."""
INERTIA_SHARE = 4.0
"""Of the largest moment of inertia that a body of an object's mass and collision shape can have: the shape may
be simpler than the body."""
_UPRIGHT = 0.99
"""Cosine of the angle, 8 degrees, by which an upright axis may lean."""
_OWN = "package://riseg_drake_models/"
_FEW = 5
"""Models that are named."""


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
    corners: NDArray
    """Points p_BP [n, 3], m, whose convex hull holds the body's collision geometry."""
    over_areas: bool
    """Whether it touches others over areas, or only at points."""
    centre: NDArray
    """Its centre of mass p_BBcm [3], m."""
    axes: NDArray
    """Unit vectors in B [k, 3] about which it is a body of revolution: none; one of a can, three of a ball."""

    @property
    def has_flat_sides(self) -> bool:
        """Whether, as it stands, it is more than round about the vertical, so that it can lie flush."""
        return not bool(np.any(np.abs(self.axes @ self.X_WB.rotation().matrix()[2]) > _UPRIGHT))


def find_models(folders: str | Sequence[str], names: Sequence[str] = ()) -> list[ObjectModel]:
    """The models of one folder or several (`*.sdf`, `*.urdf`, there or one folder down), by name, measured.

    `package://` URLs may be given for folders. `names` selects some of the models. Raises SceneError.
    """
    paths: dict[str, Path] = {}
    for folder in map(_resolve, [folders] if isinstance(folders, str) else folders):
        found = [
            path for end in ("sdf", "urdf") for deep in ("", "*/") for path in folder.glob(f"{deep}*.{end}")
        ]
        if not found:
            raise SceneError(
                f"objects: no models in {folder}; expected *.sdf or *.urdf files, there or one folder down"
            )
        for path in sorted(found):
            name = path.parent.name if path.stem == "model" else path.stem
            if name in paths:
                raise SceneError(f"objects: {path} and {paths[name]} are both called {name}; rename one")
            paths[name] = path
    if not paths:
        raise SceneError("objects: no folder; expected one or more with *.sdf or *.urdf models")
    unknown = sorted(set(names) - set(paths))
    if unknown:
        near = difflib.get_close_matches(unknown[0], paths, n=1)
        hint = f"did you mean {near[0]}?" if near else f"there are {', '.join(sorted(paths))}"
        raise SceneError(f"names: no model {', '.join(unknown)}; {hint}")
    models = [measure(name, paths[name]) for name in sorted(names or paths)]
    _tell_without_inertia(models)
    return models


def find_model(path_or_url: str) -> ObjectModel:
    """The model of one file, or of a folder that holds one model; measured. Raises SceneError."""
    path = resolve(path_or_url)
    if path.is_dir():
        found = sorted([*path.glob("*.sdf"), *path.glob("*.urdf")])
        if len(found) != 1:
            raise SceneError(f"model: {len(found)} models in {path}; expected one *.sdf or *.urdf, or a file")
        (path,) = found
    if not path.is_file():
        raise SceneError(f"model: no file {path}; expected an SDF or URDF model{near_name(path)}")
    model = measure(path.parent.name if path.stem == "model" else path.stem, path)
    _tell_without_inertia([model])
    return model


def parse_body(plant: MultibodyPlant, path: Path) -> RigidBody:
    """Add a model of one body to a plant, renamed where its name is taken. Raises SceneError."""
    parser = Parser(plant)
    parser.SetAutoRenaming(True)
    register_models(parser)
    try:
        with reading_model(path):
            find_packages(parser, path)
            instances = parser.AddModels(path)
    except (ModelFileError, RuntimeError, ValueError, SystemExit) as error:  # SystemExit: Drake's assertions
        words = one_line(error)
        if "inertia" in words:
            words = (
                f"{words}; moments are kg m^2 about the centre of mass, each less than the sum of the other two"
            )
        raise SceneError(f"{path} cannot be read: {words}") from error
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
    mass = min([body.default_mass(), *_masses_said(path)])
    if not mass > 0:
        raise SceneError(f"{path} has mass {mass:g}; an object needs a positive mass in kg")
    geometries = plant.GetCollisionGeometriesForBody(body)
    if not geometries:
        raise SceneError(f"{path} has no collision geometry; without it nothing can push the object")
    inspector = scene_graph.model_inspector()
    if not any(_is_drawn(inspector.GetShape(g)) for g in plant.GetVisualGeometriesForBody(body)):
        raise SceneError(
            f"{path} has nothing to see; an object needs a <visual>, a box, a cylinder or the like, or an OBJ, "
            "glTF or VTK mesh"
        )
    R_WB = plant.GetDefaultFloatingBaseBodyPose(body).rotation()
    X_WB = RigidTransform(R_WB)
    try:
        outline = footprint(inspector, geometries, X_WB)
        corners = np.vstack(
            [inspector.GetPoseInFrame(g).multiply(shape_corners(inspector.GetShape(g)).T).T for g in geometries]
        )
    except ValueError as error:
        raise SceneError(f"{path}: {error}") from error
    _check_size(path, body, corners)
    corners = _outermost(corners)
    over_areas = any(touches_over_area(inspector, geometry) for geometry in geometries)
    centre = body.default_com()
    axes = axes_of_revolution(corners - centre, np.vstack([np.eye(3), _principal_axes(body)]))
    return ObjectModel(name, path, X_WB, outline, corners, over_areas, centre, axes)


def _outermost(points: NDArray) -> NDArray:
    """Those of some points [n, 3] that make their convex hull; all where that is flat."""
    try:
        return points[ConvexHull(points).vertices]
    except QhullError:
        return points


def with_remedy(message: str) -> str:
    """What to say of an error of Drake's about a model: in one line, with what helps where that is known."""
    line = one_line(message)
    if "no normals" in line:
        line += "; its surface needs them: trimesh.load(FILE, process=False).export(FILE, include_normals=True)"
    return line


def resolve(path_or_url: str) -> Path:
    """The path that a text names: as it stands, or of a `package://` URL. Raises SceneError."""
    if not path_or_url.startswith("package://"):
        try:
            return Path(path_or_url).expanduser()
        except RuntimeError as error:  # nobody knows where ~ is
            raise SceneError(f"objects: {path_or_url}: {error}") from None
    if not path_or_url.startswith(_OWN):
        raise SceneError(f"objects: {path_or_url}: no such package; expected {_OWN}...")
    path = Path(str(files("riseg_drake.models"))) / path_or_url.removeprefix(_OWN)
    if not path.exists():
        raise SceneError(f"objects: {path_or_url} is not there{near_name(path)}")
    return path


def _resolve(folder_or_url: str) -> Path:
    folder = resolve(folder_or_url)
    if not os.path.isdir(folder):
        raise SceneError(
            f"objects: {folder} is not a folder; expected one with *.sdf or *.urdf models{near_name(folder)}"
        )
    return folder


def _check_size(path: Path, body: RigidBody, corners: NDArray) -> None:
    """Raise SceneError for what is no thing of a table, as a mesh in millimetres or a mass in grams is not."""
    sides, mass = np.ptp(corners, axis=0), body.default_mass()
    if not SMALLEST < sides.max() < LARGEST:
        raise SceneError(
            f"{path} is {sides.max():.3g} m long; things of a table are {SMALLEST:g} to {LARGEST:g} m; "
            "a mesh in millimetres needs a scale of 0.001 0.001 0.001"
        )
    if mass > HEAVIEST:
        raise SceneError(
            f"{path} has mass {mass:g}; things of a table weigh up to {HEAVIEST:g} kg; is it in grams?"
        )
    # The farthest that mass can be from the axis through the middle is half the longest diagonal.
    most = mass * float(np.linalg.norm(sides) / 2) ** 2
    moments = body.default_spatial_inertia().Shift(body.default_com()).CalcRotationalInertia()
    largest = float(np.linalg.eigvalsh(moments.CopyToFullMatrix3()).max())
    if largest > INERTIA_SHARE * most and _says_inertia(path):
        raise SceneError(
            f"{path} has a moment of inertia of {largest:.3g} kg m^2; "
            f"of its mass and size it is {most:.2g} at most"
        )


def _tell_without_inertia(models: Sequence[ObjectModel]) -> None:
    """Give notice of those whose inertia is SDF's own."""
    silent = [model.name for model in models if model.path.suffix == ".sdf" and not _says_inertia(model.path)]
    if silent:
        few = ", ".join(silent[:_FEW]) + (", ..." if len(silent) > _FEW else "")
        warnings.warn(
            f"{len(silent)} of {len(models)} models say no moment of inertia ({few}): "
            "SDF makes 1 kg m^2 of that, and a push hardly turns them; say <inertia>",
            Notice,
            stacklevel=3,
        )


def _says_inertia(path: Path) -> bool:
    """Whether a file holds any: of what it does not say, SDF makes 1 kg m^2."""
    try:
        return next(ElementTree.parse(path).iter("inertia"), None) is not None
    except ElementTree.ParseError:
        return False


def _masses_said(path: Path) -> list[float]:
    """The masses, kg, in an SDF file: Drake's parser makes 1 kg of what is no mass. Raises SceneError."""
    if path.suffix != ".sdf":
        return []
    try:
        said = [element.text or "" for element in ElementTree.parse(path).iter("mass")]
        return [float(text) for text in said if text.strip()]
    except (ValueError, ElementTree.ParseError) as error:
        raise SceneError(f"{path} cannot be read: {one_line(error)}") from None


def _principal_axes(body: RigidBody) -> NDArray:
    """The directions [3, 3], one a row, about which a body would turn by itself."""
    about_centre = body.default_spatial_inertia().Shift(body.default_com()).get_unit_inertia()
    return np.linalg.eigh(about_centre.CopyToFullMatrix3())[1].T


def _is_drawn(shape: Shape) -> bool:
    """Whether the camera's renderer draws a shape."""
    return not isinstance(shape, Mesh | Convex) or shape.extension().lower() in (".obj", ".gltf", ".vtk")
