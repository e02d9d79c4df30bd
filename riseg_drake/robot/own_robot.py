"""A robot of one's own, from its URDF or SDF: where its camera is, and what shapes it has."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import SceneGraphInspector
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, ModelInstanceIndex
from pydrake.planning import RobotDiagramBuilder

from riseg_drake.robot.description import register_models


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
        builder = RobotDiagramBuilder(time_step=0.0)
        self.plant: MultibodyPlant = builder.plant()
        parser = Parser(self.plant)
        register_models(parser)
        _find_packages(parser, file)
        try:
            self._models = tuple(parser.AddModels(str(file)))
            _bolt_bases(self.plant, self._models)
            self.plant.Finalize()
        except (RuntimeError, ValueError) as error:
            raise OwnRobotError(f"{file}: {' '.join(str(error).split())}") from None
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


def _find_packages(parser: Parser, file: Path) -> None:
    """Make `package://` work as in ROS: packages on the path, and the one that the file lies in."""
    packages = parser.package_map()
    packages.PopulateFromRosPackagePath()
    for folder in file.resolve().parents:
        if (folder / "package.xml").is_file():
            packages.AddPackageXml(str(folder / "package.xml"))
            return


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
