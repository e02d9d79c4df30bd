"""Motions of what is recognised, however far it went or turned: what falls off a pile, or a hand turns over.

Distinct places of both pictures are described (SIFT) and matched; three matches near each other give a motion,
and what agrees with it is one body. Whether a motion is real the likelihood tells, as of any other proposal.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from riseg_drake.geometry.camera import bounding_region, rays
from riseg_drake.geometry.rgbd import Frame
from riseg_drake.geometry.se3 import inverse, move_points
from riseg_drake.segmentation.comparison import Comparison


@dataclass
class RecognitionParameters:
    """What counts as recognised."""

    ratio: float = 0.8
    """Of the distance to the best match and to the next best, at most (Lowe, 2004)."""
    within: float = 0.004
    """m; a match agrees with a motion that takes it so near."""
    matches_min: int = 6
    """That agree; three fit by themselves."""
    most: int = 6
    """Motions."""


_NEIGHBOURS = 12
"""Matches around one, of which two are taken with it."""
_TRIES = 400
"""Triples."""


def recognised_motions(
    compared: Comparison, above: NDArray[np.bool_], parameters: RecognitionParameters
) -> NDArray[np.float64]:
    """Motions [C, 4, 4] in the keyframe's camera, those that most matches agree with first."""
    keyframe, frame = compared.keyframe, compared.frame
    stood = keyframe.image_of(np.ones(keyframe.count, bool))
    (p_KQ, one), (p_C1Q, other) = _described(keyframe.frame, stood), _described(frame, above & ~frame.robot)
    none = np.empty((0, 4, 4))
    if len(one) < parameters.matches_min or len(other) < parameters.matches_min:
        return none
    nearest = cv2.BFMatcher(cv2.NORM_L2).knnMatch(one, other, k=2)
    pairs = [(a.queryIdx, a.trainIdx) for a, b in nearest if a.distance < parameters.ratio * b.distance]
    if len(pairs) < parameters.matches_min:
        return none
    i, j = np.array(pairs).T
    before, after = p_KQ[i], move_points(inverse(compared.X_C1K), p_C1Q[j])
    moved = np.linalg.norm(after - before, axis=1) > parameters.within
    before, after = before[moved], after[moved]
    rng = np.random.default_rng(keyframe.frame.sequence)
    found: list[NDArray[np.float64]] = []
    while len(found) < parameters.most and len(before) >= parameters.matches_min:
        agrees = _largest_agreement(before, after, parameters.within, rng)
        if np.count_nonzero(agrees) < parameters.matches_min:
            break
        found.append(_rigid(before[None, agrees], after[None, agrees])[0])
        before, after = before[~agrees], after[~agrees]
    return np.array(found).reshape(-1, 4, 4)


def _described(frame: Frame, where: NDArray[np.bool_]) -> tuple[NDArray[np.float64], NDArray[np.float32]]:
    """Distinct places: points [F, 3] in the frame's camera, and their descriptions [F, 128]."""
    nothing = np.empty((0, 3)), np.empty((0, 128), np.float32)
    if not where.any():
        return nothing
    region = bounding_region(where)
    gray = cv2.cvtColor(frame.color[region], cv2.COLOR_RGB2GRAY)
    sift = cv2.SIFT_create(contrastThreshold=0.02)
    keypoints, described = sift.detectAndCompute(gray, np.ascontiguousarray(where[region]).view(np.uint8))
    if described is None:
        return nothing
    u, v = np.rint([k.pt for k in keypoints]).astype(np.intp).T
    v, u = v + region[0].start, u + region[1].start
    depth = frame.depth[v, u]
    points = rays(frame.intrinsics)[v, u] * depth[:, None]
    return points[depth > 0], described[depth > 0]


def _largest_agreement(
    before: NDArray[np.float64], after: NDArray[np.float64], within: float, rng: np.random.Generator
) -> NDArray[np.bool_]:
    """Which of some matches, points [M, 3] then and now, the motion agrees with that most agree with."""
    count = min(_NEIGHBOURS + 1, len(before))
    _, near = KDTree(before).query(before, count)
    first = rng.integers(len(before), size=_TRIES)
    others = np.argsort(rng.random((_TRIES, count - 1)), axis=1)[:, :2] + 1
    triple = np.concatenate([first[:, None], np.take_along_axis(near[first], others, axis=1)], axis=1)
    X = _rigid(before[triple], after[triple])
    apart = np.linalg.norm(before @ X[:, :3, :3].transpose(0, 2, 1) + X[:, None, :3, 3] - after, axis=2)
    return np.asarray(apart < within)[(apart < within).sum(1).argmax()]


def _rigid(before: NDArray[np.float64], after: NDArray[np.float64]) -> NDArray[np.float64]:
    """The motions [T, 4, 4] that take points [T, M, 3] nearest to others (Kabsch, 1976)."""
    a, b = before.mean(1), after.mean(1)
    H = np.einsum("tmi,tmj->tij", before - a[:, None], after - b[:, None])
    U, _, Vt = np.linalg.svd(H)
    flip = np.ones((len(H), 3))
    flip[:, 2] = np.sign(np.linalg.det(U) * np.linalg.det(Vt))
    R = np.einsum("tji,tj,tkj->tik", Vt, flip, U)
    X = np.tile(np.eye(4), (len(H), 1, 1))
    X[:, :3, :3], X[:, :3, 3] = R, b - np.einsum("tij,tj->ti", R, a)
    return X
