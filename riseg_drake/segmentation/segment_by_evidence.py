"""Alg. 2, line 7, by one model of evidence.

Frames are compared with a keyframe, the picture of the last rest, or with what it looked like from nearer by
before anything moved. While something moves, the motions of lines 3 to 6 are chained to what each body has done
since then, and carry the mask along. At the next rest both pictures are sharp, have depth, and span all that
happened: that pair decides, its evidence is kept, and its second frame becomes the keyframe.
"""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.camera import rays
from riseg_drake.geometry.rgbd import Frame, FramePair
from riseg_drake.geometry.se3 import inverse, move_points, seen_from
from riseg_drake.segmentation.above_table import AboveTable
from riseg_drake.segmentation.belief import Belief, BeliefParameters
from riseg_drake.segmentation.bfif import BFIFParameters
from riseg_drake.segmentation.bodies import Bodies, bodies_of, carry_bodies, rebased, standing
from riseg_drake.segmentation.candidates import candidate_motions
from riseg_drake.segmentation.comparison import Comparison, renewed_view_error
from riseg_drake.segmentation.frame_pairs import camera_span
from riseg_drake.segmentation.keyframe import Keyframe, seen_again
from riseg_drake.segmentation.memory import Memory, draw_memory, moved_memory, remember
from riseg_drake.segmentation.motion_search import (
    MotionSearchParameters,
    SearchProblem,
    missing_motion,
    search_motions,
)
from riseg_drake.segmentation.motions import BFIFGroups
from riseg_drake.segmentation.next_keyframe import first_belief, next_belief
from riseg_drake.segmentation.observation import (
    Observation,
    ObservationParameters,
    motion_price,
    observe,
)
from riseg_drake.segmentation.partition import margins
from riseg_drake.segmentation.propagation import UNKNOWN, pixels_of
from riseg_drake.segmentation.rest import RestParameters, is_still
from riseg_drake.segmentation.segmentation import Segmentation

_AS_MUCH = 0.5
"""Share of the area that a keyframe shows, which its successor must show at least."""


@dataclass
class EvidenceParameters:
    """How line 7 is decided by evidence (not in the paper)."""

    rest: RestParameters = field(default_factory=RestParameters)
    observation: ObservationParameters = field(default_factory=ObservationParameters)
    search: MotionSearchParameters = field(default_factory=MotionSearchParameters)
    belief: BeliefParameters = field(default_factory=BeliefParameters)
    settled: float = 1.5
    """Nats a border by which an object's outline must be better than the next best, not to be in doubt."""
    in_view: float = 0.9
    """Share of what the keyframe shows that a picture must show, too, to decide: a rest of the arm just after a
    push sees little."""
    span: float = 15.0
    """Pixels that something has moved since the keyframe, from which what is seen in motion decides, too: hands
    do not rest."""
    creep: float = 4.0
    """Pixels from one frame to the next up to which the camera has nearly come to rest, and sees sharply."""
    uncovered: float = 0.3
    """Share of what stands there that the keyframe does not show, from which the view needs another."""
    search_every: float = 0.4
    """s between two frames in motion in which a motion is looked for that no group proposes: what is blank."""
    memory: bool = True
    """Remember objects that leave the view (not in the paper)."""


@dataclass(frozen=True)
class _Look:
    """What Alg. 2 sees at t, and by what it judges that."""

    pair: FramePair
    above: AboveTable
    """objMask at t."""
    parameters: EvidenceParameters
    bfif: BFIFParameters

    @property
    def frame(self) -> Frame:
        """I_t."""
        return self.pair.current


