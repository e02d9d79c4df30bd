"""The simulated D415: takes a picture at its own rate, with its own noise, and holds it."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from pydrake.common.value import AbstractValue, Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import Context, LeafSystem, State
from pydrake.systems.sensors import ImageDepth32F, ImageLabel16I, ImageRgba8U

from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.geometry.rgbd import sanitize_depth
from riseg_drake.stations.sensor_noise import SensorNoise, Sight, noisy_color, noisy_depth


@dataclass
class CameraConfig:
    """A D415's colour camera, 848x480 cropped to its central 640x480, with depth aligned to it."""

    width: int = 640
    """px"""
    height: int = 480
    """px"""
    fx: float = 616.285
    """px"""
    fy: float = 615.778
    """px"""
    cx: float = 301.418
    """px"""
    cy: float = 232.864
    """px"""
    rate: float = 15.0
    """Pictures a second."""
    depth_min: float = 0.3
    """Nearest depth that is measured, m."""
    depth_max: float = 3.0
    """Farthest depth that is measured, m."""
    noise: SensorNoise = field(default_factory=SensorNoise)
    mount_turn: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    """Rotation vector in C, rad, by which the camera really is turned on the arm: what a hand-eye calibration
    has wrong, a few milliradians at best,"""
    mount_shift: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    """and by which it is shifted, m: a millimetre or two at best."""

    @property
    def intrinsics(self) -> Intrinsics:
        """The pinhole."""
        return Intrinsics(self.width, self.height, self.fx, self.fy, self.cx, self.cy)


def measured_images(
    color: NDArray[np.uint8],
    depth: NDArray,
    config: CameraConfig,
    rng: np.random.Generator,
    X_WC: NDArray[np.float64],
    seed: int,
) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
    """What the sensor makes of true colour [H, W, 3] and depth [H, W], m: with noise, and 0 = invalid.

    `rng` draws the noise of this picture; the camera's pose X_WC [4, 4] and the seed how depth errs from there.
    """
    seen = noisy_color(np.ascontiguousarray(color), config.noise, rng)
    sight = Sight(color, config.intrinsics, X_WC, seed)
    measured = noisy_depth(sanitize_depth(depth), config.noise, rng, sight)
    within = (measured >= config.depth_min) & (measured <= config.depth_max)
    return seen, measured * within


class WristCamera(LeafSystem):
    """Takes a noisy picture of what the ideal sensor at its inputs shows, and holds it.

    Inputs `color_image` (ImageRgba8U), `depth_image` (ImageDepth32F) and `camera_pose` (RigidTransform, of
    the camera or of its body, in the world) are evaluated at the pictures' times only: at the start, then
    every `period`, `delay` late. Outputs of the same names as the images and `image_time` (s) are always of
    one instant; before the first picture the images are black and the time is -1. The noise depends on the
    seed, on the number of the picture and on the pose alone.
    """

    def __init__(self, config: CameraConfig, seed: int, period: float, delay: float):
        super().__init__()
        self._config = config
        self._seed = seed
        size = (config.width, config.height)
        self._color_in = self.DeclareAbstractInputPort("color_image", Value(ImageRgba8U(*size)))
        self._depth_in = self.DeclareAbstractInputPort("depth_image", Value(ImageDepth32F(*size)))
        self._pose_in = self.DeclareAbstractInputPort("camera_pose", Value(RigidTransform()))
        self._color = self.DeclareAbstractState(Value(ImageRgba8U(*size)))
        self._depth = self.DeclareAbstractState(Value(ImageDepth32F(*size)))
        # The time of the picture, and how many pictures were taken before it.
        self._stamp = self.DeclareDiscreteState([-1.0, -1.0])
        self.DeclareStateOutputPort("color_image", self._color)
        self.DeclareStateOutputPort("depth_image", self._depth)
        self.DeclareVectorOutputPort(
            "image_time",
            1,
            lambda context, output: output.SetAtIndex(0, context.get_discrete_state(0)[0]),
            prerequisites_of_calc={self.discrete_state_ticket(self._stamp)},
        )
        self.DeclareInitializationUnrestrictedUpdateEvent(self._take)
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, period + delay, self._take)

    def _take(self, context: Context, state: State) -> None:
        stamp = state.get_mutable_discrete_state(0)
        number = int(stamp[1]) + 1
        rng = np.random.default_rng([self._seed, number])
        color = state.get_mutable_abstract_state(int(self._color)).get_mutable_value()
        depth = state.get_mutable_abstract_state(int(self._depth)).get_mutable_value()
        seen = self._color_in.Eval(context).data
        color.mutable_data[:] = seen
        color.mutable_data[..., :3], depth.mutable_data[..., 0] = measured_images(
            seen[..., :3],
            self._depth_in.Eval(context).data[..., 0],
            self._config,
            rng,
            self._pose_in.Eval(context).GetAsMatrix4(),
            self._seed,
        )
        stamp.set_value([context.get_time(), number])


class ObjectLabels(LeafSystem):
    """Translates Drake's label image into object ids by a table [32768], when it is asked for."""

    def __init__(self, config: CameraConfig, table: NDArray[np.int16]):
        super().__init__()
        self._table = table
        image = ImageLabel16I(config.width, config.height)
        self._labels = self.DeclareAbstractInputPort("label_image", Value(image))
        self.DeclareAbstractOutputPort(
            "label_image",
            lambda: AbstractValue.Make(image),
            self._translate,
            prerequisites_of_calc={self.input_port_ticket(self._labels.get_index())},
        )

    def _translate(self, context: Context, output: AbstractValue) -> None:
        output.get_mutable_value().mutable_data[:] = self._table[self._labels.Eval(context).data]
