"""Alg. 2, line 7, second half, better: which motion explains each pixel?

The paper grows regions of similar flow. Flow is smooth where bodies meet, the images are not. So every
pixel above the table is asked which of the groups' rigid motions, or standing still, explains both
images best, in gray value and in depth. Pieces of the image that have no texture of their own are
decided by their edges, and borders between labels follow edges of colour and height.
"""

from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.camera import Region, bounding_region
from riseg_drake.geometry.rgbd import Frame, FramePair, Immutable
from riseg_drake.segmentation.above_table import AboveTable
from riseg_drake.segmentation.alignment import (
    AlignmentParameters,
    EdgePixels,
    edge_costs,
    edge_pixels,
    has_contrast,
)
from riseg_drake.segmentation.lighting import gray_costs
from riseg_drake.segmentation.noise import MeasurementNoise, depth_sigma, gray_variance
from riseg_drake.segmentation.potts import PottsGraph, potts_labels
from riseg_drake.segmentation.superpixels import Superpixels, blank_surfaces, superpixels
from riseg_drake.segmentation.surface import SurfacePixels, seek, surface_pixels
from riseg_drake.segmentation.vacated import VacatedParameters, refute_motions

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
    relit: float = 1.0
    """What it adds to a piece's squared residuals if the light on it is taken to have changed, as where a
    shadow has come or gone."""
    correlated_pixels: float = 6.0
    """Noise of depth and flow is correlated over about so many pixels; they count as one."""
    border: float = 6.0
    """Cost of a border between labels, for each pixel of its length, where there is no edge at all."""
    contrast: float = 8.0
    """Gray levels across a border that lower its cost to 1/e."""
    surface_min: float = 3.0e-4
    """m^2; a blank surface of that size may need a motion of its own."""
    alignment: AlignmentParameters = field(default_factory=AlignmentParameters)
    gain_min: float = 0.25
    """A motion must explain the pixels it wins so much better, on average, than any single other one."""
    whole_max: float = 5.0
    """A blank surface, or an object that has moved as one before, goes to a single motion whole if the mean
    squared residuals of its edges (gray and depth, 2 where a motion is right) are less than that,"""
    split_gain: float = 1.0
    """and if several motions do not explain them so much better."""
    vacated: VacatedParameters = field(default_factory=VacatedParameters)


@dataclass(frozen=True)
class ReferencePieces(Immutable):
    """The reference frame cut into pieces, with all that is asked of it for each new frame."""

    region: Region
    """The part of the view that is cut: all that stands there."""
    pieces: Superpixels
    """Of the region."""
    area: NDArray[np.intp]
    """[number of pieces], pixels of each."""
    graph: PottsGraph
    """Which pieces are neighbours, and what different labels on both sides cost."""
    witnesses: SurfacePixels
    """The pixels that are asked: with depth, and not on the rim."""
    piece: NDArray[np.intp]
    """[N], of each witness."""
    gray: NDArray[np.float32]
    """[N], gray value of each witness."""
    variance: NDArray[np.float32]
    """[N], of the difference between that and where it should reappear."""
    surface: SurfacePixels
    """The witnesses and those on the rim: what leaves its place when it moves."""
    surface_piece: NDArray[np.intp]
    """[K], of each of these."""
    left_min: float
    """Pixels; so many places must have been left before depth can refute a motion."""
    edges: EdgePixels
    """What sharpens the motions."""
    whole_edges: EdgePixels
    """Those of them that lie on a whole, and decide it."""


