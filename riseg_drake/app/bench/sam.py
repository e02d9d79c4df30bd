"""`riseg bench --sam`: what Segment Anything costs here, and what the frames lose while it works.

Weights do not change that, so none are needed: without a folder in the scenario a SAM 2.1 tiny is drawn.
"""

from collections.abc import Sequence
from pathlib import Path
from time import perf_counter

import numpy as np
from numpy.typing import NDArray
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from rich.console import Console

from riseg_drake.app.bench.command import StationOutputs
from riseg_drake.app.output import stage_figures
from riseg_drake.app.refinement_block import REFINER_OFFSET
from riseg_drake.app.scenario import Scenario
from riseg_drake.app.segmentation_block import add_segmentation
from riseg_drake.app.tables import stage_table
from riseg_drake.geometry.rgbd import Frame
from riseg_drake.learned.model_error import require
from riseg_drake.learned.prompts import PromptedSegmenter, prompt_of_mask
from riseg_drake.learned.sam import SamParameters, SamSegmenter, load_sam
from riseg_drake.pushing.arm_path import ArmPhase
from riseg_drake.robot.kinematics import PandaKinematics
from riseg_drake.systems.mask_refiner import NO_REFINED_MASK, MaskRefiner

OBJECTS = 6
"""So many objects are asked about in one image."""
ROUNDS = 4
"""How often the push is gone through, with the model and without."""
ALONE, BESIDE, MODEL = "a frame alone", "a frame beside SAM", f"SAM, {OBJECTS} objects, beside frames"


def bench_sam(scenario: Scenario, images: Sequence[StationOutputs], console: Console) -> None:
    """Put a push through Alg. 2, alone and while the model has always something to do; print both."""
    segmenter = _segmenter(scenario.sam)
    seconds: dict[str, list[float]] = {ALONE: [], BESIDE: [], MODEL: []}
    with console.status("measuring frames beside SAM"):
        for _ in range(ROUNDS):
            seconds[ALONE] += _frame_times(scenario, images, None)
            model = _TimedModel(segmenter)
            seconds[BESIDE] += _frame_times(scenario, images, model)
            seconds[MODEL] += model.seconds
    console.print(stage_table(stage_figures(seconds), "frames of a push, one after the other without a pause"))


class _TimedModel:
    """A refinement that asks a model about as many objects as there may be, and changes nothing."""

    def __init__(self, segmenter: PromptedSegmenter) -> None:
        self._segmenter = segmenter
        self.seconds: list[float] = []
        """What each image took."""

    def __call__(self, frame: Frame, mask: NDArray[np.uint16]) -> NDArray[np.uint16]:
        start = perf_counter()
        prompt = prompt_of_mask(np.ones(mask.shape, bool), points=5, with_mask=False)
        for _ in self._segmenter(frame.color, [prompt] * OBJECTS):
            pass
        self.seconds.append(perf_counter() - start)
        return mask


def _frame_times(
    scenario: Scenario, images: Sequence[StationOutputs], model: _TimedModel | None
) -> list[float]:
    """Wall time of every frame but the first, s; the model begins anew whenever it is done."""
    period = 1 / scenario.station.camera.rate
    builder = DiagramBuilder()
    block = add_segmentation(
        builder, scenario, PandaKinematics(scenario.station.panda, scenario.station.camera.fixed_pose), seed=0
    )
    refiner = builder.AddSystem(MaskRefiner(model or _nothing, period, REFINER_OFFSET))
    for name in ("pair", "mask"):
        builder.Connect(block.outputs[name], refiner.GetInputPort(name))
    for name, port in block.inputs.items():
        builder.ExportInput(port, name)
    diagram = builder.Build()
    simulator = Simulator(diagram)
    context = simulator.get_mutable_context()
    at_refiner = refiner.GetMyMutableContextFromRoot(context)
    refiner.GetInputPort("phase").FixValue(at_refiner, AbstractValue.Make(ArmPhase.PUSH))
    demand, refined, times = 0, NO_REFINED_MASK, []
    for tick, now in enumerate(images):
        for name, value in now.items():
            diagram.GetInputPort(name).FixValue(context, value)
        refiner.GetInputPort("demand").FixValue(at_refiner, AbstractValue.Make(demand))
        start = perf_counter()
        simulator.AdvanceTo((tick + 1) * period)
        times.append(perf_counter() - start)
        newest = refiner.GetOutputPort("refined").Eval(at_refiner)
        if model is not None and (tick == 0 or newest is not refined):
            demand, refined = demand + 1, newest
    refiner.finish(at_refiner)
    return times[1:]


def _nothing(frame: Frame, mask: NDArray[np.uint16]) -> NDArray[np.uint16]:
    return mask


def _segmenter(parameters: SamParameters) -> SamSegmenter:
    """The scenario's model, or one of SAM 2.1 tiny's size. Raises ModelError."""
    if parameters.folder:
        return load_sam(Path(parameters.folder), parameters.device)
    require("torch", extra="sam")
    transformers = require("transformers", extra="sam")
    return SamSegmenter(transformers.Sam2Model(transformers.Sam2Config()), parameters.device)
