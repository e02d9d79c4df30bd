"""The masks' outlines made sharper by Segment Anything, wired behind Alg. 2."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pydrake.systems.framework import DiagramBuilder

from riseg_drake.app.scenario import Scenario
from riseg_drake.app.segmentation_block import MASK_OFFSET, SegmentationBlock
from riseg_drake.geometry.rgbd import Frame
from riseg_drake.learned.outlines import refine_outlines
from riseg_drake.learned.sam import SamParameters, load_sam
from riseg_drake.systems.arm_motion import ArmMotion
from riseg_drake.systems.mask_refiner import MaskRefiner, Refinement

REFINER_OFFSET = MASK_OFFSET + 0.0002
"""The refiner looks this long after the camera's tick, s: once L_t is made."""


def add_refinement(
    builder: DiagramBuilder, scenario: Scenario, segmentation: SegmentationBlock, arm: ArmMotion
) -> MaskRefiner | None:
    """Add a MaskRefiner where the scenario names a model. Raises ModelError if that cannot be loaded."""
    if not scenario.sam.folder:
        return None
    refiner = builder.AddSystem(
        MaskRefiner(sam_refinement(scenario.sam), 1 / scenario.station.camera.rate, REFINER_OFFSET)
    )
    for name in ("pair", "mask"):
        builder.Connect(segmentation.outputs[name], refiner.GetInputPort(name))
    builder.Connect(arm.GetOutputPort("phase"), refiner.GetInputPort("phase"))
    return refiner


def sam_refinement(parameters: SamParameters) -> Refinement:
    """What makes outlines sharper, with the model loaded. Raises ModelError."""
    segmenter = load_sam(Path(parameters.folder), parameters.device)

    def refine(frame: Frame, mask: NDArray[np.uint16]) -> NDArray[np.uint16]:
        return refine_outlines(frame, mask, segmenter, parameters.outlines)

    return refine
