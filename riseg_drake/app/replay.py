"""A recording put through Alg. 2 once more: the same systems, wired in the same way, without a robot."""

import numpy as np
from numpy.typing import NDArray
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, Diagram
from pydrake.systems.sensors import ImageDepth32F, ImageRgba8U

from riseg_drake.app.scenario import Scenario
from riseg_drake.app.segmentation_block import make_segmentation
from riseg_drake.recording.layout import RecordedFrame
from riseg_drake.robot.kinematics import PandaKinematics


class Replay:
    """Alg. 2 on its own, fed one recorded frame after the other.

    What it answers depends on the frames, the scenario and the seed alone: with the run's own scenario
    and seed it gives the run's own masks, to the last pixel.
    """

    def __init__(self, scenario: Scenario, kinematics: PandaKinematics, seed: int):
        self._diagram, _ = make_segmentation(scenario, kinematics, seed)
        self._simulator = Simulator(self._diagram)
        self._period = 1 / scenario.station.camera.rate
        self._ticks = 0

    def mask_after(self, frame: RecordedFrame) -> NDArray[np.uint16]:
        """L_t [H, W] once this frame is taken in. Raises ValueError if joint angles were not recorded."""
        context = self._simulator.get_mutable_context()
        _fix_inputs(self._diagram, context, frame)
        # Before the camera's next tick each stage has done its work for this one.
        self._ticks += 1
        self._simulator.AdvanceTo((self._ticks - 0.5) * self._period)
        return self._diagram.GetOutputPort("mask").Eval(context)


def _fix_inputs(diagram: Diagram, context: Context, frame: RecordedFrame) -> None:
    if frame.position is None:
        raise ValueError("the recording has no joint angles (joints.csv)")
    height, width = frame.depth.shape
    color, depth = ImageRgba8U(width, height), ImageDepth32F(width, height)
    color.mutable_data[..., :3] = frame.color
    color.mutable_data[..., 3] = 255
    depth.mutable_data[..., 0] = frame.depth
    for name, value in (
        ("color_image", color),
        ("depth_image", depth),
        ("image_time", [frame.time]),
        ("position", frame.position),
    ):
        diagram.GetInputPort(name).FixValue(context, value)
