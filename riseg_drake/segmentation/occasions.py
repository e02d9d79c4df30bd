"""When a frame decides, and when the keyframe is to be seen again, or to be followed by another."""

import numpy as np

from riseg_drake.geometry.camera import rays
from riseg_drake.geometry.rgbd import Frame
from riseg_drake.geometry.se3 import inverse, move_points
from riseg_drake.segmentation.belief import Belief
from riseg_drake.segmentation.bodies import Bodies, points_in_view
from riseg_drake.segmentation.comparison import Comparison
from riseg_drake.segmentation.frame_pairs import camera_span
from riseg_drake.segmentation.look import EvidenceParameters, Look
from riseg_drake.segmentation.observation import Observation
from riseg_drake.segmentation.propagation import pixels_of
from riseg_drake.segmentation.segmentation import Segmentation

_AS_MUCH = 0.5
"""Share of the area that a keyframe shows, which its successor must show at least."""


def is_worth_another_view(
    compared: Comparison, before: Frame, bodies: Bodies, parameters: EvidenceParameters
) -> bool:
    """Whether nothing has moved yet, and the camera, which hardly moves since the frame `before`, looks from
    elsewhere than the keyframe did."""
    creeps = camera_span(before, compared.frame.whole) < parameters.creep
    return creeps and compared.another_view == 1 and not (bodies.motion > 0).any()


def has_gone_far(now: Segmentation, look: Look, seen: Observation, bodies: Bodies) -> bool:
    """Whether something as large as a body has moved by many pixels since the keyframe, and moves on, before a
    camera that stands as it stood then: one that moves with the arm will see better at the next rest."""
    assert now.belief is not None
    assert now.seen is not None
    keyframe, whole, parameters = now.belief.keyframe, look.frame.whole, look.parameters
    if now.still_since is not None:
        return False
    if any(camera_span(f, whole) > parameters.rest.camera_span for f in (keyframe.frame, now.seen)):
        return False
    far = (bodies.motion > 0) & (seen.span * look.frame.reduction > parameters.span)
    area_min = parameters.belief.partition.area_min
    return bool(keyframe.area[far].sum() > area_min * keyframe.pixels_per_metre**2)


def share_in_view(belief: Belief, bodies: Bodies, frame: Frame) -> float:
    """How much of what the keyframe shows this frame shows with depth, where it should be by now.

    In the measure of the keyframe's own holes, which lie elsewhere in each frame: dark things are seen half.
    """
    keyframe = belief.keyframe
    owner, at, inside = points_in_view(keyframe, bodies, frame)
    shown = np.count_nonzero(frame.unhidden_depth[tuple(at[inside].T)] > 0)
    measured = np.mean(keyframe.frame.depth[keyframe.above.mask] > 0)
    return shown / max(1.0, len(owner) * float(measured))


def leaves_keyframe(now: Segmentation, bodies: Bodies, look: Look) -> bool:
    """Whether too much of what stands there was not to be seen in the keyframe, which shows hardly more than
    this frame: a camera that is too near to measure most of it will be back. What stands, in motion, where the
    keyframe saw nothing has moved there: the next rest says how."""
    keyframe, frame, every = now.views[0], look.frame, (slice(2, None, 6), slice(2, None, 6))
    standing_there = look.above.mask[every] & (frame.depth[every] > 0)
    in_keyframe = keyframe.frame.depth[every][keyframe.above.mask[every]]
    if (frame.depth[every][standing_there] ** 2).sum() <= _AS_MUCH * (in_keyframe**2).sum():
        return False
    p_C1Q = (rays(frame.intrinsics)[every] * frame.depth[every][..., None])[standing_there].astype(float)
    p_KQ = move_points(inverse(keyframe.frame.X_WC) @ frame.X_WC, p_C1Q)
    shown, covered = keyframe.covered, np.zeros(len(p_KQ), bool)
    if now.still_since is None:
        shown = shown | (keyframe.frame.depth > 0)
    for X in bodies.motions_K:
        (v, u), inside = (a.T for a in pixels_of(move_points(inverse(X), p_KQ), frame.intrinsics))
        covered[inside] |= shown[v[inside], u[inside]]
    return bool(np.mean(~covered) > look.parameters.uncovered)
