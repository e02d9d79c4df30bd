"""`riseg pictures`: the pictures of README and documentation, made anew from today's code.

run.webp                  one run: the wrist camera's image with its masks beside the robot
run.jpg                   the masks before the first and after every interaction
simulation_diagram.svg    the wired diagrams
hardware_diagram.svg
evaluation.png            the figure of an evaluation, where one is given
"""

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from rich.console import Console

from riseg_drake.app.diagram import make_diagram
from riseg_drake.app.graphics import require_graphics
from riseg_drake.app.output import Step
from riseg_drake.app.output_folder import OutputError
from riseg_drake.app.scenario import BUILT_IN, HARDWARE, load_scenario
from riseg_drake.app.show.drawing import draw, render, require_dot
from riseg_drake.app.show.film import film_run
from riseg_drake.evaluation.report import FIGURE_FILE
from riseg_drake.geometry.camera import WHOLE, bounding_region
from riseg_drake.pictures.animation import film
from riseg_drake.pictures.masks import draw_masks
from riseg_drake.recording.whole_file import write_bytes

NAMES = (
    "run.webp",
    "run.jpg",
    f"{BUILT_IN}_diagram.svg",
    f"{HARDWARE}_diagram.svg",
    "evaluation.png",
)
RATE = 6.25
"""Of the film, pictures a second; it runs about three times as fast as the robot."""
LAST = 2.0
"""How long its last picture stays, s."""
STRIP_WIDTH = 280
"""Of each picture in the strip, pixels."""
STRIP_GAP, STRIP_MARGIN = 5, 30


def pictures_command(
    scenario_file: Path | None,
    seed: int,
    output: Path,
    evaluation: Path | None,
    overwrite: bool,
    console: Console,
) -> None:
    """Make the pictures of a run, of the wired diagrams and of an evaluation. Raises OutputError."""
    scenario = load_scenario(scenario_file)
    _ = scenario.simulated  # says so where it is not
    earlier = [] if overwrite else [str(output / name) for name in NAMES if (output / name).exists()]
    if earlier:
        raise OutputError(f"{', '.join(earlier)} would be replaced; give another folder, or --overwrite")
    require_graphics()
    require_dot()
    pictures: dict[str, bytes] = {}
    if evaluation is not None:
        figure = evaluation / FIGURE_FILE
        if not figure.is_file():
            raise OutputError(f"{figure} is not there; give the output folder of `riseg evaluate`")
        pictures["evaluation.png"] = figure.read_bytes()
    with console.status("placing the objects") as status:
        moving, steps = film_run(
            scenario, seed, lambda p: status.update(f"interaction {p.interaction_step}, {p.phase.value}")
        )
        status.update("drawing")
        pictures["run.webp"] = film(moving, RATE, LAST)
        pictures["run.jpg"] = _strip(steps)
        for name in (BUILT_IN, HARDWARE):
            dot = draw(make_diagram(load_scenario(None, name), seed).diagram)
            pictures[f"{name}_diagram.svg"] = render(dot, "svg")
    try:
        output.mkdir(parents=True, exist_ok=True)
        for name, content in pictures.items():
            write_bytes(output / name, content)
            console.print(f"{output / name}: {len(content) / 1e3:.0f} kB")
    except OSError as error:
        raise OutputError(f"cannot write to {output}: {error.strerror}") from None


def _strip(steps: list[Step]) -> bytes:
    """The steps' masks side by side, as JPEG; around what was found."""
    found = np.any([step.mask > 0 for step in steps], axis=0)
    region = bounding_region(found, STRIP_MARGIN) if found.any() else WHOLE
    row: list[NDArray[np.uint8]] = []
    for step in steps:
        masks = draw_masks(step.color, step.mask)[region]
        size = (STRIP_WIDTH, round(STRIP_WIDTH * masks.shape[0] / masks.shape[1]))
        row.append(cv2.resize(masks, size, interpolation=cv2.INTER_AREA).astype(np.uint8))
        row.append(np.full((size[1], STRIP_GAP, 3), 255, np.uint8))
    picture = cv2.cvtColor(np.hstack(row[:-1]), cv2.COLOR_RGB2BGR)
    return cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, 88])[1].tobytes()
