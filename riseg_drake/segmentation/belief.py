"""What is believed of a keyframe: which borders lie inside one body, what has moved, and the ids."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.rgbd import Frame, FramePair, Immutable
from riseg_drake.geometry.se3 import inverse, seen_from
from riseg_drake.segmentation.above_table import AboveTable
from riseg_drake.segmentation.border_prior import BorderPriorParameters, border_prior
from riseg_drake.segmentation.carried_evidence import KnownBorders, Origin, carried_evidence, were_in_sight
from riseg_drake.segmentation.coincidence import freedoms_shown
from riseg_drake.segmentation.keyframe import Keyframe, KeyframeParameters, make_keyframe
from riseg_drake.segmentation.noise import MeasurementNoise
from riseg_drake.segmentation.observation import Observation, ObservationParameters, evidence_of_parts
from riseg_drake.segmentation.partition import (
    PartitionParameters,
    apart,
    motions_of_parts,
    partition,
    with_ids,
)
from riseg_drake.segmentation.propagation import UNKNOWN, carry_labels, draw_labels

_BLIND = 0.004
"""Share of a picture that has no depth, and is not the robot, from which that matters."""


@dataclass
class BeliefParameters:
    """How evidence is kept."""

    keyframe: KeyframeParameters = field(default_factory=KeyframeParameters)
    prior: BorderPriorParameters = field(default_factory=BorderPriorParameters)
    partition: PartitionParameters = field(default_factory=PartitionParameters)
    inside: float = 2.0
    """Evidence of a border that lies inside what was one superpixel before, nats."""
    once: bool = True
    """What goes along with its neighbour because they touch does so at every push: that both move alike counts
    once, as the most that a push has said for it."""
    most: float = 12.0
    """Evidence of a border adds up to no more than that, nats, so that it can be revised."""
    weaker: list[float] = field(default_factory=lambda: [0.5, 1.0, 1.5])
    """Log-odds by which all bonds are weakened in turn, to see what else may be a body."""


@dataclass(frozen=True)
class Belief(Immutable):
    """Of N superpixels and M borders."""

    keyframe: Keyframe
    prior: NDArray[np.float64]
    """[M], log-odds that both sides of a border are one body, by the still picture."""
    evidence: NDArray[np.float64]
    """[M], what motion has added."""
    alike: NDArray[np.float64]
    """[M], how much of it as both sides have moved alike."""
    body: NDArray[np.intp]
    """[N], ids; 0 where nothing has moved yet."""
    next_id: int
    part: NDArray[np.intp]
    """[N], 0.., which superpixels are one body by all that is known: what has not moved, too."""
    shown: NDArray[np.float64]
    """[M], of how many freedoms of a motion these parts on both sides of a border tell."""
    finer: NDArray[np.intp]
    """[L, N], the same if all bonds were weaker."""

    @property
    def bond(self) -> NDArray[np.float64]:
        """[M], log-odds that both sides of a border are one body."""
        return self.prior + self.evidence

    def with_evidence(self, seen: NDArray[np.float64], parameters: BeliefParameters) -> "Belief":
        """The same with what one frame adds to the evidence of each border [M]."""
        before = self.alike if parameters.once else np.zeros_like(self.alike)
        alike = np.maximum(before, seen)
        evidence = self.evidence + np.minimum(seen, 0.0) + alike - before
        evidence = np.clip(evidence, -parameters.most, parameters.most)
        return replace(self, evidence=evidence, alike=alike)


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

    def seen_from(self, X_NK: NDArray[np.float64]) -> "Bodies":
        """The same with motions as a camera N sees them, in which the keyframe's has the pose X_NK [4, 4]."""
        return replace(self, motions_K=seen_from(X_NK, self.motions_K))


def first_belief(
    frame: Frame, above: AboveTable, noise: MeasurementNoise, parameters: BeliefParameters
) -> Belief:
    """Nothing has moved yet."""
    keyframe = make_keyframe(frame, above, noise, parameters.keyframe)
    prior = border_prior(keyframe, parameters.prior)
    part = partition(keyframe, prior, parameters.partition)
    return Belief(
        keyframe=keyframe,
        prior=prior,
        evidence=np.zeros(len(keyframe.borders)),
        alike=np.zeros(len(keyframe.borders)),
        body=np.zeros(keyframe.count, np.intp),
        next_id=1,
        part=part,
        shown=freedoms_shown(keyframe.edges, frame.gray, part, keyframe.borders),
        finer=_finer(keyframe, prior, parameters),
    )


def standing(belief: Belief) -> Bodies:
    """The bodies where nothing has moved since the keyframe."""
    still = np.zeros(belief.keyframe.count, np.intp)
    return Bodies(belief.body, still, np.eye(4)[None], belief.next_id)


