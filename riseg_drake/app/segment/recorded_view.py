"""Who says where a recording's camera was and what the robot hid: its joints, its files, or nobody."""

from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from riseg_drake.app.scenario import Scenario
from riseg_drake.geometry.rgbd import Frame
from riseg_drake.host.model_files import ModelFileError, reading_model
from riseg_drake.host.terminal import one_line
from riseg_drake.recording import layout
from riseg_drake.recording.layout import RecordedFrame, RecordingError
from riseg_drake.recording.source import RecordedSource
from riseg_drake.robot.kinematics import PandaKinematics
from riseg_drake.robot.own_robot import OwnRobot, OwnRobotError
from riseg_drake.robot.silhouette import Kinematics, RobotSilhouette, UnknownShapeError
from riseg_drake.systems.frame_view import FrameView

PANDA_JOINTS = 7
FIXED = "fixed camera"
"""Where poses come from if nobody tells any."""


@dataclass(frozen=True)
class RecordedView:
    """The view of a recording's camera, and in words where it comes from."""

    view: FrameView
    camera_poses: str
    robot_pixels: str
    warnings: list[str]
    X_WC: Callable[[NDArray], NDArray] | None = None
    """The camera's pose at joint angles; None where it follows from none."""
    robot_mask: Callable[[NDArray], NDArray] | None = None
    """The robot's own pixels at joint angles; None where they follow from none."""
    kinematics: Kinematics | None = None
    """The robot that carries the camera; None where none is known."""

    def frame(self, recorded: RecordedFrame) -> Frame:
        """A recorded frame as the algorithm sees it, but for its number."""
        X_WC, robot = recorded.X_WC, recorded.robot
        if self.X_WC is not None and recorded.position is not None:
            X_WC = self.X_WC(recorded.position)
        if robot is None and self.robot_mask is not None and recorded.position is not None:
            robot = self.robot_mask(recorded.position)
        return Frame(
            sequence=0,
            time=recorded.time,
            intrinsics=self.view.intrinsics,
            color=recorded.color,
            depth=recorded.depth,
            X_WC=np.eye(4) if X_WC is None else X_WC,
            robot=np.zeros(recorded.depth.shape, bool) if robot is None else robot,
        )


def recorded_view(
    reader: RecordedSource, scenario: Scenario, robot: Path | None, camera_frame: str
) -> RecordedView:
    """The view that fits what a recording holds.

    With joint angles, poses and robot masks follow from them: for the Panda that the scenario describes, or
    for a robot of one's own. Without, they are those of the recording; without any, the camera stands still
    and no robot is seen.

    Raises RecordingError or OwnRobotError.
    """
    masks = reader.holds_images(layout.ROBOT_FOLDER) and reader.images_beside(layout.ROBOT_FOLDER) > 0
    if reader.joints is None:
        if robot is not None:
            raise RecordingError(
                f"{reader.path} has no joint angles ({layout.JOINT_LIST}, or JointState in a bag); "
                "--robot says nothing without them"
            )
        return RecordedView(
            FrameView(reader.intrinsics, None, None),
            camera_poses=reader.camera_poses or FIXED,
            robot_pixels=f"{layout.ROBOT_FOLDER}/" if masks else "none",
            warnings=[],
        )
    number = reader.joints.values.shape[1]
    kinematics = _kinematics(reader, number, scenario, robot, camera_frame)
    warnings = []
    try:
        with nullcontext() if robot is None else reading_model(robot):
            robot_mask = RobotSilhouette(kinematics, reader.intrinsics).mask
        source = reader.joints.path.name
    except UnknownShapeError as error:
        robot_mask, source = None, f"{layout.ROBOT_FOLDER}/" if masks else "none"
        warnings.append(f"{robot}: {error}; robot masks: {source}")
    except ModelFileError as error:
        raise OwnRobotError(f"{robot}: {error}; --robot names a URDF or SDF file") from None
    return RecordedView(
        FrameView(reader.intrinsics, kinematics.X_WC, robot_mask, number),
        camera_poses=reader.joints.path.name,
        robot_pixels=source,
        warnings=warnings,
        X_WC=kinematics.X_WC,
        robot_mask=robot_mask,
        kinematics=kinematics,
    )


def _kinematics(
    reader: RecordedSource, number: int, scenario: Scenario, robot: Path | None, camera_frame: str
) -> Kinematics:
    assert reader.joints is not None
    if robot is not None:
        try:
            with reading_model(robot):
                return OwnRobot(robot, camera_frame, reader.joints.names or [""] * number)
        except ModelFileError as error:
            raise OwnRobotError(f"{robot}: {error}; --robot names a URDF or SDF file") from None
        except SystemExit as error:  # one of Drake's assertions
            raise OwnRobotError(f"{robot}: {one_line(error)}") from None
    if number != PANDA_JOINTS:
        raise RecordingError(
            f"{reader.joints.path}: line {reader.joints.lines[0]} holds {number} joint angles, the Panda has "
            f"{PANDA_JOINTS}; name your own robot with --robot and --camera-frame"
        )
    return PandaKinematics(scenario.station.panda, scenario.station.camera.fixed_pose)
