"""What has moved away has left its place: depth refutes motions that only light has made.

A shadow that wanders over an object, or a highlight on it, moves in the images as a body would, and no
comparison of gray values tells it from one. Depth does: a body that has moved leaves room behind it,
and where the surface still is, as far as depth can tell, nothing has gone. Nothing of it is in the paper.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.camera import Region
from riseg_drake.geometry.rgbd import FramePair
from riseg_drake.segmentation.noise import depth_sigma
from riseg_drake.segmentation.superpixels import Superpixels, connected_pieces
from riseg_drake.segmentation.surface import SurfacePixels, seek

_NEXT = np.ones((3, 3), np.uint8)
"""Pixels beside those of a part may be its own: pieces are cut at whole pixels."""


@dataclass
class VacatedParameters:
    """When depth says that a part has not moved as it seems to have."""

    area_min: float = 2.5e-5
    """m^2 of left places in which depth was measured; less tells nothing."""
    share: float = 0.75
    """Of these, how many must show the surface that should have gone."""
    sigmas: float = 3.0
    """Standard deviations of depth within which a surface is still there."""


def refute_motions(
    pair: FramePair,
    label: NDArray[np.intp],
    pieces: Superpixels,
    region: Region,
    surface: SurfacePixels,
    piece: NDArray[np.intp],
    motions: NDArray[np.float64],
    depth_noise: float,
    pixels_min: float,
    parameters: VacatedParameters,
) -> NDArray[np.intp]:
    """The labels without motions that depth refutes.

    Each connected part with one label is asked: had it moved as its neighbours, or not at all, where
    would it be now, but for where it seems to have gone? If its surface is there, so it has.

    Args:
        pair: the frames of t-1 and t.
        label: [pieces], 1 + number of the motion, 0 = stands still.
        pieces: of the frame of t-1, in a region of the view.
        region: that region.
        surface: the N pixels of pieces that have depth.
        piece: [N], of each of these.
        motions: [G, 4, 4] in C0.
        depth_noise: standard deviation of depth at 1 m, m.
        pixels_min: what `parameters.area_min` is in pixels.
        parameters: see there.
    """
    if not label.any():
        return label
    borders = pieces.borders
    # The connected parts that have one label.
    count, part = connected_pieces(len(label), borders[label[borders[:, 0]] == label[borders[:, 1]]])
    X = np.concatenate([np.eye(4)[None], motions])
    own = np.zeros(pair.reference.depth.shape, np.uint8)
    best = np.zeros(count)
    out = label.copy()
    for k in np.unique(label[label > 0]):
        mine = np.flatnonzero(label[piece] == k)
        own[region] = cv2.dilate(np.append(label == k, False)[pieces.label].astype(np.uint8), _NEXT)
        pixels, part_of = surface.subset(mine), part[piece[mine]]
        for other in _neighbours(label, borders, k):
            left = np.flatnonzero(_left_places(pixels, own, X[k], X[other]))
            if len(left) < pixels_min:
                continue
            measured, there = _found(pair, pixels.subset(left), X[other], depth_noise, parameters.sigmas)
            of_part = part_of[left]
            number = np.bincount(of_part, measured, count)
            share = np.bincount(of_part, there, count) / np.maximum(number, 1)
            refuted = (number >= pixels_min) & (share >= parameters.share) & (share > best)
            best[refuted] = share[refuted]
            out[refuted[part]] = other
    return out


def _left_places(
    pixels: SurfacePixels, own: NDArray[np.uint8], motion: NDArray, other: NDArray
) -> NDArray[np.bool_]:
    """Which pixels [N], moved otherwise, would be where nothing of their own image [H, W] has moved to."""
    return seek(pixels, np.linalg.inv(motion) @ other).read(own) == 0


def _found(
    pair: FramePair, pixels: SurfacePixels, motion: NDArray, depth_noise: float, sigmas: float
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Where depth was measured at t [N], and where it is that of the pixels moved so [N]."""
    sought = seek(pixels, pair.X_C1C0 @ motion)
    z_1 = sought.read(pair.current.unhidden_depth)
    sigma = depth_sigma(sought.depth, float(np.sqrt(2)) * depth_noise)
    return z_1 > 0, (z_1 > 0) & (np.abs(z_1 - sought.depth) < sigmas * sigma)


def _neighbours(label: NDArray[np.intp], borders: NDArray[np.intp], k: int) -> list[int]:
    """Standing still, and the labels across the borders of the pieces with label k."""
    across = label[borders]
    touching = across[(across == k).any(axis=1)]
    return sorted({0, *map(int, touching.ravel())} - {int(k)})