def bodies_of(
    belief: Belief,
    seen: Observation,
    before: Bodies | None,
    parameters: BeliefParameters,
    observation: ObservationParameters,
) -> tuple[Observation, Bodies]:
    """The bodies, with what one frame says, and that with what the bodies' motions add to its evidence.

    Ids are those of the belief, and for what it did not know those of the frame before. A body that no one
    motion explains falls apart for it.
    """
    keyframe = belief.keyframe

    def parts_by(evidence: NDArray[np.float64]) -> NDArray[np.intp]:
        bond = belief.with_evidence(evidence, parameters).bond
        return partition(keyframe, bond, parameters.partition, seen.nats)

    part = parts_by(seen.evidence)
    if keyframe.across.any():
        # What lies about a gap says little of its motion; all of both pieces together may be sure of it.
        of_parts = evidence_of_parts(seen, keyframe, part, belief.shown, observation)
        seen = replace(seen, evidence=np.where(keyframe.across, of_parts, seen.evidence))
        part = parts_by(seen.evidence)
    seen = replace(seen, evidence=seen.evidence + apart(keyframe, part, seen.nats, parameters.partition))
    motion = motions_of_parts(part, seen.nats, parameters.partition)
    found_before = np.bincount(part, keyframe.area * (belief.body > 0), len(motion))
    moved = (motion > 0) | (2 * found_before > np.bincount(part, keyframe.area, len(motion)))
    previous = [belief.body] if before is None else [belief.body, before.body]
    # What was found in motion and is gone leaves no gap in the numbers.
    next_id = max(belief.next_id, 0 if before is None else int(before.body.max(initial=0)) + 1)
    body, next_id = with_ids(part, moved, keyframe.area, previous, next_id)
    return seen, Bodies(body, motion[part], seen.motions_K, next_id)


def carry_bodies(
    belief: Belief, bodies: Bodies, frame: Frame, above: AboveTable, remembered: NDArray[np.uint16]
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
    found = id_of.take(_carry(belief, label + 1, moves, frame, above, number))
    blind = (frame.depth == 0) & ~frame.robot & ~above.mask
    if np.count_nonzero(blind) < _BLIND * frame.depth.size:
        return found
    # Too near for the camera to measure: the depth that the keyframe has, moved, must do.
    image = belief.keyframe.image_of((label + 1).astype(np.uint16))
    drawn, _ = draw_labels(belief.keyframe.frame, frame, image, moves)
    blind = np.flatnonzero(blind & (drawn > 0))
    found.ravel()[blind] = id_of.take(drawn.ravel().take(blind))
    return found


def next_belief(
    belief: Belief,
    seen: Observation | None,
    bodies: Bodies,
    frame: Frame,
    above: AboveTable,
    remembered: NDArray[np.uint16],
    noise: MeasurementNoise,
    parameters: BeliefParameters,
) -> Belief:
    """The belief, with what was seen, carried to a frame that becomes the keyframe.

    `remembered` [H, W] has ids where things that the old keyframe does not see should be now.
    """
    old = belief.keyframe
    moves = {s + 1: bodies.motions_K[g] for s, g in enumerate(bodies.motion) if g > 0}
    carried = _carry(belief, np.arange(old.count) + 1, moves, frame, above, np.zeros_like(remembered))
    carried = np.where(carried == UNKNOWN, 0, carried).astype(np.intp)
    ids = np.append(bodies.body, 0)[carried - 1]
    ids = np.where((carried == 0) & (remembered != UNKNOWN), remembered, ids)
    new = make_keyframe(frame, above, noise, parameters.keyframe, ids)
    source = _most_seen(new, carried) - 1
    known = source >= 0
    if seen is not None:
        belief = belief.with_evidence(seen.evidence, parameters)
    body = np.where(known, bodies.body[source], _most_seen(new, np.where(carried == 0, ids, 0)))
    prior = border_prior(new, parameters.prior)
    in_sight = were_in_sight(old, new, source, bodies.motion[source], bodies.motions_K)
    origin = Origin(source, body, in_sight)
    known_borders = KnownBorders(old, belief.prior, belief.evidence, belief.alike, bodies.body)
    evidence, alike = carried_evidence(known_borders, new, prior, origin, parameters.inside)
    part = partition(new, prior + evidence, parameters.partition)
    return Belief(
        keyframe=new,
        prior=prior,
        evidence=evidence,
        alike=alike,
        body=completed(body, known, part, new.area),
        next_id=bodies.next_id,
        part=part,
        shown=freedoms_shown(new.edges, frame.gray, part, new.borders),
        finer=_finer(new, prior + evidence, parameters),
    )


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
    return Bodies(following.body, motion, np.array(motions), following.next_id)


def completed(
    body: NDArray[np.intp], known: NDArray[np.bool_], part: NDArray[np.intp], area: NDArray[np.intp]
) -> NDArray[np.intp]:
    """Ids [N], of which those that were not `known` [N] before take that of most of their part."""
    ids = np.zeros((int(part.max(initial=-1)) + 1, int(body.max(initial=0)) + 1))
    np.add.at(ids, (part, body), area)
    most = np.where(2 * ids.max(1) > ids.sum(1), ids.argmax(1), 0)
    return np.where(known | (body > 0), body, most[part])


def _finer(keyframe: Keyframe, bond: NDArray[np.float64], parameters: BeliefParameters) -> NDArray[np.intp]:
    parts = [partition(keyframe, bond - by, parameters.partition) for by in parameters.weaker]
    return np.array(parts, np.intp).reshape(-1, keyframe.count)


def _carry(
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


def _most_seen(keyframe: Keyframe, image: NDArray[np.integer]) -> NDArray[np.intp]:
    """The value >= 0 of an image [H, W] that each superpixel [N] shows most."""
    label = keyframe.superpixels.label
    inside = label >= 0
    values = image[keyframe.region][inside].astype(np.intp)
    count = int(values.max(initial=0)) + 1
    code, pixels = np.unique(label[inside] * count + values, return_counts=True)
    owner, value = np.divmod(code, count)
    most = np.zeros(keyframe.count, np.intp)
    order = np.lexsort((pixels, owner))
    most[owner[order]] = value[order]
    return most
