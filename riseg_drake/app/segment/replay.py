"""A recording put through Alg. 2: the same systems, wired in the same way, without a robot."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, Diagram, LeafSystem
from pydrake.systems.sensors import ImageDepth32F, ImageRgba8U

from riseg_drake.app.scenario import Scenario
from riseg_drake.app.segmentation_block import make_segmentation
from riseg_drake.recording.layout import RecordedFrame
from riseg_drake.segmentation.segmentation import Segmentation
from riseg_drake.segmentation.table_plane import NoPlaneError
from riseg_drake.systems.frame_view import FrameView

PERIOD = 1 / 15
"""Of the diagram's own clock, s. The stages go by the frames' stamps, whatever rate these have."""


class Replay:
    """Alg. 2 on its own, fed one recorded frame after the other.

    What it answers depends on the frames, the scenario and the seed alone: with the run's own scenario
    and seed it gives the run's own masks, to the last pixel.
    """

    def __init__(self, scenario: Scenario, view: FrameView, seed: int):
        self._diagram, stages = make_segmentation(scenario, view, PERIOD, seed)
        self.stages: Iterable[LeafSystem] = stages
        """The systems, for whoever wants to time them."""
        self._simulator = Simulator(self._diagram)
        self._ticks = 0

    def mask_after(self, frame: RecordedFrame) -> NDArray[np.uint16]:
        """L_t [H, W] once this frame is taken in.

        Raises ValueError if the frame lacks what the view needs, or (NoPlaneError) shows no table; such a
        frame is passed over, and the next one can be given.
        """
        context = self._simulator.get_mutable_context()
        _fix_inputs(self._diagram, context, frame)
        # Before the camera's next tick each stage has done its work for this one.
        self._ticks += 1
        half_way = (self._ticks - 0.5) * PERIOD
        try:
            self._simulator.AdvanceTo(half_way)
        except ValueError:
            # Nothing was taken in: go on as if this tick had brought no frame.
            context.SetTime(half_way)
            self._simulator.Initialize()
            raise
        passed_over = self.read("passed_over")
        if passed_over.time == frame.time:
            raise NoPlaneError(passed_over.why)
        return self._diagram.GetOutputPort("mask").Eval(context)

    def read(self, port: str) -> Any:
        """What the last frame left at an output of `segmentation_block`."""
        return self._diagram.GetOutputPort(port).Eval(self._simulator.get_context())

    @property
    def segmentation(self) -> Segmentation:
        """What the last frame left: the mask, and which objects are known."""
        return self.read("segmentation")


def _fix_inputs(diagram: Diagram, context: Context, frame: RecordedFrame) -> None:
    height, width = frame.depth.shape
    color, depth = ImageRgba8U(width, height), ImageDepth32F(width, height)
    color.mutable_data[..., :3] = frame.color
    color.mutable_data[..., 3] = 255
    depth.mutable_data[..., 0] = frame.depth
    X_WC = np.eye(4) if frame.X_WC is None else frame.X_WC  # without poses, the camera stands still
    robot = np.zeros(frame.depth.shape, bool) if frame.robot is None else frame.robot
    values = {
        "color_image": color,
        "depth_image": depth,
        "image_time": [frame.time],
        "position": frame.position,
        "camera_pose": AbstractValue.Make(X_WC),
        "robot_pixels": AbstractValue.Make(robot),
    }
    for index in range(diagram.num_input_ports()):
        port = diagram.get_input_port(index)
        value = values[port.get_name()]
        if value is None:
            raise ValueError("the recording has no joint angles (joints.csv)")
        port.FixValue(context, value)
