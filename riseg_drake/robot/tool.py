"""Which tool is on the arm's flange: one of the project's own, or a model file of somebody's own."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, ModelInstanceIndex, RigidBody

from riseg_drake.host.model_files import ModelFileError, reading_model
from riseg_drake.host.terminal import one_line

OWN_TOOLS = {"bar": ("pusher.sdf", "bar.sdf"), "hand": ("hand_with_camera.sdf", "hand.sdf")}
"""Files in models/pusher by the tool's name: with a camera on it, and bare, for a camera that is elsewhere."""
NO_CAMERA = (
    "no frame `camera` (the colour camera's optical frame: x right, y down, z ahead); without one the camera's "
    "place is told by X_EC, or by mount: world"
)
ENDINGS = (".sdf", ".urdf")


class ToolError(ValueError):
    """What is wrong with a tool, in one line that begins with its name."""


@dataclass(frozen=True)
class ToolParts:
    """Where to find the tool's pieces in a plant."""

    instance: ModelInstanceIndex
    tip_frame: Frame
    """E."""
    camera_frame: Frame | None
    """C; None where the tool carries no camera."""


def tool_file(tool: str, models: Path, bare: bool) -> Path:
    """The model file of `bar`, `hand` or a path; `bare` without a camera. Raises ToolError if it is not there.

    `models` is the folder of the project's own models.
    """
    if tool in OWN_TOOLS:
        return models / "pusher" / OWN_TOOLS[tool][bare]
    file = Path(tool)
    if file.suffix not in ENDINGS or not file.is_file():
        what = "no file" if file.suffix in ENDINGS else "no SDF or URDF file"
        raise ToolError(f"{tool}: {what}; a tool is {', '.join(OWN_TOOLS)} or an .sdf or .urdf file")
    return file


def add_tool(
    plant: MultibodyPlant,
    parser: Parser,
    file: Path,
    flange: Frame,
    yaw: float,
    find_packages: Callable[[Parser, Path], None],
) -> ToolParts:
    """Read a tool and weld its base link to the flange, turned by `yaw`, rad, about the flange's z axis.

    The base link is the one that hangs on no joint of the file. Its frame comes to lie on the flange's:
    panda_link8, z out along the tool. `find_packages` makes the packages that a file names known to a parser.

    Raises ToolError: no model, several, links that hang together by no joint or move, no frame `tip`.
    """
    parser.SetAutoRenaming(True)
    try:
        with reading_model(file):
            find_packages(parser, file)
            instances = parser.AddModels(file)
    except (ModelFileError, RuntimeError, ValueError, SystemExit) as error:  # SystemExit: Drake's assertions
        raise ToolError(f"{file}: cannot be read: {one_line(error)}") from None
    finally:
        parser.SetAutoRenaming(False)
    if len(instances) != 1:
        raise ToolError(f"{file}: {len(instances)} models; a tool is one")
    (instance,) = instances
    base = _base(plant, instance, file)
    plant.WeldFrames(flange, base.body_frame(), RigidTransform(RollPitchYaw(0, 0, yaw), np.zeros(3)))
    if not plant.HasFrameNamed("tip", instance):
        raise ToolError(
            f"{file}: no frame `tip`; it belongs in the middle of the tip's end face, "
            "z out along the tool, x the direction of pushing"
        )
    camera = plant.GetFrameByName("camera", instance) if plant.HasFrameNamed("camera", instance) else None
    return ToolParts(instance, plant.GetFrameByName("tip", instance), camera)


def _base(plant: MultibodyPlant, instance: ModelInstanceIndex, file: Path) -> RigidBody:
    """The link that is to be welded to the flange. Raises ToolError."""
    joints = [plant.get_joint(index) for index in plant.GetJointIndices(instance)]
    for joint in joints:
        if joint.parent_body().index() == plant.world_body().index():
            raise ToolError(f"{file}: it is fixed to the world; it is to be welded to the flange (panda_link8)")
        if joint.num_velocities():
            raise ToolError(f"{file}: its joint {joint.name()!r} can move; make it fixed (fingers closed, say)")
    children = {joint.child_body().index() for joint in joints}
    bodies = plant.GetBodyIndices(instance)
    loose = [plant.get_body(index) for index in bodies if index not in children]
    if len(loose) != 1:
        names = ", ".join(body.name() for body in loose)
        raise ToolError(f"{file}: its links {names} hang together by no joint; fixed joints would do")
    return loose[0]