def segment_by_evidence(
    before: Segmentation,
    pair: FramePair,
    groups: BFIFGroups,
    above_1: AboveTable,
    parameters: EvidenceParameters,
    bfif: BFIFParameters,
) -> Segmentation:
    """L_t from G_t and L_t-1.

    Args:
        before: L_t-1.
        pair: the frames of t-1 and t.
        groups: G_t.
        above_1: objMask at t.
        parameters: see there.
        bfif: what the groups were made with: noise of the measurements, and when two motions are one.
    """
    look, frame = _Look(pair, above_1, parameters, bfif), pair.current
    if before.belief is None:
        return _begin(before, look)
    now = _with_rest(before, look)
    now = replace(now, view_error=renewed_view_error(now.view_error, pair))
    belief, bodies = now.belief, _bodies_before(now)
    assert belief is not None
    # The camera N of the keyframe, or of what looked more as it does now: motions are told as it sees them.
    compared = _compared(now, _nearest_view(now, frame), look)
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
        and _share_in_view(belief, bodies, frame) > parameters.in_view
    )
    if not deciding and now.still_since is None and frame.time - now.searched >= parameters.search_every:
        now = replace(now, searched=frame.time)
        missing_N = missing_motion(_problem(belief, compared, look), candidates_N)
        candidates_N = np.concatenate([candidates_N, missing_N])
    if len(candidates_N) and not deciding:
        seen, bodies = _explained(belief, compared, candidates_N, bodies, parameters)
        deciding = _has_gone_far(now, look, seen, bodies)
    # What the next keyframe cannot be compared with any more is looked for now.
    leaves = bool(above_1.mask.any()) and _leaves_keyframe(now, bodies, look)
    deciding |= leaves
    if deciding:
        compared = _compared(now, belief.keyframe, look)
        candidates_K = seen_from(inverse(X_NK), candidates_N)
        candidates_K = search_motions(_problem(belief, compared, look), candidates_K)
        if len(candidates_K):
            seen, bodies = _explained(belief, compared, candidates_K, bodies, parameters)
        else:
            bodies = standing(belief)
    if before.frame is not None and _is_worth_another_view(compared, before.frame, bodies, parameters):
        near = seen_again(belief.keyframe, frame, above_1, bfif.noise, parameters.belief.keyframe)
        now = replace(now, near=near)
    return _carried(now, look, seen, bodies, deciding=deciding, leaves=leaves)


def _begin(before: Segmentation, look: _Look) -> Segmentation:
    """The first keyframe, once something stands on the table."""
    frame, standing_there = look.frame, look.above.mask
    belief = None
    if standing_there.any():
        belief = first_belief(frame, look.above, look.bfif.noise, look.parameters.belief)
    return replace(
        before,
        sequence=frame.sequence,
        label=np.where(standing_there, UNKNOWN, np.uint16(0)),
        belief=belief,
        frame=frame,
        settled=look.parameters.settled,
    )


def _with_rest(before: Segmentation, look: _Look) -> Segmentation:
    """Whether anything moves, from the last frame to this one."""
    assert before.frame is not None
    if not is_still(before.frame, look.frame, look.above, look.bfif.noise, look.parameters.rest):
        return replace(before, still_since=None, decided=False)
    return replace(before, still_since=look.frame.time) if before.still_since is None else before


def _bodies_before(now: Segmentation) -> Bodies:
    assert now.belief is not None
    return now.bodies[max(now.bodies)] if now.bodies else standing(now.belief)


def _nearest_view(now: Segmentation, frame: Frame) -> Keyframe:
    """The keyframe, by its own frame or as it was seen again, whichever is more like this frame's view."""
    assert now.belief is not None
    views = [now.belief.keyframe] if now.near is None else [now.belief.keyframe, now.near]
    return min(views, key=lambda view: camera_span(view.frame, frame))


def _is_worth_another_view(
    compared: Comparison, before: Frame, bodies: Bodies, parameters: EvidenceParameters
) -> bool:
    """Whether nothing has moved yet, and the camera, which hardly moves since the frame `before`, looks from
    elsewhere than the keyframe did."""
    creeps = camera_span(before, compared.frame) < parameters.creep
    return creeps and compared.another_view == 1 and not (bodies.motion > 0).any()


def _compared(now: Segmentation, keyframe: Keyframe, look: _Look) -> Comparison:
    return Comparison(
        keyframe,
        look.frame,
        depth_noise=max(look.above.depth_noise, keyframe.above.depth_noise),
        view_error=now.view_error.share(look.parameters.observation.likelihood.view_error),
    )


def _explained(
    belief: Belief,
    compared: Comparison,
    candidates_N: NDArray[np.float64],
    before: Bodies,
    parameters: EvidenceParameters,
) -> tuple[Observation, Bodies]:
    """What a frame says, given some motions [C, 4, 4] as the camera that it is compared with sees them, and the
    bodies by it."""
    seen = observe(compared, belief.bond, belief.part, belief.shown, candidates_N, parameters.observation)
    X_KN = inverse(belief.keyframe.frame.X_WC) @ compared.keyframe.frame.X_WC
    seen = replace(seen, motions_K=seen_from(X_KN, seen.motions_K))
    return bodies_of(belief, seen, before, parameters.belief, parameters.observation)


def _problem(belief: Belief, compared: Comparison, look: _Look) -> SearchProblem:
    parameters = look.parameters
    return SearchProblem(
        compared,
        look.above,
        np.vstack([belief.part[None], belief.finer]),
        motion_price(compared, parameters.observation),
        parameters.search,
        parameters.observation.likelihood,
        parameters.belief.partition.area_min,
    )


