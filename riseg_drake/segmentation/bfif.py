"""Alg. 2, lines 3 to 6, in one piece: from the two flows to groups of body frames."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.camera import bounding_region
from riseg_drake.geometry.rgbd import FramePair
from riseg_drake.segmentation.above_table import AboveTable
from riseg_drake.segmentation.body_frames import (
    BodyFrameParameters,
    BodyFrames,
    sample_body_frames,
)
from riseg_drake.segmentation.effective_flow import MovingParameters, effective_flow, moving_pixels
from riseg_drake.segmentation.explained import explained_share
from riseg_drake.segmentation.grouping import GroupingParameters, group_twists
from riseg_drake.segmentation.motions import (
    BFIFGroups,
    MotionParameters,
    flow_difference,
    group_motions,
    merge_equal_motions,
)
from riseg_drake.segmentation.noise import MeasurementNoise, flow_sigma
from riseg_drake.segmentation.twists import (
    Twists,
    patch_twists,
    point_precision,
    sliding_prior,
    triplet_twists,
)


@dataclass
class BFIFParameters:
    """All of lines 3 to 6."""

    noise: MeasurementNoise = field(default_factory=MeasurementNoise)
    moving: MovingParameters = field(default_factory=MovingParameters)
    frames: BodyFrameParameters = field(default_factory=BodyFrameParameters)
    grouping: GroupingParameters = field(default_factory=GroupingParameters)
    motions: MotionParameters = field(default_factory=MotionParameters)
    explained_min: float = 0.25
    """Of what has moved, the share that the groups' motions must explain in the images; where they do not, flow
    was lost."""


def group_body_frames(
    pair: FramePair,
    expected_flow: NDArray[np.float32],
    optical_flow: NDArray[np.float32],
    above_0: AboveTable,
    parameters: BFIFParameters,
    rng: np.random.Generator,
) -> BFIFGroups:
    """G_t: body frames on what moves, grouped by their spatial twists, with each group's motion.

    None, and an infinite span, where the motions that are found explain nothing.

    Args:
        pair: the frames of t-1 and t.
        expected_flow: E_t [H, W, 2], pixels.
        optical_flow: O_t [H, W, 2], pixels.
        above_0: objMask at t-1.
        parameters: see there.
        rng: draws the body frames.
    """
    noise, focal_length = parameters.noise, pair.current.intrinsics.fx
    moving = moving_pixels(pair, expected_flow, optical_flow, above_0, noise, parameters.moving)
    if not moving.any():
        return no_groups()
    region = bounding_region(moving, margin=16)
    sigma = np.full(moving.shape, np.inf, np.float32)
    sigma[region] = flow_sigma(pair.reference.gray[region], noise)
    trusted = moving & (sigma <= noise.flow_max)
    frames = sample_body_frames(pair, optical_flow, trusted, sigma, parameters.frames, rng)
    if len(frames) < parameters.grouping.members_min:
        return no_groups(_median_length(optical_flow, expected_flow, moving))
    normal_C0 = pair.reference.X_WC[:3, :3].T @ above_0.plane_W[:3]
    prior = sliding_prior(normal_C0, parameters.motions.tilt, parameters.motions.lift)
    precision = point_precision(
        frames.p_C0Q0, frames.depth_1, frames.flow_sigma, above_0.depth_noise, focal_length
    )
    twists = _calc_bfifs(frames, precision, prior, parameters)
    rigid = _on_one_body(twists, parameters.motions.misfit_max)
    frames, twists, precision = frames.subset(rigid), twists.subset(rigid), precision[rigid]
    group = group_twists(twists, parameters.grouping)
    motions = group_motions(frames, group, precision, prior)
    joined = merge_equal_motions(frames, group, motions, focal_length, parameters.motions)
    if not np.array_equal(joined, group):
        group, motions = joined, group_motions(frames, joined, precision, prior)
    pixels_min = parameters.moving.area_min * above_0.pixels_per_metre(pair.reference.intrinsics) ** 2
    if len(motions) and explained_share(pair, motions, above_0, pixels_min, noise) < parameters.explained_min:
        return no_groups(flow_span=np.inf)
    seeds = frames.p_C0Q0[:, 0]
    spans = [flow_difference(seeds[group == g], X, np.eye(4), focal_length) for g, X in enumerate(motions)]
    flow_span = max(spans) if spans else _median_length(optical_flow, expected_flow, moving)
    return BFIFGroups(
        pixel=frames.pixel,
        V_S=twists.V_S,
        covariance=twists.covariance,
        p_C0S=twists.p_C0S,
        group=group,
        motion_C0=motions,
        p_C0Q=seeds,
        flow_span=flow_span,
    )


def _median_length(
    optical_flow: NDArray[np.float32], expected_flow: NDArray[np.float32], moving: NDArray[np.bool_]
) -> float:
    """||X_t|| of what moves, pixels."""
    X_t = effective_flow(optical_flow[moving], expected_flow[moving])
    return float(np.median(np.linalg.norm(X_t, axis=-1)))


def _on_one_body(twists: Twists, misfit_max: float) -> NDArray[np.bool_]:
    """Which body frames [K] a rigid motion explains.

    The others lie across two bodies, are as near to the one's twist as to the other's, and would be a bridge.
    """
    return twists.misfit <= misfit_max * max(1.0, float(np.median(twists.misfit)))


def no_groups(flow_span: float = 0.0) -> BFIFGroups:
    """G_t where nothing moves, or where no body frame can say how (then by `flow_span`, pixels)."""
    return BFIFGroups(
        pixel=np.empty((0, 2), np.intp),
        V_S=np.empty((0, 6)),
        covariance=np.empty((0, 6, 6)),
        p_C0S=np.zeros(3),
        group=np.empty(0, np.intp),
        motion_C0=np.empty((0, 4, 4)),
        p_C0Q=np.empty((0, 3)),
        flow_span=flow_span,
    )


def _calc_bfifs(
    frames: BodyFrames,
    precision: NDArray[np.float64],
    prior: NDArray[np.float64],
    parameters: BFIFParameters,
) -> Twists:
    """Line 5, CalcBFIFs.

    Mahalanobis distances are the same in every space frame. Amid the moving points twists are small and
    read well; at the camera, where the paper has {s}, a turn of the body is a large displacement, too.
    """
    p_C0S = frames.p_C0Q0[:, 0].mean(0)
    if parameters.frames.kind == "triplets":
        return triplet_twists(frames, p_C0S)
    return patch_twists(frames, p_C0S, precision, prior)
