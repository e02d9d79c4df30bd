"""The bodies of a keyframe: what one frame says of them, and where they are in its view."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.camera import rays
from riseg_drake.geometry.rgbd import Frame, FramePair, Immutable
from riseg_drake.geometry.se3 import inverse, move_points, seen_from
from riseg_drake.segmentation.above_table import AboveTable
from riseg_drake.segmentation.belief import Belief, BeliefParameters
from riseg_drake.segmentation.keyframe import Keyframe
from riseg_drake.segmentation.observation import Observation, ObservationParameters, evidence_of_parts
from riseg_drake.segmentation.partition import (
    apart,
    motions_of_parts,
    partition,
    shared_area,
    with_ids,
)
from riseg_drake.segmentation.propagation import UNKNOWN, carry_labels, draw_labels, pixels_of
from riseg_drake.segmentation.told_apart import identity_costs, moving_apart, with_lost

_BLIND = 0.004
"""Share of a picture that has no depth, and is not the robot, from which that matters."""


@dataclass(frozen=True)
class Bodies(Immutable):
    """The bodies of a keyframe, and how they have moved since."""

    body: NDArray[np.intp]
    """[N], ids; 0 where nothing has moved yet."""
    motion: NDArray[np.intp]
    """[N], index into `motions_K`; the same for all of a body."""
    motions_K: NDArray[np.float64]
    """[G, 4, 4], seen from the keyframe's camera; the first is standing still."""
    next_id: int
    told: NDArray[np.float64]
    """[I, I], nats that speak against two ids' being one body (`told_apart`)."""
    latest: NDArray[np.intp]
    """[N], the id that each has had last for itself since the keyframe, 0 = none: what seems to stand still for
    a moment, as its motion was not found, or to be one with something known, gets it back."""

    def seen_from(self, X_NK: NDArray[np.float64]) -> "Bodies":
        """The same with motions as a camera N sees them, in which the keyframe's has the pose X_NK [4, 4]."""
        return replace(self, motions_K=seen_from(X_NK, self.motions_K))


def standing(belief: Belief) -> Bodies:
    """The bodies where nothing has moved since the keyframe."""
    still = np.zeros(belief.keyframe.count, np.intp)
    return Bodies(belief.body, still, np.eye(4)[None], belief.next_id, belief.told, belief.body)


def bodies_of(
    belief: Belief,
    seen: Observation,
    before: Bodies,
    parameters: BeliefParameters,
    observation: ObservationParameters,
) -> tuple[Observation, Bodies]:
    """The bodies, with what one frame says, and that with what the bodies' motions add to its evidence.

    Ids are those of the belief, and for what it did not know those of the frames before. A body that no one
    motion explains falls apart for it, and what falls off it is no more what that was known to be.
    """
    keyframe = belief.keyframe
    motion = motions_of_parts(belief.body, seen.nats, parameters.partition)[belief.body]
    told = moving_apart(belief.told, belief.body, motion)
    known = identity_costs(told, belief.body, keyframe.area)

    def parts_by(seen: Observation) -> NDArray[np.intp]:
        bond = belief.with_evidence(seen, parameters).bond
        return partition(keyframe, bond, parameters.partition, known, seen.nats)

    part = parts_by(seen)
    strangers = split_off(part, belief.body, keyframe.area)
    if parameters.strangers and strangers.any():
        seen, known = replace(seen, strangers=strangers), np.where(strangers, 0.0, known)
        part = parts_by(seen)
    if keyframe.across.any():
        # What lies about a gap says little of its motion; all of both pieces together may be sure of it.
        of_parts = evidence_of_parts(seen, keyframe, part, belief.shown, observation)
        seen = replace(seen, evidence=np.where(keyframe.across, of_parts, seen.evidence))
        part = parts_by(seen)
    seen = replace(seen, evidence=seen.evidence + apart(keyframe, part, seen.nats, parameters.partition))
    motion = motions_of_parts(part, seen.nats, parameters.partition)
    found_before = np.bincount(part, keyframe.area * (belief.body > 0), len(motion))
    moved = (motion > 0) | (2 * found_before > np.bincount(part, keyframe.area, len(motion)))
    previous = [belief.body, before.body, before.latest]
    next_id = max(belief.next_id, *(int(ids.max(initial=0)) + 1 for ids in previous))
    body, next_id = with_ids(part, moved, keyframe.area, previous, next_id)
    free = parameters.partition.rigid_min
    told = with_lost(told, belief.body, body, next_id, seen.nats, keyframe.area, free)
    told = told if parameters.told else np.zeros_like(told)
    # What is one with something known for a moment has its own id again when it is not.
    own = (body > 0) & ((body == belief.body) | (body >= belief.next_id) | (before.latest == 0))
    latest = np.where(own, body, before.latest)
    return seen, Bodies(body, motion[part], seen.motions_K, next_id, told, latest)


