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
from riseg_drake.stations.camera_mount import CameraMount
from riseg_drake.stations.sensor_noise import SensorNoise, Sight, noisy_color, noisy_depth


@dataclass
class CameraConfig(CameraMount):
    """A D415's colour camera, 848x480 cropped to its central 640x480, with depth aligned to it."""

    width: int = field(default=640, metadata={"least": 16, "most": 16384})
    """px"""
    height: int = field(default=480, metadata={"least": 16, "most": 16384})
    """px"""
    fx: float = field(default=616.285, metadata={"least": 10, "most": 100000.0})
    """px"""
    fy: float = field(default=615.778, metadata={"least": 10, "most": 100000.0})
    """px"""
    cx: float = 301.418
    """px"""
    cy: float = 232.864
    """px"""
    rate: float = field(default=15.0, metadata={"least": 0.5, "most": 120})
    """Pictures a second."""
    depth_min: float = field(default=0.3, metadata={"least": 0.0, "most": 20.0})
    """Nearest depth that is measured, m."""
    depth_max: float = field(default=3.0, metadata={"least": 0.0, "most": 20.0})
    """Farthest depth that is measured, m."""
    noise: SensorNoise = field(default_factory=SensorNoise)
    mount_turn: list[float] = field(
        default_factory=lambda: [0.0, 0.0, 0.0], metadata={"sizes": (3,), "least": -0.5, "most": 0.5}
    )
    """Rotation vector in C, rad, by which the camera really is turned on the arm: what a hand-eye calibration
    has wrong, a few milliradians at best,"""
    mount_shift: list[float] = field(
        default_factory=lambda: [0.0, 0.0, 0.0], metadata={"sizes": (3,), "least": -0.1, "most": 0.1}
    )
    """and by which it is shifted, m: a millimetre or two at best."""

    def check(self) -> None:
        """Raise ValueError for a camera that cannot be."""
        self.check_mount()
        check_camera(self.cx, self.cy, self.width, self.height, self.depth_min, self.depth_max)

    @property
    def intrinsics(self) -> Intrinsics:
        """The pinhole."""
        return Intrinsics(self.width, self.height, self.fx, self.fy, self.cx, self.cy)


def check_camera(cx: float, cy: float, width: int, height: int, depth_min: float, depth_max: float) -> None:
    """Raise ValueError where the principal point, px, is not in the picture, or no depth, m, is believed."""
    for name, centre, size in (("cx", cx, width), ("cy", cy, height)):
        if not 0 <= centre < size:
            raise ValueError(f"{name} is {centre:g}; expected a pixel of the picture, 0 to {size - 1}")
    if not depth_min < depth_max:
        raise ValueError(f"depth_min is {depth_min:g}; less than depth_max, {depth_max:g} m")


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
    one instant; before the first picture the images have no pixels and the time is -1. The noise depends on
    the seed, on the number of the picture and on the pose alone.
    """

    def __init__(self, config: CameraConfig, seed: int, period: float, delay: float):
        super().__init__()
        self._config = config
        self._seed = seed
        size = (config.width, config.height)
        self._color_in = self.DeclareAbstractInputPort("color_image", Value(ImageRgba8U(*size)))
        self._depth_in = self.DeclareAbstractInputPort("depth_image", Value(ImageDepth32F(*size)))
        self._pose_in = self.DeclareAbstractInputPort("camera_pose", Value(RigidTransform()))
        self._color = self.DeclareAbstractState(Value(ImageRgba8U()))
        self._depth = self.DeclareAbstractState(Value(ImageDepth32F()))
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
        size = (self._config.width, self._config.height)
        color, depth = ImageRgba8U(*size), ImageDepth32F(*size)
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
        state.get_mutable_abstract_state(int(self._color)).set_value(color)
        state.get_mutable_abstract_state(int(self._depth)).set_value(depth)
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
