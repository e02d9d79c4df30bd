"""`riseg bench`: what each stage of Alg. 2 costs in time and memory, for one image pair."""

import tracemalloc
from collections.abc import Callable, Sequence
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from rich.console import Console

from riseg_drake.app.bench.pair_times import PairTimes
from riseg_drake.app.bench.recorded_push import StationOutputs, push_images, put_through
from riseg_drake.app.graphics import require_graphics
from riseg_drake.app.output import stage_figures
from riseg_drake.app.output_folder import to_json, write_told
from riseg_drake.app.run.command import peak_memory_mb
from riseg_drake.app.scenario import Scenario, load_scenario
from riseg_drake.app.segmentation_block import make_segmentation, panda_view
from riseg_drake.app.tables import stage_table
from riseg_drake.robot.kinematics import PandaKinematics
from riseg_drake.systems.stage_clock import StageClock

REPETITIONS = 4
"""How often the push is gone through for times."""


def bench_command(
    scenario_file: Path | None,
    seed: int,
    stream: int | None,
    sam: bool,
    json_file: Path | None,
    console: Console,
    view: bool = False,
) -> None:
    """Render one push, put it through the segmentation again and again, print what it cost.

    The figures go to `json_file`, too, if one is named. With `stream` say instead how evenly commands come for
    so many seconds beside that, with `sam` what frames lose while Segment Anything works beside them, with
    `view` what the live view costs.
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
    if view:
        from riseg_drake.app.bench.view import bench_view

        with console.status("measuring with and without the view"):
            return bench_view(scenario, images, json_file, console)
    with console.status("measuring time"):
        clock, pairs = StageClock(), PairTimes()
        for _ in range(REPETITIONS):
            segment_once(scenario, images, clock, pairs)
    with console.status("measuring memory"):
        memory = _StageMemory()
        tracemalloc.start()
        segment_once(scenario, images, memory)
        tracemalloc.stop()
    stages = stage_figures(clock.seconds)
    for stage, peaks in memory.peaks.items():
        stages[stage]["peak_mb"] = max(peaks) / 1e6
    camera, of_pairs = scenario.station.camera.intrinsics, pairs.figures()
    console.print(
        stage_table(
            {**stages, **of_pairs}, f"Alg. 2 for one {camera.width}x{camera.height} image pair, during a push"
        )
    )
    for line in pairs.said():
        console.print(line)
    console.print(
        f"peak MB is what a stage allocates in Python while it works; "
        f"the whole process, simulation and all, took {peak_memory_mb()} MB at most"
    )
    if json_file is not None:
        figures = {"size": [camera.width, camera.height], "seed": seed, "stages": stages, "pairs": of_pairs}
        write_told(json_file, to_json({**figures, "peak_memory_mb": peak_memory_mb()}).encode())


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


def segment_once(
    scenario: Scenario,
    images: Sequence[StationOutputs],
    clock: StageClock | None = None,
    pairs: PairTimes | None = None,
) -> None:
    """Put the images through Alg. 2 as fast as it goes, one tick of the camera each, and book every stage, and
    each pair beside its flow, where there is a clock and a book for it."""
    period = 1 / scenario.station.camera.rate
    view = panda_view(scenario, PandaKinematics(scenario.station.panda, scenario.station.camera.fixed_pose))
    diagram, stages = make_segmentation(scenario, view, period, seed=0)
    groups = diagram.GetOutputPort("groups")
    after_each = put_through(diagram, images, period)
    next(after_each)  # the first frame has no partner, and fills what is computed once for all
    if clock:
        clock.watch(stages)
    colors = [np.array(each["color_image"].get_value().data[..., :3]) for each in images] if pairs else []
    for number in range(1, len(images)):
        start = perf_counter()
        context = next(after_each)
        seconds = perf_counter() - start
        if pairs:
            pairs.book(seconds, moves=groups.Eval(context).flow_span >= scenario.frame_pair.moving)
            pairs.measure_flow(colors[number - 1], colors[number])
