"""The real arm and camera behind the ports of `contract.py`, by way of their drivers on LCM.

What the ports show is of one instant, that of the newest picture: `panda.position_measured` is where the arm
was when it was taken. So whoever pairs the two cannot do it wrong, however late a picture comes; what must
know where the arm is now, which is the process that sends commands, listens to the arm itself.
"""

from dataclasses import dataclass, field
from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray
from pydrake.common.value import AbstractValue
from pydrake.geometry import Meshcat, MeshcatVisualizerParams
from pydrake.systems.framework import (
    BasicVector,
    Context,
    Diagram,
    DiagramBuilder,
    EventStatus,
    LeafSystem,
    State,
)
from pydrake.systems.sensors import ImageDepth32F, ImageRgba8U

from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.geometry.rgbd import Immutable
from riseg_drake.robot.command_stream import CommandParameters
from riseg_drake.robot.description import PandaDescription
from riseg_drake.robot.kinematics import OBSERVE_HEIGHTS, OBSERVE_PITCHES
from riseg_drake.robot.limits import check_start_position
from riseg_drake.stations.arm_messages import AHEAD
from riseg_drake.stations.arm_view import add_arm_view
from riseg_drake.stations.camera_mount import CameraMount
from riseg_drake.stations.lcm_channels import LcmConfig
from riseg_drake.stations.lcm_images import ImageError, LcmImages, decode_images
from riseg_drake.stations.lcm_reception import Reception
from riseg_drake.stations.realsense import CameraDriverConfig
from riseg_drake.stations.wrist_camera import check_camera

LONGEST_EXPOSURE = 1.0
"""A picture is sent at most this long after it was taken, s."""
_SQUARE, _MIDDLE = 0.1, 0.1
"""Shares by which fx and fy differ at most, and in which the principal point is off the middle."""
TARGET_PERIOD = 0.01
"""Time between two targets for the arm, s; the process that sends commands puts a cubic between them."""


@dataclass
class HardwareCameraConfig(CameraMount):
    """The RealSense camera, as its driver was started."""

    width: int = field(default=640, metadata={"least": 0, "most": 16384})
    """Columns used, from the middle of the picture; 0: all of them. px"""
    fx: float = field(default=616.285, metadata={"least": 10, "most": 100000.0})
    """Of the whole picture, as the driver calibrates it; px."""
    fy: float = field(default=615.778, metadata={"least": 10, "most": 100000.0})
    """px"""
    cx: float = 405.418
    """px; a picture of which only the middle is used need not be thought of."""
    cy: float = 232.864
    """px"""
    full_width: int = field(default=848, metadata={"least": 16, "most": 16384})
    """Size of the pictures that the driver sends, px."""
    full_height: int = field(default=480, metadata={"least": 16, "most": 16384})
    """px"""
    rate: float = field(default=15.0, metadata={"least": 0.5, "most": 120})
    """Pictures looked at in a second, at most; fewer where the computer is busy."""
    latency: float = field(default=0.0, metadata={"least": 0.0, "most": 1.0})
    """A picture shows where the arm was this long before the picture's stamp, s."""
    depth_min: float = field(default=0.3, metadata={"least": 0.0, "most": 20.0})
    """Nearest depth that is believed, m."""
    depth_max: float = field(default=3.0, metadata={"least": 0.0, "most": 20.0})
    """Farthest depth that is believed, m."""
    driver: CameraDriverConfig = field(default_factory=CameraDriverConfig)
    """What `riseg drive-camera` sets on it."""

    def check(self) -> None:
        """Raise ValueError for a camera that cannot be."""
        self.check_mount()
        check_camera(self.cx, self.cy, self.full_width, self.full_height, self.depth_min, self.depth_max)
        if abs(self.fx / self.fy - 1) > _SQUARE:
            raise ValueError(f"fx is {self.fx:g} and fy {self.fy:g}; a RealSense camera's pixels are square")
        for name, centre, side in (("cx", self.cx, "full_width"), ("cy", self.cy, "full_height")):
            size = getattr(self, side)
            if abs(centre / size - 0.5) > _MIDDLE:
                raise ValueError(f"{name} is {centre:g}; expected about half of {side}, {size / 2:g} px")
        if self.width > self.full_width:
            raise ValueError(f"width is {self.width}; at most full_width, {self.full_width} px")

    @property
    def first_column(self) -> int:
        """Where the part that is used begins, px."""
        return (self.full_width - (self.width or self.full_width)) // 2

    @property
    def intrinsics(self) -> Intrinsics:
        """The pinhole of the part that is used."""
        width = self.width or self.full_width
        return Intrinsics(width, self.full_height, self.fx, self.fy, self.cx - self.first_column, self.cy)


