"""What a run can be told: every room's parameters under one roof."""

from dataclasses import dataclass, field
from importlib.resources import files
from pathlib import Path

from riseg_drake.app.flow_method import OpticalFlowParameters
from riseg_drake.app.scenario_file import ScenarioError, parse_scenario, read_scenario
from riseg_drake.learned.sam import SamParameters
from riseg_drake.pushing.push_planning import PushPlanningParameters
from riseg_drake.robot.description import check_tool
from riseg_drake.robot.tool import OWN_TOOLS, ToolError
from riseg_drake.segmentation.above_table import AboveTableParameters
from riseg_drake.segmentation.algorithm import SegmentObjsParameters
from riseg_drake.segmentation.bfif import BFIFParameters
from riseg_drake.segmentation.camera_motion import CameraMotionParameters
from riseg_drake.segmentation.frame_pairs import FramePairParameters
from riseg_drake.segmentation.segment import SegmentParameters
from riseg_drake.stations.emulated_drivers import EmulatorConfig
from riseg_drake.stations.hardware import HardwareStationConfig
from riseg_drake.stations.simulated import SimulatedStationConfig
from riseg_drake.systems.arm_motion import ArmMotionParameters

BUILT_IN = "simulation"
HARDWARE = "hardware"


@dataclass
class Scenario:
    """A YAML file's keys are these fields, and theirs in turn; what it leaves out stays as it is here."""

    station: SimulatedStationConfig | HardwareStationConfig = field(default_factory=SimulatedStationConfig)
    """Arm, camera, table, objects and physics; or, tagged !HardwareStationConfig, a robot and its drivers."""
    above_table: AboveTableParameters = field(default_factory=AboveTableParameters)
    """What counts as standing on the table (Alg. 3, line 1)."""
    frame_pair: FramePairParameters = field(default_factory=FramePairParameters)
    """Which two frames are compared."""
    camera_motion: CameraMotionParameters = field(default_factory=CameraMotionParameters)
    """How far the camera's poses are believed."""
    optical_flow: OpticalFlowParameters = field(default_factory=OpticalFlowParameters)
    """Alg. 2, line 2."""
    bfif: BFIFParameters = field(default_factory=BFIFParameters)
    """Alg. 2, lines 3 to 6."""
    segment: SegmentParameters = field(default_factory=SegmentParameters)
    """Alg. 2, line 7."""
    sam: SamParameters = field(default_factory=SamParameters)
    """Sharper outlines after each interaction, where a folder with a model is given."""
    push: PushPlanningParameters = field(default_factory=PushPlanningParameters)
    """Alg. 3, and the arm's path for a push."""
    arm: ArmMotionParameters = field(default_factory=ArmMotionParameters)
    """Alg. 1: when to look, and how many pushes at most."""
    emulator: EmulatorConfig = field(default_factory=EmulatorConfig)
    """The drivers that `riseg emulate` stands in for, around the station above."""
    longest: float = field(default=300.0, metadata={"least": 1.0, "most": 86400.0})
    """A run ends after this time even if the arm is not done, simulated seconds."""

    @property
    def segment_objs(self) -> SegmentObjsParameters:
        """What Alg. 2 takes of it, for who calls it without a diagram."""
        return SegmentObjsParameters(
            self.above_table, self.frame_pair, self.camera_motion, self.bfif, self.segment
        )

    @property
    def simulated(self) -> SimulatedStationConfig:
        """The station, for what only a simulation can do. Raises ScenarioError for a real one."""
        if isinstance(self.station, SimulatedStationConfig):
            return self.station
        raise ScenarioError(
            "the scenario describes a real robot; this command wants a simulated station "
            "(for the emulator one with the same tool and camera, see docs/emulator.md)"
        )

    @property
    def hardware(self) -> HardwareStationConfig:
        """The station, for what only a real one can do. Raises ScenarioError for a simulated one."""
        if isinstance(self.station, HardwareStationConfig):
            return self.station
        raise ScenarioError(
            "the scenario describes a simulation; what drives a real robot wants `station: "
            "!HardwareStationConfig`, as the built-in hardware.yaml has it"
        )


def load_scenario(path: Path | None, otherwise: str = BUILT_IN) -> Scenario:
    """The scenario of a file, or a built-in one. Raises ScenarioError, also for a tool that is none."""
    if path is not None:
        return with_tool(read_scenario(path, Scenario), path)
    built_in = files("riseg_drake.diagrams") / f"{otherwise}.yaml"
    return parse_scenario(built_in.read_text(encoding="utf-8"), Scenario, source=built_in.name)


def with_tool(scenario: Scenario, path: Path) -> Scenario:
    """A scenario of a file whose tool, where it is a file, is read from beside it. Raises ScenarioError."""
    panda = scenario.station.panda
    if panda.tool not in OWN_TOOLS:
        # Wherever the scenario is copied to, such as into a recording, it is the same file.
        panda.tool = str((path.parent / panda.tool).resolve())
        try:
            check_tool(panda, scenario.station.camera.fixed_pose)
        except ToolError as error:
            raise ScenarioError(f"{path}: station.panda.tool: {error}") from None
    return scenario


def scenario_name(path: Path | None, otherwise: str = BUILT_IN) -> str:
    """What a scenario is called in folders and summaries."""
    return otherwise if path is None else path.stem