def unseen_kept(bodies: Bodies, before: Bodies, keyframe: Keyframe, frame: Frame, least: float) -> Bodies:
    """With what has moved `before` where it was then, if a frame does not show where that is.

    What is out of the picture, or behind the robot, is explained by any motion that takes it there, too. A body
    is shown where at least `least` m^2 of it are.
    """
    owner, at, shown = points_in_view(keyframe, before, frame)
    shown[shown] = ~frame.robot[tuple(at[shown].T)]
    share = np.bincount(before.body[owner[shown]], minlength=before.next_id) / max(1, len(owner))
    seen = share * keyframe.area.sum() / keyframe.pixels_per_metre**2
    unseen = (before.motion > 0) & (seen[before.body] < least)
    if not unseen.any():
        return bodies
    motions, of_motion = np.unique(before.motion[unseen], return_inverse=True)
    next_id = max(bodies.next_id, before.next_id)
    motion = bodies.motion.copy()
    motion[unseen] = len(bodies.motions_K) + of_motion
    return Bodies(
        body=np.where(unseen, before.body, bodies.body),
        motion=motion,
        motions_K=np.concatenate([bodies.motions_K, before.motions_K[motions]]),
        next_id=next_id,
        told=np.pad(bodies.told, (0, next_id - len(bodies.told))),
        latest=np.where(unseen, before.latest, bodies.latest),
    )


