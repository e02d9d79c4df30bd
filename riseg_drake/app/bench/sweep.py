"""`riseg bench --sweep`: how Alg. 2 grows with pixels and with objects, over whole pushes, late ones too."""

from collections.abc import Callable, Sequence
from copy import deepcopy
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

from pydrake.systems.framework import Context
from rich import box
from rich.console import Console
from rich.status import Status
from rich.table import Table

from riseg_drake.app.bench.pair_times import FLOW, MOVING, STILL, PairTimes
from riseg_drake.app.diagram import make_diagram
from riseg_drake.app.graphics import require_graphics
from riseg_drake.app.output_folder import to_json, write_told
from riseg_drake.app.run.interactions import Progress, interactions
from riseg_drake.app.scenario import Scenario, load_scenario
from riseg_drake.app.scenario_file import ScenarioError
from riseg_drake.geometry.rgbd import Frame
from riseg_drake.learned.sam import SamParameters
from riseg_drake.systems.stage_clock import StageClock

PUSHES = 3
"""Of each run: by the last of them some things have ids, and several move at once."""
PLANNER = "PushPlanner"
"""The one stage that is no part of Alg. 2."""


@dataclass(frozen=True)
class Case:
    """One row of the table."""

    width: int
    """Of the images, pixels."""
    height: int
    objects: int
    """On the table."""

    @property
    def name(self) -> str:
        """As the table and the file call it."""
        return f"{self.width}x{self.height}, {self.objects} objects"


USUAL = Case(640, 480, 6)
CASES = (
    *(Case(width, height, USUAL.objects) for width, height in ((320, 240), (848, 480), (1280, 720))),
    *(Case(USUAL.width, USUAL.height, objects) for objects in (2, 4, 6, 8, 12, 16)),
)


def sweep_command(
    scenario_file: Path | None,
    seed: int,
    json_file: Path | None,
    console: Console,
    cases: Sequence[Case] = CASES,
) -> None:
    """Run some pushes of each case and print what pairs took, beside the flow of their whole images."""
    scenario = load_scenario(scenario_file)
    _ = scenario.simulated  # says so where it is not
    require_graphics()
    rows: dict[str, dict[str, Any]] = {}
    for number, case in enumerate(cases, start=1):
        at = f"{number} of {len(cases)}: {case.name}"
        try:
            with console.status(at) as status:
                times = pair_times(scenario_of(scenario, case), seed, partial(_tell, status, at))
        except ScenarioError as error:  # fewer models than that, or no room for so many
            console.print(f"{case.name} left out: {error}", soft_wrap=True)
            continue
        rows[case.name] = {**asdict(case), "pairs": times.figures()}
    console.print(sweep_table(rows))
    if json_file is not None:
        write_told(json_file, to_json({"seed": seed, "pushes": PUSHES, "cases": rows}).encode())


def _tell(status: Status, at: str, progress: Progress) -> None:
    status.update(f"{at}, interaction {progress.interaction_step} of {PUSHES}")


def scenario_of(scenario: Scenario, case: Case) -> Scenario:
    """The scenario with a case's images, of the same view from top to bottom, and with its objects."""
    scenario = deepcopy(scenario)
    scenario.sam = SamParameters()  # sharper outlines are not wanted here
    station = scenario.simulated
    camera, finer = station.camera, case.height / station.camera.height
    camera.cx = (case.width - 1) / 2 + finer * (camera.cx - (camera.width - 1) / 2)
    camera.cy = (case.height - 1) / 2 + finer * (camera.cy - (camera.height - 1) / 2)
    camera.fx, camera.fy = finer * camera.fx, finer * camera.fy
    camera.width, camera.height = case.width, case.height
    scene = station.scene
    scene.placed, scene.count_min, scene.count_max = None, case.objects, case.objects
    # The area grows with what lies on it; six have the radius of their layout.
    if case.objects > USUAL.objects:
        scene.layout, scene.radius = "crowd", 0.15 * (case.objects / USUAL.objects) ** 0.5
    scenario.arm.most_interactions = PUSHES
    return scenario


def pair_times(scenario: Scenario, seed: int, told: Callable[[Progress], None]) -> PairTimes:
    """What every pair of a run took, all stages of Alg. 2 together."""
    wired = make_diagram(scenario, seed)
    clock, progress, times = _FrameClock(), Progress(), PairTimes()
    before: list[Frame] = []

    def book(frame: Frame, context: Context) -> None:
        told(progress)
        seconds, clock.frame = clock.frame, 0.0
        if before:
            moves = wired.read("groups", context).flow_span >= scenario.frame_pair.moving
            times.book(seconds, moves=moves)
            times.measure_flow(before[-1].color, frame.color)
        before[:] = [frame]

    for _ in interactions(wired, clock, progress, scenario.longest, (book,)):
        pass
    return times


class _FrameClock(StageClock):
    """Also adds up what all stages of Alg. 2 take."""

    def __init__(self) -> None:
        super().__init__()
        self.frame = 0.0
        """s, since somebody set it to 0."""

    def measure(self, stage: str, work: Callable[[], Any]) -> Any:
        """See there."""
        try:
            return super().measure(stage, work)
        finally:
            if stage != PLANNER:
                self.frame += self.seconds[stage][-1]


def sweep_table(rows: dict[str, dict[str, Any]]) -> Table:
    """One row a case: milliseconds of pairs, and these in medians of the flow of the whole images."""
    title = f"Alg. 2 for an image pair over {PUSHES} pushes; ratios are to DIS of the whole images"
    table = Table(box=box.SIMPLE, title=title, title_justify="left")
    table.add_column("", justify="left", no_wrap=True)
    for column in (
        "pairs",
        "median ms",
        "p95",
        "longest",
        "median ratio",
        "p95",
        "longest",
        "still ms",
        "DIS ms",
    ):
        table.add_column(column, justify="right")
    for name, row in rows.items():
        pairs = row["pairs"]
        moving, still = pairs.get(MOVING), pairs.get(STILL)
        cells = [""] * 7
        if moving:
            cells = [f"{moving['calls']:.0f}"]
            cells += [f"{moving[f'{which}_ms']:.0f}" for which in ("median", "p95", "longest")]
            cells += [f"{moving[f'{which}_ratio']:.1f}" for which in ("median", "p95", "longest")]
        table.add_row(
            name, *cells, f"{still['median_ms']:.0f}" if still else "", f"{pairs[FLOW]['median_ms']:.1f}"
        )
    return table
