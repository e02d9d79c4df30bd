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

from riseg_drake.geometry.camera import Region, bounding_region, rays
from riseg_drake.geometry.rgbd import Frame, FramePair, unhidden_depth
from riseg_drake.segmentation.above_table import AboveTable
from riseg_drake.segmentation.expected_flow import where_to
from riseg_drake.segmentation.noise import (
    MeasurementNoise,
    depth_sigma,
    gray_variance,
    smooth_gray,
)
from riseg_drake.segmentation.potts import potts_labels
from riseg_drake.segmentation.superpixels import Superpixels, superpixels

_ROW = 256
"""Pixels are handed to OpenCV in rows of so many: it wants images, and none longer than 32767."""

_NO_EVIDENCE = np.float32(2)
"""The cost that is expected of a match."""
_RIM = np.ones((7, 7), np.uint8)
"""Three pixels on each side of an outline are blurred, interpolated across it, or without true depth."""


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
    inside = np.nonzero(pieces.label >= 0)
    of_pixel = pieces.label[inside]
    pixel = (inside[0] + region[0].start, inside[1] + region[1].start)
    cost = motion_costs(pair, pixel, motions, noise, depth_noise, parameters)
    # On the rim a pixel sees half of what is behind it: no motion explains that, least of all the right one.
    core = cv2.erode((pieces.label >= 0).astype(np.uint8), _RIM, borderValue=0)[inside] > 0
    cost[:, ~core] = _NO_EVIDENCE
    sums = [np.bincount(of_pixel, c, pieces.count) for c in cost]
    unary = np.stack(sums, axis=1) / parameters.correlated_pixels
    pixels = np.bincount(of_pixel, minlength=pieces.count)
    weight = parameters.border * pieces.length * np.exp(-pieces.contrast / parameters.contrast)
    label = _fewest_labels(unary, pixels, pieces, weight, parameters)
    out[pixel] = label[of_pixel]
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
    pixel: tuple[NDArray[np.intp], NDArray[np.intp]],
    motions: NDArray[np.float64],
    noise: MeasurementNoise,
    depth_noise: float,
    parameters: MotionLabelParameters,
) -> NDArray[np.float32]:
    """How badly standing still and each motion [G, 4, 4] explain N pixels (v, u) of t-1, [1 + G, N].

    Squared residuals of gray value and of depth, normalised by their noise: 1 + 1 where a motion is
    right, up to `cost_max` each where it is wrong.
    """
    reference, current = pair.reference, pair.current
    intrinsics = current.intrinsics
    count = len(pixel[0])
    rows = tuple(np.resize(index, (-(-count // _ROW), _ROW)) for index in pixel)
    gray_0, gray_1 = smooth_gray(reference.color), smooth_gray(current.color)
    I_0, variance = gray_0[rows], gray_variance(gray_0, noise)[rows]
    depth, ray = reference.depth[rows], rays(intrinsics)[rows]
    depth_1, robot_1 = unhidden_depth(current), current.robot.astype(np.uint8)
    cost_max = np.float32(parameters.cost_max)
    cost = np.empty((1 + len(motions), count), np.float32)
    for k, motion in enumerate((np.eye(4), *motions)):
        target, z_expected = where_to(ray, depth, pair.X_C1C0 @ motion, intrinsics)
        I_1 = cv2.remap(gray_1, target, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        z_1 = cv2.remap(depth_1, target, None, cv2.INTER_NEAREST, borderValue=0)
        hidden = cv2.remap(robot_1, target, None, cv2.INTER_NEAREST, borderValue=1) > 0
        photometric = np.minimum((I_1 - I_0) ** 2 / variance, cost_max)
        sigma = depth_sigma(z_expected, np.sqrt(2) * depth_noise)
        geometric = np.minimum(((z_1 - z_expected) / sigma) ** 2, cost_max)
        both = photometric + np.where(z_1 > 0, geometric, np.float32(1))
        # What cannot be compared speaks neither for nor against: the value expected of a match.
        both[hidden | ~np.isfinite(both)] = _NO_EVIDENCE
        cost[k] = both.ravel()[:count]
    return cost
