"""Alg. 2, line 7, to the letter: L_t <- Segment(G_t, O_t, L_t-1).

Lines 1 to 6 have their options beside them: `bfif.frames.kind: triplets` and `bfif.grouping.covariance: sample`
are the paper's lines 4 to 6, `frame_pair.kind: consecutive` its t-1 and t, a time step apart that it does not
give. What this project does instead of line 7 is in segment_by_evidence.py.
"""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.camera import pixel_grid
from riseg_drake.geometry.nearest import nearest_values
from riseg_drake.geometry.rgbd import FramePair
from riseg_drake.segmentation.above_table import AboveTable
from riseg_drake.segmentation.effective_flow import effective_flow
from riseg_drake.segmentation.motions import BFIFGroups
from riseg_drake.segmentation.propagation import UNKNOWN
from riseg_drake.segmentation.scales import SAME_MOTION
from riseg_drake.segmentation.segmentation import Segmentation


@dataclass
class PaperParameters:
    """What the paper leaves open about its breadth first search."""

    flow_min: float = 0.8
    """Pixels of effective flow from which a pixel moves; the paper's ||X_t|| >> 0."""
    similar_flow: float = SAME_MOTION
    """Pixels; neighbours whose effective flow differs by less move "with similar gradient"."""


def segment_as_in_paper(
    before: Segmentation,
    pair: FramePair,
    expected_flow: NDArray[np.float32],
    optical_flow: NDArray[np.float32],
    groups: BFIFGroups,
    above_0: AboveTable,
    parameters: PaperParameters,
) -> Segmentation:
    """L_t from G_t, O_t and L_t-1; nothing else is remembered.

    Args:
        before: the answer for the frame before, which has L_t-1 where that is not this frame.
        pair: the frames of t-1 and t.
        expected_flow: E_t [H, W, 2], pixels.
        optical_flow: O_t [H, W, 2], pixels.
        groups: G_t.
        above_0: objMask at t-1.
        parameters: see there.
    """
    mask_0 = _mask_at(before, pair.reference.sequence)
    mask = push_by_flow(mask_0, optical_flow)
    if len(groups):
        X_t = effective_flow(optical_flow, expected_flow)
        with np.errstate(invalid="ignore"):
            # Flow on a blank table is made up: what is no object does not move.
            moving = above_0.mask & ((X_t**2).sum(-1) > parameters.flow_min**2)
        grown = grow_by_similar_flow(X_t, moving, groups, parameters.similar_flow)
        found = push_by_flow(_fresh_ids(mask_0, len(groups))[grown], optical_flow)
        mask = np.where(found > 0, found, mask)
    return replace(
        before,
        sequence=pair.current.sequence,
        label=mask,
        seen=pair.current,
        at_reference=(pair.reference.sequence, mask_0),
    )


def _mask_at(before: Segmentation, reference: int) -> NDArray[np.uint16]:
    """L_t-1 [H, W], of the reference frame: that of the frame before, unless t-1 is longer ago."""
    if before.sequence == reference:
        return before.label
    if before.at_reference is not None and before.at_reference[0] == reference:
        return before.at_reference[1]
    return np.zeros_like(before.label)


def push_by_flow(label: NDArray[np.uint16], optical_flow: NDArray[np.float32]) -> NDArray[np.uint16]:
    """L_t(x, y) = L_t-1(i, j) for all L_t-1(i, j) > 0, [H, W]; (x, y) = (i, j) + O_t(i, j) in whole pixels."""
    out = np.zeros_like(label)
    # Where O_t was not asked for nothing stands, so a label that has drifted there ends there.
    v, u = np.nonzero((label > 0) & np.isfinite(optical_flow).all(-1))
    target = np.rint(pixel_grid(*label.shape)[v, u] + optical_flow[v, u]).astype(int)
    inside = (target >= 0).all(1) & (target[:, 0] < label.shape[1]) & (target[:, 1] < label.shape[0])
    out[target[inside, 1], target[inside, 0]] = label[v, u][inside]
    return out


def _fresh_ids(mask: NDArray[np.uint16], count: int) -> NDArray[np.uint16]:
    """An object id that is not in the mask for each group, [1 + count]; the first is 0, for no group."""
    free = np.setdiff1d(np.arange(1, UNKNOWN, dtype=np.uint16), mask)
    return np.concatenate([np.zeros(1, np.uint16), free[:count]])


def grow_by_similar_flow(
    effective_flow: NDArray, moving: NDArray[np.bool_], groups: BFIFGroups, similar_flow: float
) -> NDArray[np.int16]:
    """Breadth first search from the seeds over moving neighbours of similar flow.

    Done at once for all seeds: on a grid of twice the size every pixel and every link between
    neighbours is a cell, so pieces that are linked are connected components.

    Returns:
        [H, W], 1 + group, 0 where nothing grew. A piece with seeds of several groups goes, pixel by
        pixel, to the nearest seed.
    """
    height, width = moving.shape
    linked = np.zeros((2 * height - 1, 2 * width - 1), np.uint8)
    linked[::2, ::2] = moving
    flow = np.where(np.isfinite(effective_flow), effective_flow, 1e6)
    for axis, cells in ((0, linked[1::2, ::2]), (1, linked[::2, 1::2])):
        apart = np.linalg.norm(np.diff(flow, axis=axis), axis=-1)
        both = np.minimum(np.delete(moving, 0, axis), np.delete(moving, -1, axis))
        cells[...] = (apart < similar_flow) & both
    piece = cv2.connectedComponents(linked, connectivity=4)[1][::2, ::2]

    member = groups.group >= 0
    seeds, group = groups.pixel[member], groups.group[member]
    out = np.zeros(moving.shape, np.int16)
    if not len(seeds):
        return out
    nearest = _nearest_seed_group(moving.shape, seeds, group)
    of_piece = piece[seeds[:, 0], seeds[:, 1]]
    for number in np.unique(of_piece[of_piece > 0]):
        inside = piece == number
        claimed = np.unique(group[of_piece == number])
        out[inside] = (claimed[0] if len(claimed) == 1 else nearest[inside]) + 1
    return out


def _nearest_seed_group(
    shape: tuple[int, ...], seeds: NDArray[np.intp], group: NDArray[np.intp]
) -> NDArray[np.intp]:
    """For each pixel the group of the seed nearest to it, [H, W]."""
    own = np.full(shape, -1, np.intp)
    own[seeds[:, 0], seeds[:, 1]] = group
    return nearest_values(own, own >= 0)[0]
