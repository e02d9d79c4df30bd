"""Alg. 2, line 7, second half, as in the paper: from a few seeds to all that flows alike."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from riseg_drake.segmentation.motions import BFIFGroups


@dataclass
class GrowthParameters:
    """How regions grow from seeds by breadth first search."""

    flow_min: float = 0.8
    """Pixels of effective flow from which a pixel moves; the paper's ||X_t|| >> 0."""
    similar_flow: float = 0.35
    """Neighbours whose effective flow differs by less, in pixels, move alike."""


def grow_by_similar_flow(
    effective_flow: NDArray, moving: NDArray[np.bool_], groups: BFIFGroups, similar_flow: float
) -> NDArray[np.int16]:
    """Breadth first search from the seeds over moving neighbours of similar flow, as in the paper.

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
    away = np.ones(shape, np.uint8)
    away[seeds[:, 0], seeds[:, 1]] = 0
    _, index = cv2.distanceTransformWithLabels(away, cv2.DIST_L2, 3, labelType=cv2.DIST_LABEL_PIXEL)
    value = np.zeros(index.max() + 1, np.intp)
    value[index[seeds[:, 0], seeds[:, 1]]] = group
    return value[index]
