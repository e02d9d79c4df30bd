"""Segment Anything alone: asked about points on a grid, its sharp answers kept ("everything mode").

The paper's baseline of that name. As the other baselines it may know what stands on the table.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from riseg_drake.learned.prompts import PromptedSegmenter, grid_prompts, intersection_over_union


@dataclass
class EverythingParameters:
    """As in Segment Anything's own mask generator, with a coarser grid: toys are large in the picture."""

    grid_side: int = 16
    """Points along each side of the image (Segment Anything: 32)."""
    score_min: float = 0.88
    """The IoU that the model expects of a mask worth keeping."""
    stability_min: float = 0.95
    """And how little it may depend on the threshold."""
    same_iou: float = 0.7
    """Two masks that overlap more are the same."""
    above_table_min: float = 0.5
    """The share of a mask that must stand on the table for it to be an object."""


def segment_everything(
    color: NDArray[np.uint8],
    above_table: NDArray[np.bool_],
    segmenter: PromptedSegmenter,
    parameters: EverythingParameters,
) -> NDArray[np.uint16]:
    """Label image [H, W] of all that a model finds without knowing what to look for, 0 = background.

    Args:
        color: [H, W, 3], RGB.
        above_table: [H, W], objMask.
        segmenter: the model.
        parameters: see there.
    """
    found: list[tuple[float, NDArray[np.bool_]]] = []
    height, width = above_table.shape
    for answer in segmenter(color, grid_prompts(height, width, parameters.grid_side)):
        good = (answer.scores >= parameters.score_min) & (answer.stability >= parameters.stability_min)
        for mask, score in zip(answer.masks[good], answer.scores[good], strict=True):
            area = np.count_nonzero(mask)
            if area and np.count_nonzero(mask & above_table) >= parameters.above_table_min * area:
                found.append((float(score), mask))
    kept: list[NDArray[np.bool_]] = []
    for _, mask in sorted(found, key=lambda each: -each[0]):
        if all(intersection_over_union(mask, other) <= parameters.same_iou for other in kept):
            kept.append(mask)
    label = np.zeros(above_table.shape, np.uint16)
    # The smaller over the larger: a part that was found by itself stays visible.
    for number, mask in enumerate(sorted(kept, key=np.count_nonzero, reverse=True), start=1):
        label[mask] = number
    return label
