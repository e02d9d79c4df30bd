"""Which arm, with which tool: from model files into a MultibodyPlant."""

import math
import re
from dataclasses import dataclass, field
from importlib.resources import files
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import Box, SceneGraph
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import CoulombFriction, MultibodyPlant
from pydrake.multibody.tree import FixedOffsetFrame, Frame, ModelInstanceIndex

from riseg_drake.host.model_files import check_model
from riseg_drake.robot.limits import ROBOTS, RobotLimits
from riseg_drake.robot.tool import NO_CAMERA, ToolError, add_tool, tool_file
from riseg_drake.robot.tool_shape import tool_shape

MODELS_PACKAGE = "riseg_drake_models"
_PACKAGE_NAMED = re.compile(r"(?:package|model)://([^/\s\"'<>]+)/")
CAMERA_BOX = (0.14, 0.06, 0.06)
"""A camera on a stand with its plug and clamp, m: a RealSense D435 or D415 and 2 cm to each side."""
JOINT_NAMES = tuple(f"panda_joint{i}" for i in range(1, 8))


@dataclass
class PandaDescription:
    """The arm, and the tool on its flange. URLs are `package://` or `file://`."""

    robot: str = field(default="panda", metadata={"choices": tuple(ROBOTS)})
    """Whose limits hold, whatever the model says: the Panda's (Franka Emika Robot) or the Franka Research 3's.
    Their links are of the same lengths, so that one model draws both."""
    arm_url: str = f"package://{MODELS_PACKAGE}/panda/panda.urdf"
    """Or the official description: package://drake_models/franka_description/urdf/panda_arm.urdf."""
    tool: str = "bar"
    """`bar`, the paper's of 30 cm; `hand`, the Franka hand with closed fingers; or an SDF or URDF file, its
    path relative to the scenario's file, with the frames `tip` and, for a camera on the wrist, `camera`. Where
    the camera is fixed to the world, bar and hand carry none."""
    drake_models: str = ""
    """Folder of an offline copy of the package drake_models; empty: Drake's own, which it downloads."""
    tool_yaw: float = field(default=0.0, metadata={"least": -6.2832, "most": 6.2832})
    """By how much the tool is turned on the flange (panda_link8) about its z axis, beyond what its model says
    itself (the hand: by -45 degrees, as it is bolted), rad."""
    X_EC: list[float] = field(default_factory=list, metadata={"sizes": (0, 6)})
    """The camera on the tool as calibrated, in the frame of its tip: x, y, z in m, roll, pitch, yaw in rad;
    empty: as the tool's model has it."""

    def check(self) -> None:
        """Raise ValueError for a camera that is nowhere on the tool."""
        if any(abs(length) > 1 for length in self.X_EC[:3]):
            raise ValueError(f"X_EC is {self.X_EC}; x, y, z are metres from the tip, at most 1")
        if any(abs(angle) > 2 * math.pi for angle in self.X_EC[3:]):
            raise ValueError(f"X_EC is {self.X_EC}; roll, pitch, yaw are radians, at most 2 pi")

    @property
    def limits(self) -> RobotLimits:
        """What the robot's joints can do."""
        return ROBOTS[self.robot]


@dataclass(frozen=True)
class PandaParts:
    """Where to find the arm's pieces in a plant."""

    arm: ModelInstanceIndex
    tool: ModelInstanceIndex
    tip_frame: Frame
    """E."""
    camera_frame: Frame | None
    """C, colour optical frame; None where the camera should be on the tool, and the tool has none."""


def models_folder() -> Path:
    """The project's own model files, in a checkout and in an installed copy alike."""
    return Path(str(files("riseg_drake.models")))


def register_models(parser: Parser) -> None:
    """Make `package://riseg_drake_models/...` known to a parser."""
    packages = parser.package_map()
    if not packages.Contains(MODELS_PACKAGE):
        packages.Add(MODELS_PACKAGE, str(models_folder()))


def find_packages(parser: Parser, file: Path) -> None:
    """Make the `package://NAME/` and `model://NAME/` known to a parser that lie beside a file.

    As ROS has it, NAME is the package (package.xml) that the file lies in; as Gazebo has it, a folder that it
    lies in, or one beside such a folder. Raises ModelFileError for a mesh in one of them that no reader is to
    be given.
    """
    packages = parser.package_map()
    folders = file.resolve().parents
    for folder in folders:
        if (folder / "package.xml").is_file():
            packages.AddPackageXml(str(folder / "package.xml"))
            break
    named = sorted(set(_PACKAGE_NAMED.findall(file.read_text(errors="replace"))))
    for name in named:
        found = (
            at for at in (*folders, *(folder / name for folder in folders)) if at.name == name and at.is_dir()
        )
        if not packages.Contains(name) and (beside := next(found, None)):
            packages.Add(name, str(beside))
    check_model(file, {name: Path(packages.GetPath(name)) for name in named if packages.Contains(name)})


