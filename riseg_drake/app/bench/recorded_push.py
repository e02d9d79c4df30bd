"""One push, held in memory: what the station gave at every picture, to be put through Alg. 2 again."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any, TypeVar

from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, Diagram

from riseg_drake.app.diagram import WiredDiagram, make_diagram
from riseg_drake.app.run.interactions import Progress, interactions
from riseg_drake.app.scenario import Scenario
from riseg_drake.app.scenario_file import ScenarioError
from riseg_drake.app.segmentation_block import STATION_PORTS
from riseg_drake.geometry.rgbd import Frame
from riseg_drake.learned.sam import SamParameters
from riseg_drake.pushing.arm_path import ArmPhase
from riseg_drake.systems.stage_clock import StageClock

Kept = TypeVar("Kept")
StationOutputs = dict[str, Any]
"""What a station gave at one tick of the camera, by the names of the segmentation's inputs."""


def push_images(scenario: Scenario, seed: int) -> list[StationOutputs]:
    """The station's outputs at every frame of the first push. Raises ScenarioError if there is none."""

    def outputs(wired: WiredDiagram, _: Frame, context: Context) -> StationOutputs:
        return {name: wired.copy(port, context) for name, port in STATION_PORTS.items()}

    return _of_push(scenario, seed, outputs)


def push_frames(scenario: Scenario, seed: int) -> list[Frame]:
    """Every frame of the first push, for `segment_objs`. Raises ScenarioError if there is none."""
    return _of_push(scenario, seed, lambda _, frame, __: frame)


def _of_push(scenario: Scenario, seed: int, read: Callable[[WiredDiagram, Frame, Context], Kept]) -> list[Kept]:
    wired = make_diagram(replace(scenario, sam=SamParameters()), seed)  # sharper outlines are not wanted here
    progress = Progress()
    kept: list[Kept] = []

    def keep(frame: Frame, context: Context) -> None:
        if wired.phase(context) is ArmPhase.PUSH:
            kept.append(read(wired, frame, context))
        elif kept:
            progress.end = "the push is over"

    for _ in interactions(wired, StageClock(), progress, scenario.longest, (keep,)):
        pass
    if len(kept) < 2:
        raise ScenarioError(f"with seed {seed} the arm finds nothing to push; choose another seed")
    return kept


def put_through(segmentation: Diagram, images: Sequence[StationOutputs], period: float) -> Iterator[Context]:
    """Put images through Alg. 2, one tick of the camera each, as fast as it goes.

    Args:
        segmentation: see `make_segmentation`.
        images: what comes in at every tick.
        period: of the ticks, s.

    Yields:
        The diagram's context after each: what its ports say then is about that image.
    """
    simulator = Simulator(segmentation)
    context = simulator.get_mutable_context()
    for tick, now in enumerate(images):
        for name, value in now.items():
            segmentation.GetInputPort(name).FixValue(context, value)
        simulator.AdvanceTo((tick + 1) * period)
        yield context