def points_in_view(
    keyframe: Keyframe, bodies: Bodies, frame: Frame
) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.bool_]]:
    """Where some two thousand points of a keyframe are by now: the superpixel [P] of each, its pixel (v, u)
    [P, 2] in a frame, and whether that is in the picture [P]."""
    every = slice(None, None, 1 + len(keyframe.owner) // 2000)
    owner, (v, u) = keyframe.owner[every], keyframe.points.pixel[:, every]
    p_KQ = rays(keyframe.frame.intrinsics)[v, u].astype(float) * keyframe.points.depth[every, None]
    X_CK, motion = inverse(frame.X_WC) @ keyframe.frame.X_WC, bodies.motion[owner]
    at, inside = np.zeros((len(owner), 2), np.intp), np.zeros(len(owner), bool)
    for k in np.unique(motion):
        which = motion == k
        p_CQ = move_points(X_CK @ bodies.motions_K[k], p_KQ[which])
        at[which], inside[which] = pixels_of(p_CQ, frame.intrinsics)
    return owner, at, inside


def split_off(part: NDArray[np.intp], body: NDArray[np.intp], area: NDArray[np.intp]) -> NDArray[np.bool_]:
    """[N], what is not in the largest of the parts [N] into which its body [N] falls."""
    shared = shared_area(body, part, area, (int(body.max(initial=0)) + 1, int(part.max(initial=-1)) + 1))
    return np.asarray((body > 0) & (shared.argmax(1)[body] != part))


def carry_bodies(
    belief: Belief,
    bodies: Bodies,
    frame: Frame,
    above: AboveTable,
    remembered: NDArray[np.uint16],
) -> NDArray[np.uint16]:
    """[H, W], ids in the view of a frame, UNKNOWN where something stands that has not moved, 0 elsewhere.

    `remembered` [H, W] has ids where things that the keyframe does not see should be now.
    """
    # One label for each body and motion, then one for each remembered id.
    motions = len(bodies.motions_K)
    code, label = np.unique(bodies.body * motions + bodies.motion, return_inverse=True)
    rigid = np.stack(np.divmod(code, motions))
    hiding = remembered > 0
    hidden, order = np.unique(remembered[hiding], return_inverse=True)
    number = np.zeros_like(remembered)
    number[hiding] = order + 1 + len(code)
    id_of = np.full(65536, UNKNOWN)
    ids = np.concatenate([[0], np.where(rigid[0] > 0, rigid[0], UNKNOWN), hidden])
    id_of[: len(ids)] = ids
    moves = {i + 1: bodies.motions_K[g] for i, g in enumerate(rigid[1]) if g > 0}
    found = id_of.take(carry_superpixels(belief, label + 1, moves, frame, above, number))
    blind = (frame.depth == 0) & ~frame.robot & ~above.mask
    if np.count_nonzero(blind) < _BLIND * frame.depth.size:
        return found
    # Too near for the camera to measure: the depth that the keyframe has, moved, must do.
    image = belief.keyframe.image_of((label + 1).astype(np.uint16))
    drawn, _ = draw_labels(belief.keyframe.frame, frame, image, moves)
    blind = np.flatnonzero(blind & (drawn > 0))
    found.ravel()[blind] = id_of.take(drawn.ravel().take(blind))
    return found


def confirmed(
    label: NDArray[np.uint16], bodies: Bodies, before: Bodies, decided: int, least: float
) -> NDArray[np.uint16]:
    """The mask [H, W] of a frame in motion without what the next frame may not find.

    Ids from `decided` on, that no rest has decided about yet, are UNKNOWN unless a frame `before` has found
    them, too, and at least `least` pixels of them are seen.
    """
    fresh = np.unique(bodies.body[bodies.body >= decided])
    few = [np.count_nonzero(label == a) < least for a in fresh]
    out = fresh[~np.isin(fresh, before.latest) | np.array(few, bool)]
    return np.where(np.isin(label, out), UNKNOWN, label) if len(out) else label


def carry_superpixels(
    belief: Belief,
    label: NDArray[np.intp],
    moves: Mapping[int, NDArray[np.float64]],
    frame: Frame,
    above: AboveTable,
    remembered: NDArray[np.integer],
) -> NDArray[np.uint16]:
    """Labels > 0 of superpixels [N], of which some moved by motions [4, 4], in the view of a frame [H, W]."""
    keyframe = belief.keyframe
    pair, label_0 = FramePair(keyframe.frame, frame), keyframe.image_of(label.astype(np.uint16))
    return carry_labels(pair, label_0, moves, above, remembered.astype(np.uint16))


def rebased(then: Bodies, now: Bodies, old: Keyframe, following: Belief) -> Bodies:
    """How bodies had moved `then`, since the keyframe of `now`, which follows the `old` one: backwards, mostly.

    `then` and `now` are told since the old keyframe.
    """
    X_NO = inverse(following.keyframe.frame.X_WC) @ old.frame.X_WC
    motions, motion = [np.eye(4)], np.zeros(following.keyframe.count, np.intp)
    for a in np.unique(following.body[following.body > 0]):
        mine = now.body == a
        if not mine.any():
            continue
        k = np.bincount(then.motion[mine], old.area[mine]).argmax()
        motion[following.body == a] = len(motions)
        since = then.motions_K[k] @ inverse(now.motions_K[now.motion[mine][0]])
        motions.append(seen_from(X_NO, since))
    return Bodies(following.body, motion, np.array(motions), following.next_id, following.told, following.body)
