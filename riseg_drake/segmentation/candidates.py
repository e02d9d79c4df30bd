"""Motions since the keyframe that a frame may show: the bodies' own, gone on, and those of the groups."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.geometry.rgbd import Frame
from riseg_drake.geometry.se3 import inverse, move_points
from riseg_drake.segmentation.alignment import AlignmentParameters, rigid_fit
from riseg_drake.segmentation.bodies import Bodies
from riseg_drake.segmentation.comparison import Comparison
from riseg_drake.segmentation.keyframe import Keyframe
from riseg_drake.segmentation.motions import BFIFGroups, flow_difference
from riseg_drake.segmentation.propagation import pixels_of

_MOST = 12
"""Candidates; more do not move at once."""
_EDGES_MIN, _EDGES = 60, 400
"""Pixels that a body needs to be followed, and so many, about, that are asked."""


def candidate_motions(
    compared: Comparison,
    reference: Frame,
    groups: BFIFGroups,
    at_reference: Bodies,
    before: Bodies,
    same_flow: float,
    following: AlignmentParameters,
) -> NDArray[np.float64]:
    """Motions [C, 4, 4] since the keyframe, seen from its camera, that differ by more than `same_flow` pixels.

    Args:
        compared: the keyframe, since when, and the frame of t.
        reference: the frame t-1 of the pair in which the groups were found.
        groups: G_t.
        at_reference: how the bodies had moved by then.
        before: how the bodies had moved in the frame before t.
        same_flow: pixels (root mean square).
        following: how bodies that have moved are followed.
    """
    keyframe = compared.keyframe
    X_C0K = inverse(reference.X_WC) @ keyframe.frame.X_WC
    proposed = []
    for g, motion_C0 in enumerate(groups.motion_C0):
        onwards = inverse(X_C0K) @ motion_C0 @ X_C0K
        seeds = move_points(inverse(X_C0K), groups.p_C0Q[groups.group == g])
        proposed.append(onwards @ _motion_of_seeds(keyframe, at_reference, seeds, reference.intrinsics))
    proposed = _followed(compared, before, proposed, following) + proposed
    p_KQ = keyframe.edges.p_C0Q[::20]
    distinct = [np.eye(4)]
    for X in proposed:
        if len(p_KQ) == 0 or all(
            flow_difference(p_KQ, X, Y, keyframe.frame.intrinsics.fx) > same_flow for Y in distinct
        ):
            distinct.append(X)
    return np.array(distinct[1 : 1 + _MOST]).reshape(-1, 4, 4)


def _followed(
    compared: Comparison, before: Bodies, proposed: Sequence[NDArray], parameters: AlignmentParameters
) -> list[NDArray]:
    """The motions [4, 4] of what has moved, each found anew by all that had it, from where it was or from what
    is `proposed`: hands move things fast, and turn them."""
    if len(before.motions_K) == 1:
        return []
    edges = compared.keyframe.edges
    owner = before.motion[edges.piece]
    fit = rigid_fit(compared.pair, compared.depth_noise)
    followed = []
    for k, motion in enumerate(before.motions_K[1:], 1):
        own = np.flatnonzero(owner == k)
        if len(own) >= _EDGES_MIN:
            mine = edges.subset(own[:: -(-len(own) // _EDGES)])
            start = min((motion, *proposed), key=lambda X: float(fit.cost(mine, X).mean()))
            motion = fit.align(mine, start, parameters.rounds, parameters)
        followed.append(motion)
    return followed


def _motion_of_seeds(
    keyframe: Keyframe, bodies: Bodies, p_KQ: NDArray[np.float64], intrinsics: Intrinsics
) -> NDArray[np.float64]:
    """By which motion [4, 4] since the keyframe most of some points p_KQ [N, 3] came to where they are."""
    if len(bodies.motions_K) == 1:
        return bodies.motions_K[0]
    motion = keyframe.image_of(bodies.motion, -1)
    votes = []
    for k, X in enumerate(bodies.motions_K):
        vu, inside = pixels_of(move_points(inverse(X), p_KQ), intrinsics)
        v, u = vu.T
        votes.append(np.count_nonzero(motion[v[inside], u[inside]] == k))
    return bodies.motions_K[int(np.argmax(votes))]