def _carried(
    now: Segmentation,
    look: _Look,
    seen: Observation | None,
    bodies: Bodies,
    *,
    deciding: bool,
    leaves: bool,
) -> Segmentation:
    """The mask in the view of t, and a new keyframe where it is time for one."""
    belief, pair, frame, above, parameters = now.belief, look.pair, look.frame, look.above, look.parameters
    assert belief is not None
    X_WK = belief.keyframe.frame.X_WC
    moves = {
        int(a): bodies.motions_K[bodies.motion[bodies.body == a][0]]
        for a in np.unique(bodies.body[(bodies.body > 0) & (bodies.motion > 0)])
    }
    remembered = draw_memory(moved_memory(now.memory, moves, X_WK), frame)
    # Frames in motion are many, and decide nothing: there every second row and column must do.
    every = 2 if now.still_since is None else 1
    label = carry_bodies(belief, bodies, frame, above, remembered, every)
    kept = {s: b for s, b in now.bodies.items() if s >= pair.reference.sequence}
    now = replace(
        now, sequence=frame.sequence, label=label, frame=frame, bodies={**kept, frame.sequence: bodies}
    )
    margin = now.margin
    if deciding and seen is not None:
        bond = belief.with_evidence(seen.evidence, parameters.belief).bond
        margin = margins(belief.keyframe, bond, bodies.body, parameters.belief.partition)
    # What was decided in motion is looked at once more when it rests.
    decided = now.decided or (deciding and now.still_since is not None)
    moved = deciding and len(bodies.motions_K) > 1
    if not above.mask.any() or not (moved or leaves):
        return replace(now, margin=margin, decided=decided)
    memory: Memory = {}
    if parameters.memory:
        label_K = belief.keyframe.image_of(bodies.body.astype(np.uint16))
        memory = remember(now.memory, FramePair(belief.keyframe.frame, frame), label_K, moves)
    following = next_belief(belief, seen, bodies, frame, above, remembered, look.bfif.noise, parameters.belief)
    # The pair's reference, from which the next groups tell, may be older than the new keyframe.
    seen_so_far = {pair.reference.sequence: standing(belief), **now.bodies}
    since = {s: rebased(b, bodies, belief.keyframe, following) for s, b in seen_so_far.items()}
    return replace(
        now, margin=margin, belief=following, near=None, bodies=since, memory=memory, decided=decided
    )


def _has_gone_far(now: Segmentation, look: _Look, seen: Observation, bodies: Bodies) -> bool:
    """Whether something as large as a body has moved by many pixels since the keyframe, and moves on, before a
    camera that stands as it stood then: one that moves with the arm will see better at the next rest."""
    assert now.belief is not None
    assert now.frame is not None
    keyframe, parameters = now.belief.keyframe, look.parameters
    if now.still_since is not None:
        return False
    if any(camera_span(f, look.frame) > parameters.rest.camera_span for f in (keyframe.frame, now.frame)):
        return False
    far = (bodies.motion > 0) & (seen.span > parameters.span)
    area_min = parameters.belief.partition.area_min
    return bool(keyframe.area[far].sum() > area_min * keyframe.pixels_per_metre**2)


def _share_in_view(belief: Belief, bodies: Bodies, frame: Frame) -> float:
    """How much of what the keyframe shows this frame shows with depth, where it should be by now.

    In the measure of the keyframe's own holes, which lie elsewhere in each frame: dark things are seen half.
    """
    keyframe = belief.keyframe
    every = slice(None, None, 1 + len(keyframe.owner) // 2000)
    v, u = keyframe.points.pixel[:, every]
    p_KQ = rays(keyframe.frame.intrinsics)[v, u] * keyframe.points.depth[every, None]
    motion = bodies.motion[keyframe.owner[every]]
    shown = 0
    for k, X in enumerate(bodies.motions_K):
        p_CQ = move_points(inverse(frame.X_WC) @ keyframe.frame.X_WC @ X, p_KQ[motion == k].astype(float))
        (v, u), inside = (a.T for a in pixels_of(p_CQ, frame.intrinsics))
        shown += int(np.count_nonzero(frame.unhidden_depth[v[inside], u[inside]] > 0))
    measured = np.mean(keyframe.frame.depth[keyframe.above.mask] > 0)
    return shown / max(1.0, len(p_KQ) * float(measured))


def _leaves_keyframe(now: Segmentation, bodies: Bodies, look: _Look) -> bool:
    """Whether too much of what stands there was not to be seen in the keyframe, which shows hardly more than
    this frame: a camera that is too near to measure most of it will be back. What stands, in motion, where the
    keyframe saw nothing has moved there: the next rest says how."""
    assert now.belief is not None
    frame, every = look.frame, (slice(2, None, 6), slice(2, None, 6))
    standing_there = look.above.mask[every] & (frame.depth[every] > 0)
    keyframe = now.belief.keyframe
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
