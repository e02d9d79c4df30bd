"""Alg. 2, line 7, second half, better: which motion explains each pixel?

The paper grows regions of similar flow. Flow is smooth where bodies meet, the images are not. So every
pixel above the table is asked which of the groups' rigid motions, or standing still, explains both
images best, in gray value and in depth. Pieces of the image that have no texture of their own are
decided by their edges, and borders between labels follow edges of colour and height.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.camera import Region, bounding_region, pixel_grid, rays
from riseg_drake.geometry.rgbd import Frame, FramePair, unhidden_depth
from riseg_drake.segmentation.above_table import AboveTable
from riseg_drake.segmentation.expected_flow import flow_of_motion
from riseg_drake.segmentation.noise import (
    MeasurementNoise,
    depth_sigma,
    gray_variance,
    smooth_gray,
)
from riseg_drake.segmentation.potts import potts_labels
from riseg_drake.segmentation.superpixels import Superpixels, superpixels

_EVERY = 2
"""Every second pixel in each direction is asked."""


@dataclass
class MotionLabelParameters:
    """How pixels choose a motion. Nothing of it is in the paper."""

    piece: float = 0.006
    """m on the object; size of the pieces that decide as one."""
    cost_max: float = 9.0
    """Squared normalised residuals count no more than that (occlusion, highlights)."""
    correlated_pixels: float = 6.0
    """Noise of depth and flow is correlated over about so many pixels; they count as one."""
    border: float = 6.0
    """Cost of a border between labels, for each pixel of its length, where there is no edge at all."""
    contrast: float = 8.0
    """Gray levels across a border that lower its cost to 1/e."""
    gain_min: float = 0.25
    """A motion must explain the pixels it wins so much better, on average, than any single other one."""


def cut_pieces(
    reference: Frame, above_0: AboveTable, parameters: MotionLabelParameters
) -> tuple[Region, Superpixels]:
    """The pieces of the reference frame that decide as one, in the region of all that stands there."""
    region = bounding_region(above_0.mask)
    z = float(np.median(reference.depth[above_0.mask]))
    size = max(3, round(parameters.piece * reference.intrinsics.fx / max(z, 1e-3)))
    return region, superpixels(reference.color[region], above_0.height[region], above_0.mask[region], size)


def label_by_motion(
    pair: FramePair,
    region: Region,
    pieces: Superpixels,
    motions: NDArray[np.float64],
    noise: MeasurementNoise,
    depth_noise: float,
    parameters: MotionLabelParameters,
) -> NDArray[np.int16]:
    """Give each pixel above the table, at t-1, to the motion that explains it best.

    Args:
        pair: the frames of t-1 and t.
        region: the part of the view of t-1 that `pieces` are of.
        pieces: of the frame of t-1.
        motions: [G, 4, 4] in C0.
        noise: of the images.
        depth_noise: standard deviation of depth at 1 m, m.
        parameters: see there.

    Returns:
        [H, W], 1 + number of the motion; 0 for what stands still and for the table.
    """
    out = np.zeros(pair.reference.depth.shape, np.int16)
    cost = motion_costs(pair, region, motions, noise, depth_noise, parameters)
    of_pixel = pieces.label[::_EVERY, ::_EVERY]
    inside = of_pixel >= 0
    of_pixel = of_pixel[inside]
    samples = np.bincount(of_pixel, minlength=pieces.count)
    unary = np.stack([np.bincount(of_pixel, c[inside], pieces.count) for c in cost], axis=1)
    unary *= _EVERY**2 / parameters.correlated_pixels
    weight = parameters.border * pieces.length * np.exp(-pieces.contrast / parameters.contrast)
    label = _fewest_labels(unary, samples * _EVERY**2, pieces, weight, parameters)
    out[region] = np.where(pieces.label >= 0, label[pieces.label], 0)
    return out


def _fewest_labels(
    unary: NDArray[np.float64],
    pixels: NDArray[np.intp],
    pieces: Superpixels,
    weight: NDArray[np.float64],
    parameters: MotionLabelParameters,
) -> NDArray[np.intp]:
    """Label the pieces, and drop, one after the other, the motions that are not needed.

    A motion is not needed where another single one explains what it has won almost as well: a blank
    surface fits many motions and must not be shared out among them. Standing still is always there.
    """
    needed = list(range(unary.shape[1]))
    while True:
        label = potts_labels(unary[:, needed], pieces.borders, weight)
        gains = []
        for k in range(1, len(needed)):
            mine = label == k
            if not mine.any():
                gains.append(0.0)
                continue
            sums = unary[mine][:, needed].sum(0)
            gain = np.delete(sums, k).min() - sums[k]
            gains.append(gain * parameters.correlated_pixels / pixels[mine].sum())
        if not gains or min(gains) >= parameters.gain_min:
            return np.array(needed)[label]
        del needed[int(np.argmin(gains)) + 1]


def motion_costs(
    pair: FramePair,
    region: Region,
    motions: NDArray[np.float64],
    noise: MeasurementNoise,
    depth_noise: float,
    parameters: MotionLabelParameters,
) -> NDArray[np.float32]:
    """How badly standing still and each motion [G, 4, 4] explain the pixels of a region.

    [1 + G, h, w], for every second pixel in each direction, which loses little: noise is correlated.

    Squared residuals of gray value and of depth, normalised by their noise: 1 + 1 where a motion is
    right, up to `cost_max` each where it is wrong.
    """
    reference, current = pair.reference, pair.current
    intrinsics = current.intrinsics
    every = (slice(None, None, _EVERY), slice(None, None, _EVERY))
    I_0, gray_1 = smooth_gray(reference.color[region]), smooth_gray(current.color)
    variance, I_0 = gray_variance(I_0, noise)[every], I_0[every]
    depth = reference.depth[region][every]
    depth_1, robot_1 = unhidden_depth(current), current.robot.astype(np.uint8)
    coarse = tuple(slice(side.start, side.stop, _EVERY) for side in region)
    ray, uv = rays(intrinsics)[coarse], pixel_grid(*intrinsics.shape)[coarse]
    cost = []
    for motion in (np.eye(4), *motions):
        X = pair.X_C1C0 @ motion
        target = uv + flow_of_motion(depth, X, intrinsics, coarse)
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
