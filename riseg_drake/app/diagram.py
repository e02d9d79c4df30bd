"""The wiring: a station, Alg. 2, Alg. 3 and the arm's motion as one Diagram."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import Meshcat
from pydrake.lcm import DrakeLcm
from pydrake.math import RigidTransform
from pydrake.systems.framework import (
    Context,
    Diagram,
    DiagramBuilder,
    LeafSystem,
    OutputPort,
    PortDataType,
)
from pydrake.trajectories import PiecewisePolynomial

from riseg_drake.app.meshcat_view import MeshcatView, Stage
from riseg_drake.app.planned_speed import push_parameters
from riseg_drake.app.refinement_block import add_refinement
from riseg_drake.app.scenario import Scenario
from riseg_drake.app.scenario_file import ScenarioError
from riseg_drake.app.segmentation_block import STATION_PORTS, add_segmentation
from riseg_drake.geometry.rgbd import FramePair
from riseg_drake.pushing.arm_path import ArmPhase
from riseg_drake.pushing.decision import Decision
from riseg_drake.pushing.push import Push
from riseg_drake.robot.kinematics import PandaKinematics, observation_posture
from riseg_drake.robot.tool_shape import ToolShape
from riseg_drake.segmentation.segmentation import Segmentation
from riseg_drake.stations.hardware import HardwareStation, TargetSink
from riseg_drake.stations.lcm_reception import Reception
from riseg_drake.stations.object_models import with_remedy
from riseg_drake.stations.simulated import SimulatedStation, SimulatedStationConfig, start_position
from riseg_drake.systems.arm_motion import ArmMotion, Permission
from riseg_drake.systems.mask_refiner import NO_REFINED_MASK, MaskRefiner, RefinedMask
from riseg_drake.systems.push_planner import PushPlanner


@dataclass(frozen=True)
class Drivers:
    """The way to a real robot."""

    reception: Reception
    """What arm and camera say."""
    sink: TargetSink | None = None
    """Who moves the arm; None: nobody."""
    way_back: Callable[[], PiecewisePolynomial | None] | None = None
    """Asked again and again for a motion back to where the arm looks from, after it was moved by hand."""


class WiredDiagram:
    """The whole of Alg. 1 around a station, and what an application reads from it.

    All ports of the station are exported under their own names, and the outputs of the stages: `pair`,
    `above_table`, `expected_flow`, `optical_flow`, `groups`, `mask`, `segmentation`, `decision`, `phase`,
    `interaction_step`, `active_push`, `last_decision`, and `refined` where the scenario names a SAM.
    """

    def __init__(
        self,
        diagram: Diagram,
        station: SimulatedStation | HardwareStation,
        stages: list[LeafSystem],
        scenario: Scenario,
        refiner: MaskRefiner | None = None,
        view: MeshcatView | None = None,
    ):
        self.diagram = diagram
        self.stages = stages
        self.intrinsics = scenario.station.camera.intrinsics
        self.most_interactions = scenario.arm.most_interactions
        simulated = isinstance(station, SimulatedStation)
        objects = station.objects if simulated else []
        self.object_names = {i: placed.name for i, placed in enumerate(objects, start=1)}
        """By object id, as in the ground truth; empty where nobody knows it."""
        self.object_axes = {placed.name: placed.model.axes for placed in objects}
        """By name, the unit vectors in B [k, 3] about which an object is a body of revolution."""
        self._refiner, self._view = refiner, view
        self._object_bodies = station.object_bodies if simulated else {}
        self._centres = {i: RigidTransform(placed.model.centre) for i, placed in enumerate(objects, start=1)}
        self._ports: dict[str, OutputPort] = {}
        self._sleep = station.sleep if isinstance(station, SimulatedStation) else None

    def read(self, port: str, context: Context) -> Any:
        """The present value of an exported output; Drake may write the next one into the same place."""
        return self._port(port).Eval(context)

    def copy(self, port: str, context: Context) -> Any:
        """The same to keep: an array, or an AbstractValue that can be given to an input port."""
        output = self._port(port)
        if output.get_data_type() == PortDataType.kVectorValued:
            return np.array(output.Eval(context))
        return output.EvalAbstract(context).Clone()

    def _port(self, name: str) -> OutputPort:
        # Looked up once: some ports are read after every step of the simulation.
        if name not in self._ports:
            self._ports[name] = self.diagram.GetOutputPort(name)
        return self._ports[name]

    def pair(self, context: Context) -> FramePair:
        """The frames of t-1 and t; NO_PAIR before the first."""
        return self.read("pair", context)

    def segmentation(self, context: Context) -> Segmentation:
        """L_t with what is remembered for L_t+1; its `sequence` is the frame's it belongs to."""
        return self.read("segmentation", context)

    def mask(self, context: Context) -> NDArray[np.uint16]:
        """L_t [H, W]."""
        return self.read("mask", context)

    def refined(self, context: Context) -> RefinedMask:
        """The newest mask with sharper outlines; NO_REFINED_MASK before the first and where nothing refines."""
        return NO_REFINED_MASK if self._refiner is None else self.read("refined", context)

    def finish_refinement(self, context: Context) -> list[RefinedMask]:
        """Wait for the outlines that are still being worked on; they come oldest first."""
        if self._refiner is None:
            return []
        return self._refiner.finish(self._refiner.GetMyContextFromRoot(context))

    def show_end(self, context: Context) -> None:
        """Let who looks on in the browser see how it ended."""
        if self._view is not None:
            self._view.show_end(context)

    def phase(self, context: Context) -> ArmPhase:
        """What the arm is doing."""
        return self.read("phase", context)

    def interaction_step(self, context: Context) -> int:
        """How many pushes are over."""
        return self.read("interaction_step", context)

    def last_decision(self, context: Context) -> Decision:
        """The last push that was decided on, or why there was none."""
        return self.read("last_decision", context)

    def position(self, context: Context) -> NDArray[np.float64]:
        """Joint angles theta_t [7], rad."""
        return self.read("panda.position_measured", context)

    def let_sleep(self, context: Context) -> None:
        """To be called once a picture: what lies still and out of the robot's reach sleeps."""
        if self._sleep is not None:
            self._sleep.look(context)

    def true_labels(self, context: Context) -> NDArray[np.uint16]:
        """The true visible object ids [H, W] of this moment; drawn when asked for."""
        return self.read("cheat.label_image", context).data[..., 0].astype(np.uint16)

    def true_poses(self, context: Context) -> dict[str, NDArray[np.float64]]:
        """The true poses X_WBcm [4, 4] of the objects, by name: B's axes in the centre of mass."""
        poses = self.read("cheat.body_poses", context)
        return {
            self.object_names[object_id]: (poses[int(body)] @ self._centres[object_id]).GetAsMatrix4()
            for object_id, body in self._object_bodies.items()
        }