def cut_pieces(
    reference: Frame,
    above_0: AboveTable,
    known: NDArray[np.uint16],
    noise: MeasurementNoise,
    parameters: MotionLabelParameters,
) -> ReferencePieces:
    """The pieces of the reference frame that decide as one, in the region of all that stands there.

    Args:
        reference: the frame.
        above_0: what stands on the table there.
        known: [H, W], ids of the objects that have moved as one before, 0 elsewhere.
        noise: of the images.
        parameters: see there.
    """
    region = bounding_region(above_0.mask)
    size = max(3, round(parameters.piece * above_0.pixels_per_metre(reference.intrinsics)))
    pieces = superpixels(reference.color[region], above_0.height[region], above_0.mask[region], size)
    whole = np.full(above_0.mask.shape, -1, np.intp)
    whole[region] = pieces.label
    variance = gray_variance(reference.gray, noise)
    contrast = has_contrast(variance, noise)
    blank = blank_surfaces(pieces, parameters.surface_min * above_0.pixels_per_metre(reference.intrinsics) ** 2)
    wholes = [blank == number for number in range(int(blank.max(initial=-1)) + 1)]
    wholes += _pieces_of(known[region], pieces)
    # On the rim a pixel sees half of what is behind it: no motion explains that, least of all the right one.
    core = cv2.erode((whole >= 0).astype(np.uint8), _RIM, borderValue=0) > 0
    witnesses = surface_pixels(core, reference.depth, reference.intrinsics)
    v, u = witnesses.pixel
    surface = surface_pixels(whole >= 0, reference.depth, reference.intrinsics)
    edges = edge_pixels(reference, whole, contrast, variance, wholes, parameters.alignment.pixels)
    on_whole = np.any(wholes, axis=0)[edges.piece] if wholes else np.zeros(len(edges.piece), bool)
    return ReferencePieces(
        region=region,
        pieces=pieces,
        area=np.bincount(pieces.label[pieces.label >= 0], minlength=pieces.count),
        graph=PottsGraph(
            pieces.count,
            pieces.borders,
            parameters.border * pieces.length * np.exp(-pieces.contrast / parameters.contrast),
        ),
        witnesses=witnesses,
        piece=whole[v, u],
        gray=reference.gray[v, u],
        variance=variance[v, u],
        surface=surface,
        surface_piece=whole[tuple(surface.pixel)],
        left_min=parameters.vacated.area_min * above_0.pixels_per_metre(reference.intrinsics) ** 2,
        edges=edges,
        whole_edges=edges.subset(np.flatnonzero(on_whole)),
    )


def _pieces_of(label: NDArray[np.uint16], pieces: Superpixels) -> list[NDArray[np.bool_]]:
    """For each id in a label image [H, W], the pieces [N] that it has most of."""
    ids, number = np.unique(label, return_inverse=True)
    inside = pieces.label >= 0
    code = pieces.label[inside] * len(ids) + number.reshape(label.shape)[inside]
    votes = np.bincount(code, minlength=pieces.count * len(ids)).reshape(pieces.count, len(ids))
    winner = ids[votes.argmax(1)]
    return [winner == a for a in ids if a > 0]


def label_by_motion(
    pair: FramePair,
    pieces: ReferencePieces,
    motions: NDArray[np.float64],
    depth_noise: float,
    parameters: MotionLabelParameters,
) -> NDArray[np.int16]:
    """Give each pixel above the table, at t-1, to the motion that explains it best.

    Args:
        pair: the frames of t-1 and t.
        pieces: of the frame of t-1.
        motions: [G, 4, 4] in C0.
        depth_noise: standard deviation of depth at 1 m, m.
        parameters: see there.

    Returns:
        [H, W], 1 + number of the motion; 0 for what stands still and for the table.
    """
    count = pieces.pieces.count
    cost = motion_costs(pair, pieces, motions, depth_noise, parameters.cost_max, parameters.relit)
    sums = np.array([np.bincount(pieces.piece, c, count) for c in cost], np.float32)
    unary = sums / np.float32(parameters.correlated_pixels)
    label = _fewest_labels(unary, pieces, parameters)
    if len(pieces.whole_edges.piece):
        edge_cost = edge_costs(pair, pieces.whole_edges, motions, depth_noise)
        _keep_whole(label, edge_cost, pieces.whole_edges, parameters)
    label = refute_motions(
        pair,
        label,
        pieces.pieces,
        pieces.region,
        pieces.surface,
        pieces.surface_piece,
        motions,
        depth_noise,
        pieces.left_min,
        parameters.vacated,
    )
    out = np.zeros(pair.reference.depth.shape, np.int16)
    # The last entry is for what is in no piece, whose number is -1.
    out[pieces.region] = np.append(label, 0)[pieces.pieces.label]
    return out


