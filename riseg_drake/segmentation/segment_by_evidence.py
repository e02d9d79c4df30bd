"""Alg. 2, line 7, by one model of evidence.

Frames are compared with a keyframe, the picture of the last rest, or with what it looked like from nearer by
before anything moved. While something moves, the motions of lines 3 to 6 are chained to what each body has done
since then, and carry the mask along. At the next rest both pictures are sharp, have depth, and span all that
happened: that pair decides, its evidence is kept, and its second frame becomes the keyframe.

Frames in motion are many, and decide nothing: they come in fewer pixels, and are compared with the keyframe
in as few. A rest is looked at in all of them.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.reduction import enlarged
from riseg_drake.geometry.rgbd import FramePair
from riseg_drake.geometry.se3 import inverse, seen_from
from riseg_drake.segmentation.above_table import AboveTable
from riseg_drake.segmentation.belief import Belief
from riseg_drake.segmentation.bfif import BFIFParameters
from riseg_drake.segmentation.bodies import (
    Bodies,
    bodies_of,
    carry_bodies,
    confirmed,
    rebased,
    standing,
    unseen_kept,
)
from riseg_drake.segmentation.candidates import candidate_motions
from riseg_drake.segmentation.comparison import Comparison, renewed_view_error
from riseg_drake.segmentation.keyframe import Keyframe, in_fewer_pixels, seen_again
from riseg_drake.segmentation.look import (
    EvidenceParameters,
    Look,
    agreeing,
    compared_at_rest,
    compared_in_motion,
)
from riseg_drake.segmentation.memory import Memory, draw_memory, moved_memory, remember
from riseg_drake.segmentation.missing_motion import Missed, missing_motion
from riseg_drake.segmentation.motion_search import SearchProblem, search_motions
from riseg_drake.segmentation.motions import BFIFGroups
from riseg_drake.segmentation.next_keyframe import first_belief, next_belief
from riseg_drake.segmentation.observation import Observation, motion_price, observe
from riseg_drake.segmentation.occasions import (
    has_gone_far,
    is_worth_another_view,
    leaves_keyframe,
    share_in_view,
)
from riseg_drake.segmentation.partition import as_tested, margins
from riseg_drake.segmentation.propagation import UNKNOWN
from riseg_drake.segmentation.rest import is_still
from riseg_drake.segmentation.segmentation import Segmentation
from riseg_drake.segmentation.told_apart import identity_costs


def segment_by_evidence(
    before: Segmentation,
    pair: FramePair,
    groups: BFIFGroups,
    above_1: AboveTable,
    see_whole: Callable[[], AboveTable],
    parameters: EvidenceParameters,
    bfif: BFIFParameters,
) -> Segmentation:
    """L_t from G_t and L_t-1.

    Args:
        before: L_t-1.
        pair: the frames of t-1 and t.
        groups: G_t.
        above_1: objMask at t.
        see_whole: gives objMask at t of the whole frame, which rests alone ask for.
        parameters: see there.
        bfif: what the groups were made with: noise of the measurements, and when two motions are one.
    """
    look = agreeing(Look(pair, above_1, see_whole, parameters, bfif), before.poses)
    pair, frame, above_1 = look.pair, look.frame, look.above
    if before.belief is None:
        return _begin(before, look)
    now = _with_rest(before, look)
    now = replace(now, view_error=renewed_view_error(now.view_error, pair))
    belief, bodies = now.belief, _bodies_before(now)
    assert belief is not None
    # The camera N of the keyframe, or of what looked more as it does now: motions are told as it sees them.
    compared = compared_in_motion(now, look)
    X_NK = inverse(compared.keyframe.frame.X_WC) @ belief.keyframe.frame.X_WC
    candidates_N = candidate_motions(
        compared,
        pair.reference,
        groups,
        before.bodies.get(pair.reference.sequence, standing(belief)).seen_from(X_NK),
        bodies.seen_from(X_NK),
        bfif.motions.merge_flow,
        parameters.search.alignment,
    )
    seen: Observation | None = None
    deciding = (
        now.still_since is not None
        and not now.decided
        and (frame.time - now.still_since >= parameters.rest.time)
        and share_in_view(belief, bodies, frame) > parameters.in_view
    )
    if not deciding and now.still_since is None and frame.time - now.searched >= parameters.search_every:
        slight_N = replace(now.missed, slight_K=seen_from(X_NK, now.missed.slight_K))
        missing_N, missed_N = missing_motion(_problem(belief, compared, look), candidates_N, slight_N)
        missed = replace(missed_N, slight_K=seen_from(inverse(X_NK), missed_N.slight_K))
        now = replace(now, searched=frame.time, missed=missed)
        candidates_N = np.concatenate([candidates_N, missing_N])
    if len(candidates_N) and not deciding:
        seen, bodies = _explained(belief, compared, candidates_N, bodies, parameters, now.said)
        now = replace(now, said=seen.evidence)
        bodies = unseen_kept(bodies, _bodies_before(now), belief.keyframe, frame, parameters.area_seen)
        deciding = has_gone_far(now, look, seen, bodies)
    # What the next keyframe cannot be compared with any more is looked for now.
    leaves = bool(above_1.mask.any()) and leaves_keyframe(now, bodies, look)
    deciding |= leaves
    if deciding:
        compared = compared_at_rest(now, look)
        candidates_K = seen_from(inverse(X_NK), candidates_N)
        candidates_K = search_motions(_problem(belief, compared, look), candidates_K)
        if len(candidates_K):
            seen, bodies = _explained(belief, compared, candidates_K, bodies, parameters)
        else:
            bodies = standing(belief)
    if before.seen is not None and is_worth_another_view(compared, before.seen, bodies, parameters):
        near = seen_again(now.views[0], frame, above_1, bfif.noise, parameters.belief.keyframe)
        now = replace(now, views=(now.views[0], near))
    return _carried(now, look, seen, bodies, deciding=deciding, leaves=leaves)


def _begin(before: Segmentation, look: Look) -> Segmentation:
    """The first keyframe, once something stands on the table."""
    frame, noise, parameters = look.frame.whole, look.bfif.noise, look.parameters
    label, belief = np.zeros(frame.depth.shape, np.uint16), None
    views: tuple[Keyframe, ...] = ()
    if look.above.mask.any() and look.whole_above.mask.any():
        label[look.whole_above.mask] = UNKNOWN
        belief = first_belief(frame, look.whole_above, noise, parameters.belief)
        views = _views(belief, look)
    return replace(
        before,
        sequence=frame.sequence,
        label=label,
        belief=belief,
        views=views,
        poses={frame.sequence: frame.X_WC},
        seen=look.frame,
        settled=parameters.settled,
    )


def _views(belief: Belief, look: Look) -> tuple[Keyframe, ...]:
    """A new keyframe as frames in motion are compared with it."""
    noise, parameters = look.bfif.noise, look.parameters.belief.keyframe
    return (in_fewer_pixels(belief.keyframe, look.frame, look.above, noise, parameters),)


def _with_rest(before: Segmentation, look: Look) -> Segmentation:
    """Whether anything moves, from the last frame to this one."""
    assert before.seen is not None
    if not is_still(before.seen, look.frame, look.above, look.bfif.noise, look.parameters.rest):
        return replace(before, still_since=None, decided=False)
    return replace(before, still_since=look.frame.time) if before.still_since is None else before


def _bodies_before(now: Segmentation) -> Bodies:
    assert now.belief is not None
    return now.bodies[max(now.bodies)] if now.bodies else standing(now.belief)


def _explained(
    belief: Belief,
    compared: Comparison,
    candidates_N: NDArray[np.float64],
    before: Bodies,
    parameters: EvidenceParameters,
    said: NDArray[np.float64] | None = None,
) -> tuple[Observation, Bodies]:
    """What a frame says, given some motions [C, 4, 4] as the camera that it is compared with sees them, and the
    bodies by it; of one in motion, with what those before it have `said` of the borders [M]."""
    seen = observe(compared, belief.bond, belief.divisions, belief.shown, candidates_N, parameters.observation)
    if said is not None:
        seen = replace(seen, evidence=parameters.fresh * seen.evidence + (1 - parameters.fresh) * said)
    X_KN = inverse(belief.keyframe.frame.X_WC) @ compared.keyframe.frame.X_WC
    seen = replace(seen, motions_K=seen_from(X_KN, seen.motions_K))
    return bodies_of(belief, seen, before, parameters.belief, parameters.observation)


def _problem(belief: Belief, compared: Comparison, look: Look) -> SearchProblem:
    parameters = look.parameters
    return SearchProblem(
        compared,
        look.above if compared.frame is look.frame else look.whole_above,
        belief.divisions,
        motion_price(compared, parameters.observation),
        parameters.search,
        parameters.observation.likelihood,
        parameters.belief.partition.area_min,
    )


def _carried(
    now: Segmentation,
    look: Look,
    seen: Observation | None,
    bodies: Bodies,
    *,
    deciding: bool,
    leaves: bool,
) -> Segmentation:
    """The mask in the view of t, and a new keyframe where it is time for one."""
    belief, pair, parameters = now.belief, look.pair, look.parameters
    assert belief is not None
    X_WK = belief.keyframe.frame.X_WC
    moves = {
        int(a): bodies.motions_K[bodies.motion[bodies.body == a][0]]
        for a in np.unique(bodies.body[(bodies.body > 0) & (bodies.motion > 0)])
    }
    if deciding or now.still_since is not None:
        frame, above, drawn = look.frame.whole, look.whole_above, belief
    else:
        frame, above, drawn = look.frame, look.above, replace(belief, keyframe=now.views[0])
    remembered = draw_memory(moved_memory(now.memory, moves, X_WK), frame)
    label = carry_bodies(drawn, bodies, frame, above, remembered)
    # The first frame after the keyframe has none before it that could have found the same.
    if not deciding and now.sequence > belief.keyframe.frame.sequence:
        least = parameters.area_seen * above.pixels_per_metre(frame.intrinsics) ** 2
        label = confirmed(label, bodies, _bodies_before(now), belief.next_id, least)
    kept = {s: b for s, b in now.bodies.items() if s >= pair.reference.sequence}
    poses = {s: X for s, X in now.poses.items() if s >= pair.reference.sequence}
    now = replace(
        now,
        sequence=frame.sequence,
        label=np.where(frame.whole.robot, np.uint16(0), enlarged(label, frame)),
        seen=look.frame,
        bodies={**kept, frame.sequence: bodies},
        poses={**poses, frame.sequence: frame.X_WC},
    )
    sure = now.margins
    if deciding and seen is not None:
        bond = belief.with_evidence(seen, parameters.belief).bond
        known = identity_costs(bodies.told, bodies.body, belief.keyframe.area)
        sure = margins(belief.keyframe, bond, bodies.body, parameters.belief.partition, known)
        sure = as_tested(sure, now.margins, moves)
    # What was decided in motion is looked at once more when it rests.
    decided = now.decided or (deciding and now.still_since is not None)
    moved = deciding and len(bodies.motions_K) > 1
    if not above.mask.any() or not (moved or leaves):
        return replace(now, margins=sure, decided=decided)
    memory: Memory = {}
    if parameters.memory:
        label_K = belief.keyframe.image_of(bodies.body.astype(np.uint16))
        memory = remember(now.memory, FramePair(belief.keyframe.frame, frame), label_K, moves)
    following = next_belief(belief, seen, bodies, frame, above, remembered, look.bfif.noise, parameters.belief)
    # The pair's reference, from which the next groups tell, may be older than the new keyframe.
    seen_so_far = {pair.reference.sequence: standing(belief), **now.bodies}
    since = {s: rebased(b, bodies, belief.keyframe, following) for s, b in seen_so_far.items()}
    return replace(
        now,
        margins=sure,
        belief=following,
        views=_views(following, look),
        said=None,
        missed=Missed(),
        bodies=since,
        memory=memory,
        decided=decided,
    )