@dataclass
class HardwareStationConfig:
    """Everything that has to be said about a robot."""

    panda: PandaDescription = field(default_factory=PandaDescription)
    camera: HardwareCameraConfig = field(default_factory=HardwareCameraConfig)
    lcm: LcmConfig = field(default_factory=LcmConfig)
    command: CommandParameters = field(default_factory=CommandParameters)
    centre_W: list[float] = field(
        default_factory=lambda: [0.5, 0.0], metadata={"sizes": (2,), "least": -1.5, "most": 1.5}
    )
    """Middle of the work area on the table, x and y in W, m; the camera looks at it between pushes."""
    observe_height: float = field(default=0.5, metadata=OBSERVE_HEIGHTS)
    """Distance of the camera from it then, m: its height, where it looks straight down."""
    observe_pitch: float = field(default=0.0, metadata=OBSERVE_PITCHES)
    """How far the view leans from straight down then, rad, from the side where the arm has most room."""
    start_position: list[float] = field(default_factory=list, metadata={"sizes": (0, 7)})
    """Joint angles to look from instead, rad, 7; empty: as the lines above say."""

    def check(self) -> None:
        """Raise ValueError for what this robot cannot do."""
        limits = self.panda.limits
        try:
            self.command.check(limits)
        except ValueError as error:
            raise ValueError(f"command.{error}") from None
        check_start_position(self.start_position, limits, self.command.limits.position_margin)
        lower, upper = self.command.safety.workspace_lower, self.command.safety.workspace_upper
        if not all(low <= c <= high for low, c, high in zip(lower, self.centre_W, upper, strict=False)):
            raise ValueError(
                f"centre_W is {self.centre_W}; expected in the workspace, from {lower[:2]} to {upper[:2]} m"
            )


class TargetSink(Protocol):
    """Who moves the arm."""

    def send_target(self, time: float, position: NDArray) -> None:
        """Joint angles [7], rad, to be at about the time `time`, s, by a clock that goes on evenly."""

    def done_until(self) -> float:
        """Up to what time, s, targets have been gone through: the arm may be late."""


class HardwareStation(Diagram):
    """Behind its ports are the drivers. The context's time must be that of the reception's clock.

    Without `sink` nothing is moved: what comes in at `panda.position` is ignored. Raises ImageError when
    no picture comes any more that can be used.
    """

    def __init__(
        self,
        config: HardwareStationConfig,
        reception: Reception,
        sink: TargetSink | None = None,
        meshcat: Meshcat | None = None,
    ):
        super().__init__()
        builder = DiagramBuilder()
        view = builder.AddSystem(LcmView(config.camera, reception))
        targets = builder.AddSystem(Targets(sink))
        builder.ExportInput(targets.get_input_port(), "panda.position")
        for name, port in LcmView.PORTS.items():
            builder.ExportOutput(view.GetOutputPort(port), name)
        if meshcat is not None:
            angles = add_arm_view(
                builder, config.panda, config.camera.fixed_pose, meshcat, MeshcatVisualizerParams()
            )
            builder.Connect(view.GetOutputPort("position"), angles)
        builder.BuildInto(self)
        self.set_name("station")


class Targets(LeafSystem):
    """Hands the joint angles at its input on, with the time that they are meant for."""

    def __init__(self, sink: TargetSink | None):
        super().__init__()
        self.set_name("targets")
        self._sink = sink
        self._position = self.DeclareVectorInputPort("position", 7)
        self.DeclarePeriodicPublishEvent(TARGET_PERIOD, 0.0, self._publish)

    def _publish(self, context: Context) -> EventStatus:
        if self._sink is None:
            return EventStatus.DidNothing()
        self._sink.send_target(context.get_time(), self._position.Eval(context))
        return EventStatus.Succeeded()


@dataclass(frozen=True)
class Sight(Immutable):
    """A picture with the arm at the time it was taken."""

    color: ImageRgba8U
    depth: ImageDepth32F
    time: float
    """When it was taken, s."""
    sent: float
    """When the message was sent, s, which tells whether another is newer."""
    position: NDArray[np.float64]
    """rad [7]"""
    velocity: NDArray[np.float64]
    """rad/s [7]"""


