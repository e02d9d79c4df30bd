"""A robot of one's own, from its URDF or SDF: where its camera is, and what shapes it has."""

from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import SceneGraphInspector
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, ModelInstanceIndex
from pydrake.planning import RobotDiagramBuilder

from riseg_drake.robot.description import find_packages, register_models


class OwnRobotError(ValueError):
    """What is wrong with a robot's model file, in one line that names it."""


class OwnRobot:
    """Any robot with a camera on it, its base bolted to the origin of W.

    Follows `silhouette.Kinematics`. Not for use by several threads at once.
    """

    def __init__(self, file: Path, camera_frame: str, joints: Sequence[str]):
        """Read a model.

        Args:
            file: URDF, SDF or MJCF.
            camera_frame: name of a frame or link of it: the camera's optical frame (x right, y down, z ahead).
            joints: what the joint angles belong to, in their order: names of joints; where these are not
                names of the model's joints, all its movable joints in the order of the file.

        Raises OwnRobotError.
        """
        if not file.is_file():
            raise OwnRobotError(f"{file} is not there; --robot names a URDF or SDF file")
        try:
            builder, self._models = _parsed(file, None)
        except (RuntimeError, ValueError) as error:
            # A robot is looked at here, and touches nothing: its collision shapes shall not decide.
            try:
                builder, self._models = _parsed(file, _without_collisions(file))
            except (RuntimeError, ValueError, ElementTree.ParseError):
                raise OwnRobotError(f"{file}: {' '.join(str(error).split())}") from None
        self.plant: MultibodyPlant = builder.plant()
        self._camera_frame = self._frame(file, camera_frame)
        self._diagram = builder.Build()
        self._root = self._diagram.CreateDefaultContext()
        self._context = self._diagram.mutable_plant_context(self._root)
        self._where = self._positions(file, joints)

    @property
    def inspector(self) -> SceneGraphInspector:
        """What shapes the robot has."""
        return self._diagram.scene_graph().model_inspector()

    @property
    def models(self) -> tuple[ModelInstanceIndex, ...]:
        """All that the file holds."""
        return self._models

    def X_WA(self, q: NDArray, frame: Frame) -> NDArray[np.float64]:
        """Pose [4, 4] of any frame of `plant` at the joint angles q, rad (or m); others stay at rest."""
        positions = self.plant.GetPositions(self._context)
        positions[self._where] = q
        self.plant.SetPositions(self._context, positions)
        return frame.CalcPoseInWorld(self._context).GetAsMatrix4()

    def X_WC(self, q: NDArray) -> NDArray[np.float64]:
        """Pose of the camera's optical frame at q, [4, 4]."""
        return self.X_WA(q, self._camera_frame)

    def _frame(self, file: Path, name: str) -> Frame:
        names = []
        for model in self._models:
            for index in self.plant.GetFrameIndices(model):
                frame = self.plant.get_frame(index)
                if frame.name() == name:
                    return frame
                names.append(frame.name())
        raise OwnRobotError(f"{file} has no frame {name!r}; it has {', '.join(names)}")

    def _positions(self, file: Path, joints: Sequence[str]) -> list[int]:
        """Where in the plant's positions each given joint angle goes."""
        movable = [
            self.plant.get_joint(index)
            for model in self._models
            for index in self.plant.GetJointIndices(model)
            if self.plant.get_joint(index).num_positions() == 1
        ]
        by_name = {joint.name(): joint.position_start() for joint in movable}
        if set(joints) <= set(by_name):
            return [by_name[name] for name in joints]
        if len(joints) != len(movable):
            raise OwnRobotError(
                f"{file} has {len(movable)} movable joints ({', '.join(by_name)}), the recording has "
                f"{len(joints)}; name the joints in the heading of joints.csv"
            )
        return list(by_name.values())


def _parsed(file: Path, text: str | None) -> tuple[RobotDiagramBuilder, tuple[ModelInstanceIndex, ...]]:
    """The robot of a file, bolted down; of another text in its place, if one is given."""
    builder = RobotDiagramBuilder(time_step=0.0)
    plant = builder.plant()
    parser = Parser(plant)
    register_models(parser)
    parser.package_map().PopulateFromRosPackagePath()
    find_packages(parser, file)
    added = parser.AddModels(str(file)) if text is None else parser.AddModelsFromString(text, file.suffix[1:])
    models = tuple(added)
    _bolt_bases(plant, models)
    plant.Finalize()
    return builder, models


def _without_collisions(file: Path) -> str:
    """A URDF or SDF without collision shapes, that may be read from anywhere."""
    ElementTree.register_namespace("drake", "http://drake.mit.edu")
    root = ElementTree.parse(file).getroot()
    for element in root.iter():
        for collision in element.findall("collision"):
            element.remove(collision)
    for mesh in root.iter("mesh"):
        named = mesh.find("uri")
        uri = (named.text or "").strip() if named is not None else mesh.get("filename", "")
        if "://" in uri:
            continue
        at = (file.resolve().parent / uri).as_uri()
        if named is not None:
            named.text = at
        else:
            mesh.set("filename", at)
    return ElementTree.tostring(root, encoding="unicode")


def _bolt_bases(plant: MultibodyPlant, models: tuple[ModelInstanceIndex, ...]) -> None:
    """Weld what hangs on no joint to the world."""
    children = {
        plant.get_joint(index).child_body().index()
        for model in models
        for index in plant.GetJointIndices(model)
    }
    for model in models:
        for index in plant.GetBodyIndices(model):
            if index not in children:
                plant.WeldFrames(plant.world_frame(), plant.get_body(index).body_frame())
