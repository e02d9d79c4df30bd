"""Alg. 2 wired: the same systems in the same way, whatever feeds them."""

from dataclasses import dataclass

from pydrake.systems.framework import Diagram, DiagramBuilder, InputPort, LeafSystem, OutputPort

from riseg_drake.app.flow_method import flow_method
from riseg_drake.app.scenario import Scenario
from riseg_drake.robot.kinematics import PandaKinematics
from riseg_drake.robot.silhouette import RobotSilhouette
from riseg_drake.systems.bfif_grouper import BFIFGrouper
from riseg_drake.systems.camera_motion import CameraMotion
from riseg_drake.systems.expected_flow import ExpectedFlow
from riseg_drake.systems.frame_pair import FramePairMemory
from riseg_drake.systems.frame_reducer import FrameReducer
from riseg_drake.systems.frame_view import FrameView
from riseg_drake.systems.mask_propagator import MaskPropagator
from riseg_drake.systems.objects_above_table import ObjectsAboveTable
from riseg_drake.systems.optical_flow import OpticalFlow

FRAME_OFFSET = 0.0004
"""A frame is taken in this long after the camera's tick, s: later than PICTURE_DELAY, lest it be the picture
before with the joint angles of now, and earlier than the simulation's next step, which changes these."""
MASK_OFFSET = 0.0006
"""L_t is made this long after the camera's tick, s: once the frame is in memory."""

FIXED_MARGIN_M, FIXED_MARGIN_PX = 0.003, 3.0
"""Before a camera that is fixed to the world the arm is drawn broader by so much, m on it and pixels: it moves
across the picture, all of its joints err, and flow smears its motion over its edge."""

STATION_PORTS = {
    "color_image": "wrist.color_image",
    "depth_image": "wrist.depth_image",
    "image_time": "wrist.image_time",
    "position": "panda.position_measured",
}
"""The inputs of Alg. 2, and which outputs of a station belong there."""


@dataclass(frozen=True)
class SegmentationBlock:
    """The systems of Alg. 2 in a builder, and the ports that are to be wired."""

    stages: list[LeafSystem]
    inputs: dict[str, InputPort]
    """Those of FrameView: the keys of STATION_PORTS where all follows from the joint angles."""
    outputs: dict[str, OutputPort]
    """`pair`, `passed_over`, `above_table`, `expected_flow`, `optical_flow`, `groups`, `mask`, `settled_mask`,
    `decided`, `untouched`, `segmentation`."""


def panda_view(scenario: Scenario, kinematics: PandaKinematics) -> FrameView:
    """What the scenario's camera sees: its pose and the robot's pixels follow from theta."""
    intrinsics = scenario.station.camera.intrinsics
    if kinematics.fixed_camera is None:
        silhouette = RobotSilhouette(kinematics, intrinsics)
    else:
        silhouette = RobotSilhouette(kinematics, intrinsics, FIXED_MARGIN_M, FIXED_MARGIN_PX)
    return FrameView(intrinsics, kinematics.X_WC, silhouette.mask)


def add_segmentation(
    builder: DiagramBuilder, scenario: Scenario, kinematics: PandaKinematics, seed: int
) -> SegmentationBlock:
    """Add Alg. 2 to a builder, for the camera on the arm that the scenario describes."""
    view = panda_view(scenario, kinematics)
    return add_stages(builder, scenario, view, 1 / scenario.station.camera.rate, seed)


def add_stages(
    builder: DiagramBuilder, scenario: Scenario, view: FrameView, period: float, seed: int
) -> SegmentationBlock:
    """Add Alg. 2 to a builder, for any camera; it gives an image every `period` s."""
    builder.AddSystem(view)
    reducer = builder.AddSystem(FrameReducer(scenario.segment_objs.width))
    above = builder.AddSystem(ObjectsAboveTable(scenario.above_table))
    # Of all pixels, for who reads it: at rests.
    whole_above = builder.AddNamedSystem("WholeObjectsAboveTable", ObjectsAboveTable(scenario.above_table))
    memory = builder.AddSystem(
        FramePairMemory(period, FRAME_OFFSET, scenario.frame_pair, scenario.camera_motion)
    )
    expected = builder.AddSystem(ExpectedFlow())
    optical = builder.AddSystem(OpticalFlow(flow_method(scenario.optical_flow)))
    motion = builder.AddSystem(CameraMotion(scenario.camera_motion, scenario.bfif.noise))
    grouper = builder.AddSystem(BFIFGrouper(scenario.bfif, seed))
    propagator = builder.AddSystem(
        MaskPropagator(view.intrinsics, period, MASK_OFFSET, scenario.segment, scenario.bfif)
    )

    def wire(source: LeafSystem, name: str, *targets: LeafSystem, port: str | None = None) -> None:
        for target in targets:
            builder.Connect(source.GetOutputPort(name), target.GetInputPort(port or name))

    wire(view, "frame", reducer)
    wire(reducer, "frame", above, memory)
    wire(memory, "whole_frame", whole_above, port="frame")
    wire(above, "above_table", memory)
    wire(memory, "pair", optical, motion)
    wire(optical, "optical_flow", motion)
    wire(memory, "above_table_reference", motion)
    wire(memory, "above_table", motion)
    wire(memory, "pose_error", motion)
    wire(motion, "pair", expected, grouper, propagator)
    wire(motion, "pair", memory, port="settled_pair")
    wire(expected, "expected_flow", grouper, propagator)  # lines 1
    wire(optical, "optical_flow", grouper, propagator)  # and 2
    wire(memory, "above_table_reference", optical, grouper, port="above_table")
    wire(memory, "above_table_reference", propagator)
    wire(memory, "above_table", propagator)
    wire(whole_above, "above_table", propagator, port="whole_above_table")
    wire(grouper, "groups", propagator)  # lines 3 to 6, and 7
    wire(grouper, "flow_span", memory)

    outputs = {
        "above_table": whole_above,
        "expected_flow": expected,
        "optical_flow": optical,
        "groups": grouper,
        "mask": propagator,
        "settled_mask": propagator,
        "decided": propagator,
        "untouched": propagator,
        "segmentation": propagator,
    }
    return SegmentationBlock(
        stages=[view, reducer, above, whole_above, memory, motion, expected, optical, grouper, propagator],
        inputs={port.get_name(): port for port in map(view.get_input_port, range(view.num_input_ports()))},
        outputs={
            "pair": memory.GetOutputPort("whole_pair"),
            "passed_over": memory.GetOutputPort("passed_over"),
            **{name: system.GetOutputPort(name) for name, system in outputs.items()},
        },
    )


def make_segmentation(
    scenario: Scenario, view: FrameView, period: float, seed: int
) -> tuple[Diagram, list[LeafSystem]]:
    """Alg. 2 as a diagram of its own, its ports named as the block's; and its stages."""
    builder = DiagramBuilder()
    block = add_stages(builder, scenario, view, period, seed)
    for name, input_port in block.inputs.items():
        builder.ExportInput(input_port, name)
    for name, output_port in block.outputs.items():
        builder.ExportOutput(output_port, name)
    return builder.Build(), block.stages
