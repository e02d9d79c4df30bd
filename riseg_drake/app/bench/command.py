"""`riseg bench`: what each stage of Alg. 2 costs in time and memory, for one image pair."""

import tracemalloc
from collections.abc import Callable, Sequence
from pathlib import Path
from time import perf_counter
from typing import Any

from rich.console import Console

from riseg_drake.app.bench.recorded_push import StationOutputs, push_images, put_through
from riseg_drake.app.graphics import require_graphics
from riseg_drake.app.output import stage_figures
from riseg_drake.app.run.command import peak_memory_mb
from riseg_drake.app.scenario import Scenario, load_scenario
from riseg_drake.app.segmentation_block import make_segmentation, panda_view
from riseg_drake.app.tables import stage_table
from riseg_drake.robot.kinematics import PandaKinematics
from riseg_drake.systems.stage_clock import StageClock

REPETITIONS = 4
"""How often the push is gone through for times."""
WHOLE = "whole pair"


def bench_command(
    scenario_file: Path | None, seed: int, stream: int | None, sam: bool, console: Console
) -> None:
    """Render one push, put it through the segmentation again and again, print what it cost.

    With `stream` say instead how evenly commands come for so many seconds beside that, with `sam` what frames
    lose while Segment Anything works beside them.
    """
    scenario = load_scenario(scenario_file)
    _ = scenario.simulated  # says so where it is not
    require_graphics()
    with console.status("rendering a push"):
        images = push_images(scenario, seed)
    if stream:
        from riseg_drake.app.bench.stream import bench_stream

        with console.status(f"sending commands for {stream} s"):
            bench_stream(scenario, images, stream, console)
        return
    if sam:
        from riseg_drake.app.bench.sam import bench_sam

        return bench_sam(scenario, images, console)
    with console.status("measuring time"):
        clock = StageClock()
        for _ in range(REPETITIONS):
            _segment(scenario, images, clock)
    with console.status("measuring memory"):
        memory = _StageMemory()
        tracemalloc.start()
        _segment(scenario, images, memory)
        tracemalloc.stop()
    stages = stage_figures(clock.seconds)
    for stage, peaks in memory.peaks.items():
        stages[stage]["peak_mb"] = max(peaks) / 1e6
    camera = scenario.station.camera.intrinsics
    console.print(
        stage_table(stages, f"Alg. 2 for one {camera.width}x{camera.height} image pair, during a push")
    )
    console.print(
        f"peak MB is what a stage allocates in Python while it works; "
        f"the whole process, simulation and all, took {peak_memory_mb()} MB at most"
    )


class _StageMemory(StageClock):
    """Books the peak of the memory that Python objects and arrays take in each call, bytes."""

    def __init__(self) -> None:
        super().__init__()
        self.peaks: dict[str, list[int]] = {}

    def measure(self, stage: str, work: Callable[[], Any]) -> Any:
        """Do the work; what it allocates above what was there before is the stage's."""
        tracemalloc.reset_peak()
        before, _ = tracemalloc.get_traced_memory()
        try:
            return work()
        finally:
            _, peak = tracemalloc.get_traced_memory()
            self.peaks.setdefault(stage, []).append(peak - before)


def segment_once(scenario: Scenario, images: Sequence[StationOutputs]) -> None:
    """Put the images through Alg. 2, as fast as it goes."""
    _segment(scenario, images, StageClock())


def _segment(scenario: Scenario, images: Sequence[StationOutputs], clock: StageClock) -> None:
    """Put the images through Alg. 2, one tick of the camera each, and book every stage and the whole."""
    period = 1 / scenario.station.camera.rate
    view = panda_view(scenario, PandaKinematics(scenario.station.panda, scenario.station.camera.fixed_pose))
    diagram, stages = make_segmentation(scenario, view, period, seed=0)
    after_each = put_through(diagram, images, period)
    next(after_each)  # the first frame has no partner, and fills what is computed once for all
    clock.watch(stages)
    for _ in images[1:]:
        start = perf_counter()
        next(after_each)
        clock.seconds[WHOLE].append(perf_counter() - start)