def add_panda(
    plant: MultibodyPlant, description: PandaDescription, X_WC: NDArray[np.float64] | None = None
) -> PandaParts:
    """Add the arm, standing on the table's level at the origin of W, with tool and camera.

    With `X_WC` [4, 4] the camera is fixed to the world there, and the arm must not touch it.

    Raises ValueError where an option names something that is not there, ToolError for a tool that is none.
    """
    parser = Parser(plant)
    register_models(parser)
    if description.drake_models:
        package_xml = Path(description.drake_models) / "package.xml"
        if not package_xml.is_file():
            raise ValueError(
                f"drake_models: {description.drake_models} has no package.xml; name the folder of a "
                "copy of RobotLocomotion/models, or leave it empty"
            )
        parser.package_map().Remove("drake_models")
        parser.package_map().AddPackageXml(str(package_xml))
    (arm,) = parser.AddModels(url=description.arm_url)
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("panda_link0", arm))
    file = tool_file(description.tool, models_folder(), bare=X_WC is not None)
    flange = plant.GetFrameByName("panda_link8", arm)
    tool = add_tool(plant, parser, file, flange, description.tool_yaw, find_packages)
    _set_limits(plant, arm, description.limits)
    camera_frame = tool.camera_frame
    if X_WC is not None:
        camera_frame = _add_fixed_camera(plant, RigidTransform(X_WC))
    elif description.X_EC:
        if len(description.X_EC) != 6:
            raise ValueError(
                f"X_EC: {len(description.X_EC)} numbers; expected 6: x, y, z in m and roll, pitch, yaw in rad"
            )
        X_EC = RigidTransform(RollPitchYaw(description.X_EC[3:]), description.X_EC[:3])
        camera_frame = plant.AddFrame(
            FixedOffsetFrame("calibrated_camera", tool.tip_frame, X_EC, tool.instance)
        )
    return PandaParts(arm=arm, tool=tool.instance, tip_frame=tool.tip_frame, camera_frame=camera_frame)


def check_tool(description: PandaDescription, X_WC: NDArray[np.float64] | None = None) -> None:
    """Raise ToolError for a tool that is none, or that lacks the camera which is on it without X_WC [4, 4]."""
    plant, scene_graph = MultibodyPlant(0.0), SceneGraph()
    plant.RegisterAsSourceForSceneGraph(scene_graph)
    parser = Parser(plant)
    register_models(parser)
    file = tool_file(description.tool, models_folder(), bare=X_WC is not None)
    tool = add_tool(plant, parser, file, plant.world_frame(), description.tool_yaw, find_packages)
    plant.Finalize()
    inspector = scene_graph.model_inspector()
    tool_shape(plant, inspector, tool.instance, tool.tip_frame, plant.world_frame(), str(file))
    bodies = [plant.get_body(index) for index in plant.GetBodyIndices(tool.instance)]
    if not any(plant.GetVisualGeometriesForBody(body) for body in bodies):
        raise ToolError(f"{file}: no visual geometry; by it the tool is told from the objects in the picture")
    if X_WC is None and tool.camera_frame is None and not description.X_EC:
        raise ToolError(f"{file}: {NO_CAMERA}")


def _add_fixed_camera(plant: MultibodyPlant, X_WC: RigidTransform) -> Frame:
    """A camera on a stand, as a box behind its lens; what holds it is not known here."""
    X_WBox = X_WC @ RigidTransform([0, 0, -CAMERA_BOX[2] / 2 - 0.002])
    world, box, name = plant.world_body(), Box(*CAMERA_BOX), "fixed_camera"
    plant.RegisterCollisionGeometry(world, X_WBox, box, name, CoulombFriction(1.0, 1.0))
    plant.RegisterVisualGeometry(world, X_WBox, box, name, np.array([0.72, 0.73, 0.75, 1.0]))
    return plant.AddFrame(FixedOffsetFrame(name, plant.world_frame(), X_WC))


def _set_limits(plant: MultibodyPlant, arm: ModelInstanceIndex, limits: RobotLimits) -> None:
    for index, name in enumerate(JOINT_NAMES):
        joint = plant.GetJointByName(name, arm)
        joint.set_position_limits([limits.position_lower[index]], [limits.position_upper[index]])
        joint.set_velocity_limits([-limits.velocity[index]], [limits.velocity[index]])
        joint.set_acceleration_limits([-limits.acceleration[index]], [limits.acceleration[index]])
