"""From groups of body frames to the rigid motions that they share (end of Alg. 2, line 6)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.rgbd import Immutable
from riseg_drake.geometry.se3 import exp_se3, move_points, translation
from riseg_drake.segmentation.body_frames import BodyFrames
from riseg_drake.segmentation.scales import SAME_MOTION
from riseg_drake.segmentation.twists import fit_motion

_POINTS_MAX = 200
"""A motion of six numbers needs no more points than that."""


@dataclass
class MotionParameters:
    """When two groups are one body after all, and when a group's motion is none."""

    merge_flow: float = SAME_MOTION
    """Pixels (root mean square); two motions that predict flow within that are one: no clustering can
    tell them apart, and Markov clustering splits a body now and then."""
    still_flow: float = 2 * SAME_MOTION
    """Pixels (root mean square); a group that moves less than that stands still."""

    tilt: float = 0.03
    """rad; how much bodies are expected to tilt while they slide (infinite in the paper)."""
    lift: float = 0.002
    """m; how much they are expected to rise or sink (infinite in the paper)."""
    misfit_max: float = 3.0
    """A body frame whose own best motion leaves a mean squared residual so many times that of the median
    frame lies across two bodies."""


@dataclass(frozen=True)
class BFIFGroups(Immutable):
    """G_t: the body frames, the group of each, and the motion of each group."""

    pixel: NDArray[np.intp]
    """[K, 2], seeds (v, u) in the view of t-1."""
    V_S: NDArray[np.float64]
    """[K, 6], their spatial twists, [omega; v], radian and metre per pair."""
    covariance: NDArray[np.float64]
    """[K, 6, 6]."""
    p_C0S: NDArray[np.float64]
    """[3], the origin of the space frame {s}."""
    group: NDArray[np.intp]
    """[K], 0..G-1, or -1 for a frame that belongs to none."""
    motion_C0: NDArray[np.float64]
    """[G, 4, 4]: takes a body's points at t-1 to where they are at t, both seen from C0."""
    p_C0Q: NDArray[np.float64]
    """[K, 3], the seeds' points at t-1, m."""
    flow_span: float
    """Effective flow of the fastest group (root mean square over its frames), pixels. Where there is no
    group, the median over what moves, which a body without texture does too; 0 if nothing moves; infinite
    where flow was lost, so that the reference is renewed."""

    def __len__(self) -> int:
        """The number of groups G."""
        return len(self.motion_C0)


def group_motions(
    frames: BodyFrames,
    group: NDArray[np.intp],
    precision: NDArray[np.float64],
    prior: NDArray | None = None,
) -> NDArray[np.float64]:
    """The rigid motion [G, 4, 4] in C0 that fits all points of each group's frames best.

    Args:
        frames: K body frames of M points.
        group: [K], 0..G-1 or -1.
        precision: [K, M, 3, 3], of the points' displacements, see `point_precision`.
        prior: [6, 6], see `fit_motion`.
    """
    G = int(group.max(initial=-1)) + 1
    if G == 0:
        return np.empty((0, 4, 4))
    q_0, q_1 = np.zeros((2, G, _POINTS_MAX, 3))
    W = np.zeros((G, _POINTS_MAX, 3, 3))
    used = np.zeros((G, _POINTS_MAX), bool)
    for g in range(G):
        mine = np.argwhere(frames.used & (group == g)[:, None])
        k, m = mine[:: -(-len(mine) // _POINTS_MAX)].T
        n = len(k)
        q_0[g, :n], q_1[g, :n] = frames.p_C0Q0[k, m], frames.p_C0Q1[k, m]
        W[g, :n], used[g, :n] = precision[k, m], True
    centre = q_0.sum(1) / used.sum(1)[:, None]
    V_B, _, _ = fit_motion(q_0 - centre[:, None], q_1 - centre[:, None], W, used, prior)
    return translation(centre) @ exp_se3(V_B) @ translation(-centre)


def flow_difference(p_C0Q: NDArray, X: NDArray, Y: NDArray, focal_length: float) -> float:
    """How far apart, in pixels (root mean square), two motions X, Y [4, 4] of C0 take points [N, 3]."""
    apart = (move_points(X, p_C0Q) - move_points(Y, p_C0Q))[:, :2] * (focal_length / p_C0Q[:, 2:])
    return float(np.sqrt(np.mean(np.sum(apart**2, axis=1))))


def merge_equal_motions(
    frames: BodyFrames,
    group: NDArray[np.intp],
    motions: NDArray,
    focal_length: float,
    parameters: MotionParameters,
) -> NDArray[np.intp]:
    """The groups, joined where their motions cannot be told apart, dropped where they stand still.

    `group` [K] numbers the motions [G, 4, 4], largest first, so a group joins the largest one that moves like
    it. The focal length, pixels, tells how far motions are apart in the image.
    """
    p = frames.p_C0Q0[:, 0]
    new_of = {-1: -1}
    leaders: list[int] = []
    for g, X in enumerate(motions):
        mine = p[group == g]
        if flow_difference(mine, X, np.eye(4), focal_length) < parameters.still_flow:
            new_of[g] = -1
            continue
        for number, leader in enumerate(leaders):
            both = p[(group == g) | (group == leader)]
            if flow_difference(both, X, motions[leader], focal_length) < parameters.merge_flow:
                new_of[g] = number
                break
        else:
            new_of[g] = len(leaders)
            leaders.append(g)
    return np.array([new_of[int(g)] for g in group], dtype=np.intp)