NO_SIGHT = Sight(ImageRgba8U(), ImageDepth32F(), -1.0, -np.inf, np.zeros(7), np.zeros(7))
"""What there is before the first picture."""


def newest_sight(reception: Reception, config: HardwareCameraConfig, after: float) -> Sight | None:
    """The newest picture sent later than `after`, s; None where there is none, or its arm is not known yet.

    A picture that cannot be used is left out. Raises ImageError, of the last of them, when there are no others
    for a while: the camera is blind, or is not the one that the scenario has.
    """
    newest = reception.newest_picture(after)
    if newest is None:
        return None
    sent, message = newest
    try:
        images = decode_images(message, (config.full_width, config.full_height))
        taken = sent + (images.time - message.header.utime * 1e-6)
        if not sent - LONGEST_EXPOSURE <= taken <= sent + AHEAD:
            raise ImageError(
                f"colour is stamped {abs(taken - sent):.3f} s {'after' if taken > sent else 'before'} its "
                "message; the camera's driver must stamp by the computer's clock (global time enabled)"
            )
        color, depth = as_drake_images(images, config)
    except ImageError as error:
        reception.skip(sent, error)
        return None
    reception.used()
    arm = reception.state_at(taken - config.latency)
    return None if arm is None else Sight(color, depth, taken, sent, *arm)


class LcmView(LeafSystem):
    """The newest picture, and the arm at the time it was taken; looks for a newer one at the camera's rate.

    When the diagram's time is behind the clock by more than a period, because segmentation takes longer
    than that, it shows no newer picture until the diagram has caught up: pictures are skipped, time is not.
    """

    PORTS: ClassVar[dict[str, str]] = {
        "wrist.color_image": "color_image",
        "wrist.depth_image": "depth_image",
        "wrist.image_time": "image_time",
        "panda.position_measured": "position",
        "panda.velocity_measured": "velocity",
    }
    """By their names at the station."""

    def __init__(self, config: HardwareCameraConfig, reception: Reception):
        super().__init__()
        self.set_name("drivers")
        self._config, self._reception = config, reception
        self._state = self.DeclareAbstractState(AbstractValue.Make(NO_SIGHT))
        ticket = {self.abstract_state_ticket(self._state)}
        self.DeclareAbstractOutputPort(
            "color_image",
            AbstractValue.Make(NO_SIGHT.color).Clone,
            lambda context, output: output.set_value(self._shown(context).color),
            ticket,
        )
        self.DeclareAbstractOutputPort(
            "depth_image",
            AbstractValue.Make(NO_SIGHT.depth).Clone,
            lambda context, output: output.set_value(self._shown(context).depth),
            ticket,
        )
        self.DeclareVectorOutputPort("image_time", 1, self._calc_time, ticket)
        self.DeclareVectorOutputPort("position", 7, self._calc_position, ticket)
        self.DeclareVectorOutputPort("velocity", 7, self._calc_velocity, ticket)
        self.DeclarePeriodicUnrestrictedUpdateEvent(1 / config.rate, 0.0, self._look)

    def _shown(self, context: Context) -> Sight:
        return context.get_abstract_state(int(self._state)).get_value()

    def _calc_time(self, context: Context, output: BasicVector) -> None:
        output.SetAtIndex(0, self._shown(context).time)

    def _calc_position(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._shown(context).position)

    def _calc_velocity(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._shown(context).velocity)

    def _look(self, context: Context, state: State) -> EventStatus:
        shown = self._shown(context)
        if self._reception.clock() - context.get_time() > 1 / self._config.rate:
            return EventStatus.DidNothing()
        sight = newest_sight(self._reception, self._config, after=shown.sent)
        if sight is None or sight.time <= shown.time:
            return EventStatus.DidNothing()
        state.get_mutable_abstract_state(int(self._state)).set_value(sight)
        return EventStatus.Succeeded()


def as_drake_images(images: LcmImages, config: HardwareCameraConfig) -> tuple[ImageRgba8U, ImageDepth32F]:
    """The part of a picture that is used, and where its depth is believed; it has the camera's size."""
    height, width = images.depth.shape
    columns = slice(config.first_column, width - config.first_column)
    cropped = images.depth[:, columns]
    color = ImageRgba8U(cropped.shape[1], height)
    color.mutable_data[..., :3] = images.color[:, columns]
    color.mutable_data[..., 3] = 255
    depth = ImageDepth32F(cropped.shape[1], height)
    depth.mutable_data[..., 0] = cropped * ((cropped >= config.depth_min) & (cropped <= config.depth_max))
    return color, depth