def _fewest_labels(
    unary: NDArray[np.float32], pieces: ReferencePieces, parameters: MotionLabelParameters
) -> NDArray[np.intp]:
    """Label the pieces by their costs [1 + G, pieces], and drop, one by one, the motions not needed.

    A motion is not needed where another single one explains what it has won almost as well: a blank
    surface fits many motions and must not be shared out among them. Standing still is always there.
    """
    needed = list(range(len(unary)))
    message = None
    while True:
        label, message = potts_labels(unary[needed], pieces.graph, message)
        gains = []
        for k in range(1, len(needed)):
            mine = label == k
            if not mine.any():
                gains.append(0.0)
                continue
            sums = unary[needed][:, mine].sum(1)
            gain = np.delete(sums, k).min() - sums[k]
            gains.append(gain * parameters.correlated_pixels / pieces.area[mine].sum())
        if not gains or min(gains) >= parameters.gain_min:
            return np.array(needed)[label]
        dropped = int(np.argmin(gains)) + 1
        del needed[dropped]
        # The others' messages are a good start.
        message = np.delete(message, dropped, axis=0)


def _keep_whole(
    label: NDArray[np.intp],
    edge_cost: NDArray[np.float32],
    edges: EdgePixels,
    parameters: MotionLabelParameters,
) -> None:
    """Give each whole to one motion, in place, where one explains its edges as well as several do."""
    for mine in edges.wholes:
        on = np.flatnonzero(mine[edges.piece])
        if len(on) < parameters.alignment.members_min:
            continue
        single = edge_cost[:, on].mean(1)
        several = edge_cost[label[edges.piece[on]], on].mean()
        if single.min() < min(parameters.whole_max, several + parameters.split_gain):
            label[mine] = single.argmin()


def motion_costs(
    pair: FramePair,
    pieces: ReferencePieces,
    motions: NDArray[np.float64],
    depth_noise: float,
    cost_max: float,
    relit: float,
) -> NDArray[np.float32]:
    """How badly standing still and each motion [G, 4, 4] explain the N witnesses of t-1, [1 + G, N].

    Squared residuals of gray value and of depth, normalised by their noise: 1 + 1 where a motion is
    right, up to `cost_max` each where it is wrong. Where the light has changed, `relit` more.
    """
    gray_1, depth_1 = pair.current.unhidden_gray, pair.current.unhidden_depth
    per_variance = 1 / pieces.variance
    ceiling = np.float32(cost_max)
    cost = np.empty((1 + len(motions), len(pieces.witnesses)), np.float32)
    for k, motion in enumerate((np.eye(4), *motions)):
        sought = seek(pieces.witnesses, pair.X_C1C0 @ motion)
        z_1 = sought.read(depth_1)
        photometric = gray_costs(
            pieces.gray,
            sought.read_between(gray_1),
            per_variance,
            pieces.piece,
            pieces.pieces.count,
            cost_max,
            relit,
        )
        sigma = depth_sigma(sought.depth, float(np.sqrt(2)) * depth_noise)
        geometric = np.minimum(((z_1 - sought.depth) / sigma) ** 2, ceiling)
        both = photometric + np.where(z_1 > 0, geometric, np.float32(1))
        # What cannot be compared speaks neither for nor against: the value expected of a match.
        cost[k] = np.where(np.isnan(both), _NO_EVIDENCE, both)
    return cost
