"""Alg. 2, line 7, second half: from a few seeds to every pixel that moves with them.

`grow_by_similar_flow` is the paper's breadth first search. `label_by_motion` asks of every pixel
which of the groups' rigid motions, or standing still, explains both images best: flow is smooth where
bodies meet, the images are not, so outlines come out sharper.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.camera import Region, bounding_region, pixel_grid, rays
from riseg_drake.geometry.rgbd import FramePair, unhidden_depth
from riseg_drake.segmentation.expected_flow import flow_of_motion
from riseg_drake.segmentation.motions import BFIFGroups
from riseg_drake.segmentation.noise import (
    MeasurementNoise,
    depth_sigma,
    gray_variance,
    smooth_gray,
)

STILL = 0
UNDECIDED = -1


@dataclass
class GrowthParameters:
    """How regions grow from seeds."""

    kind: str = "motion"
    """"motion" (which motion explains the pixel) or "flow" (breadth first search, as in the paper)."""
    flow_min: float = 0.8
    """"flow": pixels of effective flow from which a pixel moves."""
    similar_flow: float = 0.35
    """"flow": neighbours whose effective flow differs by less, in pixels, move alike."""
    window: float = 0.005
    """"motion": m on the object over which a pixel's evidence is averaged."""
    cost_max: float = 9.0
    """"motion": squared normalised residuals count no more than that (occlusion, highlights)."""
    margin: float = 0.5
    """"motion": how much better the best motion must be than the next for a pixel to be sure."""


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


def label_by_motion(
    pair: FramePair,
    above_0: NDArray[np.bool_],
    motions: NDArray[np.float64],
    noise: MeasurementNoise,
    depth_noise: float,
    parameters: GrowthParameters,
) -> NDArray[np.int16]:
    """Give each pixel above the table, at t-1, to the motion that explains it best.

    Returns:
        [H, W], 1 + number of the motion; 0 for what stands still and for the table. What the images
        leave open is filled from its surroundings, along edges of colour.
    """
    out = np.zeros(above_0.shape, np.int16)
    if not len(motions) or not above_0.any():
        return out
    region = bounding_region(above_0, margin=8)
    cost = motion_costs(pair, region, motions, noise, depth_noise, parameters)
    z = float(np.median(pair.reference.depth[above_0]))
    radius = max(1, round(0.5 * parameters.window * pair.current.intrinsics.fx / max(z, 1e-3)))
    guide = cv2.cvtColor(pair.reference.color[region], cv2.COLOR_RGB2GRAY).astype(np.float32) / 255
    smooth = np.stack([edge_aware_mean(c, guide, radius) for c in cost])
    best = smooth.argmin(0)
    ordered = np.partition(smooth, 1, axis=0)
    sure = ordered[1] - ordered[0] > parameters.margin
    label = np.where(sure, best, UNDECIDED).astype(np.int16)
    out[region] = fill_undecided(label, above_0[region], pair.reference.color[region])
    return out


def motion_costs(
    pair: FramePair,
    region: Region,
    motions: NDArray[np.float64],
    noise: MeasurementNoise,
    depth_noise: float,
    parameters: GrowthParameters,
) -> NDArray[np.float32]:
    """How badly standing still and each motion [G, 4, 4] explain each pixel of a region, [1 + G, h, w].

    Squared residuals of gray value and of depth, normalised by their noise: 1 + 1 where a motion is
    right, up to `cost_max` each where it is wrong.
    """
    reference, current = pair.reference, pair.current
    intrinsics = current.intrinsics
    I_0, gray_1 = smooth_gray(reference.color[region]), smooth_gray(current.color)
    variance = gray_variance(I_0, noise)
    depth = reference.depth[region]
    depth_1, robot_1 = unhidden_depth(current), current.robot.astype(np.uint8)
    ray = rays(intrinsics)[region]
    uv = pixel_grid(*intrinsics.shape)[region]
    cost = []
    for motion in (np.eye(4), *motions):
        X = pair.X_C1C0 @ motion
        target = uv + flow_of_motion(reference.depth, X, intrinsics, region)
        I_1 = cv2.remap(gray_1, target, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        z_1 = cv2.remap(depth_1, target, None, cv2.INTER_NEAREST, borderValue=0)
        hidden = cv2.remap(robot_1, target, None, cv2.INTER_NEAREST, borderValue=1) > 0
        z_expected = depth * (ray @ X[2, :3].astype(np.float32)) + np.float32(X[2, 3])
        photometric = np.minimum((I_1 - I_0) ** 2 / variance, parameters.cost_max)
        squared = (z_1 - z_expected) ** 2 / (2 * depth_sigma(z_expected, depth_noise) ** 2)
        geometric = np.where(z_1 > 0, np.minimum(squared, parameters.cost_max), 1.0)
        # What cannot be compared speaks neither for nor against: the value expected of a match.
        cost.append(np.where(hidden | (depth <= 0), 2.0, photometric + geometric))
    return np.nan_to_num(np.stack(cost).astype(np.float32), nan=2.0)


def edge_aware_mean(values: NDArray, guide: NDArray, radius: int, epsilon: float = 1e-3) -> NDArray:
    """Mean over a window that does not cross edges of the guide (guided filter, He et al. 2010)."""
    size = (2 * radius + 1, 2 * radius + 1)

    def mean(a: NDArray) -> NDArray:
        return cv2.boxFilter(a, -1, size)

    mean_g, mean_v = mean(guide), mean(values)
    a = (mean(guide * values) - mean_g * mean_v) / (mean(guide * guide) - mean_g**2 + epsilon)
    return mean(a) * guide + mean(mean_v - a * mean_g)


def fill_undecided(
    label: NDArray[np.int16], inside: NDArray[np.bool_], color: NDArray[np.uint8]
) -> NDArray[np.int16]:
    """Flood the undecided pixels inside from the decided ones, along edges of the image (watershed)."""
    markers = label.astype(np.int32) + 2  # undecided becomes 1
    outside = markers.max() + 1
    markers[markers == UNDECIDED + 2] = 0
    markers[~inside] = outside
    smooth = cv2.GaussianBlur(color, (0, 0), 1.0)
    flooded = cv2.watershed(smooth, markers.copy())
    # Watershed draws ridges (-1) between basins: give them back to the nearest basin inside.
    ridge = inside & ((flooded <= 0) | (flooded == outside))
    known = inside & ~ridge
    if ridge.any() and known.any():
        _, index = cv2.distanceTransformWithLabels(
            (~known).astype(np.uint8), cv2.DIST_L2, 3, labelType=cv2.DIST_LABEL_PIXEL
        )
        value = np.zeros(index.max() + 1, np.int32)
        value[index[known]] = flooded[known]
        flooded = np.where(ridge, value[index], flooded)
    return np.where(inside & (flooded > 1), flooded - 2, STILL).astype(np.int16)


def _nearest_seed_group(
    shape: tuple[int, int], seeds: NDArray[np.intp], group: NDArray[np.intp]
) -> NDArray[np.intp]:
    """For each pixel the group of the seed nearest to it, [H, W]."""
    away = np.ones(shape, np.uint8)
    away[seeds[:, 0], seeds[:, 1]] = 0
    _, index = cv2.distanceTransformWithLabels(away, cv2.DIST_L2, 3, labelType=cv2.DIST_LABEL_PIXEL)
    value = np.zeros(index.max() + 1, np.intp)
    value[index[seeds[:, 0], seeds[:, 1]]] = group
    return value[index]
