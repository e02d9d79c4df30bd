"""Alg. 2, line 7: the groups G_t and the mask L_t-1 make the mask L_t, by evidence or as the paper has it."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.rgbd import FramePair
from riseg_drake.segmentation.above_table import AboveTable
from riseg_drake.segmentation.bfif import BFIFParameters
from riseg_drake.segmentation.look import EvidenceParameters
from riseg_drake.segmentation.motions import BFIFGroups
from riseg_drake.segmentation.paper import PaperParameters, segment_as_in_paper
from riseg_drake.segmentation.segment_by_evidence import segment_by_evidence
from riseg_drake.segmentation.segmentation import Segmentation


@dataclass
class SegmentParameters:
    """All of line 7."""

    method: str = field(default="evidence", metadata={"choices": ("evidence", "paper")})
    """"evidence" (segment_by_evidence.py) or, to the letter, "paper" (paper.py)."""
    evidence: EvidenceParameters = field(default_factory=EvidenceParameters)
    paper: PaperParameters = field(default_factory=PaperParameters)


def segment(
    before: Segmentation,
    pair: FramePair,
    expected_flow: NDArray[np.float32],
    optical_flow: NDArray[np.float32],
    groups: BFIFGroups,
    above_0: AboveTable,
    above_1: AboveTable,
    see_whole: Callable[[], AboveTable],
    parameters: SegmentParameters,
    bfif: BFIFParameters,
) -> Segmentation:
    """L_t from G_t, O_t and L_t-1.

    Args:
        before: L_t-1; if it already belongs to this pair's frame it is the answer.
        pair: the frames of t-1 and t.
        expected_flow: E_t [H, W, 2], pixels.
        optical_flow: O_t [H, W, 2], pixels.
        groups: G_t.
        above_0: objMask at t-1.
        above_1: objMask at t.
        see_whole: gives objMask at t of the whole frame, for which rests alone ask.
        parameters: see there.
        bfif: what the groups were made with: noise of the measurements, and when two motions are one.

    Raises:
        ValueError: for an unknown method.
    """
    if before.sequence == pair.current.sequence:
        return before
    if parameters.method == "evidence":
        return segment_by_evidence(before, pair, groups, above_1, see_whole, parameters.evidence, bfif)
    if parameters.method == "paper":
        return segment_as_in_paper(before, pair, expected_flow, optical_flow, groups, above_0, parameters.paper)
    raise ValueError(f"no method {parameters.method!r} to segment: choose evidence or paper")
