"""A run as moving pictures: what the wrist camera sees with the objects found, beside the robot at work."""

from collections.abc import Callable
from typing import cast

import numpy as np
from numpy.typing import NDArray
from pydrake.systems.framework import Context

from riseg_drake.app.diagram import make_diagram
from riseg_drake.app.output import Step
from riseg_drake.app.run.interactions import Progress, interactions
from riseg_drake.app.run.onlooker import Onlooker
from riseg_drake.app.scenario import Scenario
from riseg_drake.geometry.rgbd import Frame
from riseg_drake.pictures.animation import side_by_side
from riseg_drake.pictures.masks import draw_masks
from riseg_drake.stations.simulated import SimulatedStation
from riseg_drake.systems.stage_clock import StageClock

EVERY = 8
"""Of so many pictures of the camera one is shown."""
WIDTH = 620
"""Of the film, pixels."""


def film_run(
    scenario: Scenario, seed: int, follow: Callable[[Progress], None]
) -> tuple[list[NDArray[np.uint8]], list[Step]]:
    """Run one scene; the film's pictures [H, W, 3], and the steps. `follow` is told of every frame."""
    wired = make_diagram(scenario, seed)
    station = cast(SimulatedStation, wired.diagram.GetSubsystemByName("station"))
    onlooker = Onlooker(station, wired.intrinsics.width, wired.intrinsics.height)
    progress = Progress()
    pictures: list[NDArray[np.uint8]] = []
    latest: list[Context] = []

    def show(color: NDArray[np.uint8], mask: NDArray[np.uint16], context: Context) -> None:
        seen = draw_masks(color, mask)
        pictures.append(side_by_side(seen, onlooker.look(context), _captions(progress), WIDTH))

    def shoot(frame: Frame, context: Context) -> None:
        follow(progress)
        if frame.sequence % EVERY == 0:
            show(frame.color, wired.mask(context), context)
        latest[:] = [context]

    steps = list(interactions(wired, StageClock(), progress, scenario.longest, (shoot,)))
    # What was decided at the last rest, too.
    show(steps[-1].color, steps[-1].mask, latest[0])
    return pictures, steps


def _captions(progress: Progress) -> tuple[str, str]:
    found = f"{progress.objects} object{'' if progress.objects == 1 else 's'} found"
    return "wrist camera and masks", f"interaction {progress.interaction_step}, {progress.phase.value}: {found}"