def make_diagram(
    scenario: Scenario,
    seed: int,
    meshcat: Meshcat | None = None,
    *,
    drivers: Drivers | None = None,
    permit: Callable[[Push], Permission] | None = None,
) -> WiredDiagram:
    """Build the diagram of a scenario; the seed draws samples and, in simulation, scene and noise.

    `drivers` are those of a real robot; without them such a scenario is wired to nothing, to be looked at.
    `permit` is asked about every push. Raises ScenarioError (or the station's SceneError) for settings that
    cannot be.
    """
    config = scenario.station
    station: SimulatedStation | HardwareStation
    try:
        kinematics = PandaKinematics(config.panda, config.camera.fixed_pose)
        if isinstance(config, SimulatedStationConfig):
            station = SimulatedStation(config, seed, meshcat=meshcat)
            q_observe = np.array(start_position(config))
        else:
            drivers = drivers or Drivers(Reception(DrakeLcm("memq://"), config.lcm))
            station = HardwareStation(config, drivers.reception, drivers.sink, meshcat=meshcat)
            q_observe = observation_posture(
                kinematics,
                config.centre_W,
                config.observe_height,
                config.start_position,
                config.observe_pitch,
            )
    except (ValueError, RuntimeError) as error:
        raise ScenarioError(with_remedy(str(error))) from error

    builder = DiagramBuilder()
    builder.AddSystem(station)
    segmentation = add_segmentation(builder, scenario, kinematics, seed)
    planner = builder.AddSystem(PushPlanner(kinematics, push_parameters(scenario), seed))
    sink = drivers.sink if drivers else None
    done_until = sink.done_until if sink else None
    way_back = drivers.way_back if drivers else None
    arm = builder.AddSystem(ArmMotion(q_observe, scenario.arm, permit, done_until, way_back))

    for name, port in STATION_PORTS.items():
        builder.Connect(station.GetOutputPort(port), segmentation.inputs[name])
    for name in ("pair", "above_table"):
        builder.Connect(segmentation.outputs[name], planner.GetInputPort(name))
    builder.Connect(segmentation.outputs["pair"], arm.GetInputPort("pair"))
    # Objects in doubt, which may be two, are pushed once more: they are not in the settled mask.
    for system in (planner, arm):
        builder.Connect(segmentation.outputs["settled_mask"], system.GetInputPort("mask"))
    builder.Connect(segmentation.outputs["decided"], arm.GetInputPort("decided"))
    builder.Connect(segmentation.outputs["mask"], planner.GetInputPort("found"))
    builder.Connect(arm.GetOutputPort("position"), planner.GetInputPort("position"))
    builder.Connect(arm.GetOutputPort("tried_pushes"), planner.GetInputPort("tried_pushes"))
    builder.Connect(planner.GetOutputPort("decision"), arm.GetInputPort("decision"))
    builder.Connect(station.GetOutputPort("panda.position_measured"), arm.GetInputPort("position_measured"))
    builder.Connect(arm.GetOutputPort("position"), station.GetInputPort("panda.position"))
    refiner = add_refinement(builder, scenario, segmentation, arm)
    view: MeshcatView | None = None
    if meshcat is not None:
        view = builder.AddSystem(
            MeshcatView(meshcat, 1 / config.camera.rate, stage_of(scenario, kinematics.tool))
        )
        for name in ("pair", "segmentation"):
            builder.Connect(segmentation.outputs[name], view.GetInputPort(name))
        for name in ("active_push", "interaction_step", "phase"):
            builder.Connect(arm.GetOutputPort(name), view.GetInputPort(name))

    for index in range(station.num_output_ports()):
        builder.ExportOutput(station.get_output_port(index), station.get_output_port(index).get_name())
    for name, port in segmentation.outputs.items():
        builder.ExportOutput(port, name)
    builder.ExportOutput(planner.GetOutputPort("decision"), "decision")
    for name in ("phase", "interaction_step", "active_push", "last_decision"):
        builder.ExportOutput(arm.GetOutputPort(name), name)
    if refiner is not None:
        builder.ExportOutput(refiner.GetOutputPort("refined"), "refined")
    diagram = builder.Build()
    diagram.set_name("rt-RISeg")
    return WiredDiagram(diagram, station, [*segmentation.stages, planner, arm], scenario, refiner, view)


def stage_of(scenario: Scenario, tool: ToolShape) -> Stage:
    """What stands around the view; a simulation draws its table and things itself."""
    config = scenario.station
    if not isinstance(config, SimulatedStationConfig):
        return Stage(config.centre_W, tool)
    return Stage(config.scene.centre_W, tool, has_things=True)
