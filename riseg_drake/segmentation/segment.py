"""Alg. 2, line 7, whole: the groups G_t and the mask L_t-1 make the mask L_t."""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.camera import back_project, bounding_region, pixel_grid
from riseg_drake.geometry.rgbd import NO_PAIR, FramePair, Immutable
from riseg_drake.segmentation.above_table import AboveTable
from riseg_drake.segmentation.alignment import align_motions
from riseg_drake.segmentation.association import (
    UNKNOWN,
    AssociationParameters,
    KnownObjects,
    associate,
)
from riseg_drake.segmentation.bfif import BFIFParameters
from riseg_drake.segmentation.doubt import DoubtParameters, doubtful_ids
from riseg_drake.segmentation.effective_flow import effective_flow
from riseg_drake.segmentation.growth import GrowthParameters, grow_by_similar_flow
from riseg_drake.segmentation.memory import Memory, draw_memory, moved_memory, remember
from riseg_drake.segmentation.motion_labels import (
    MotionLabelParameters,
    ReferencePieces,
    cut_pieces,
    label_by_motion,
)
from riseg_drake.segmentation.motions import (
    BFIFGroups,
    motion_gaps,
    with_earlier_motions,
)
from riseg_drake.segmentation.propagation import carry_labels
from riseg_drake.segmentation.segment_by_evidence import EvidenceParameters


@dataclass
class SegmentParameters:
    """All of line 7."""

    method: str = field(default="rules", metadata={"choices": ("rules", "evidence")})
    """"rules" (this file, by the fields below) or "evidence" (segment_by_evidence.py, in trial)."""
    evidence: EvidenceParameters = field(default_factory=EvidenceParameters)

    outline: str = field(default="motion", metadata={"choices": ("motion", "flow")})
    """"motion" (which motion explains a pixel, motion_labels.py) or "flow" (breadth first search over
    similar flow, as in the paper, growth.py)."""
    labels: MotionLabelParameters = field(default_factory=MotionLabelParameters)
    growth: GrowthParameters = field(default_factory=GrowthParameters)
    association: AssociationParameters = field(default_factory=AssociationParameters)
    propagation: str = field(default="reference", metadata={"choices": ("reference", "flow")})
    """"reference" (labels carried from the reference frame by each object's own motion) or "flow"
    (every frame by O_t, in whole pixels, as in the paper)."""
    ids: str = field(default="evidence", metadata={"choices": ("evidence", "fresh")})
    """"evidence" (see association.py) or "fresh" (each group a new id, as in the paper)."""
    doubt: DoubtParameters = field(default_factory=DoubtParameters)
    memory: bool = True
    """Remember objects that leave the view (not in the paper)."""
    episode_gap: float = 0.7
    """s without motion after which motion is a new episode."""


@dataclass(frozen=True)
class Segmentation(Immutable):
    """L_t, and what must be remembered for L_t+1: the propagator's one state."""

    sequence: int
    """Number of the frame that `label` belongs to; -1 before the first."""
    label: NDArray[np.uint16]
    """[H, W], ids, UNKNOWN where something stands that has not moved yet, 0 for table and robot."""
    reference_sequence: int
    """Number of the reference frame that the next fields belong to."""
    known: KnownObjects
    """What was known at the reference frame, before the motion since then."""
    pieces: ReferencePieces | None
    """The reference frame cut into pieces, once something has moved in it."""
    decided: NDArray[np.uint16]
    """[H, W], labels at the reference frame in the light of the motion since then."""
    motion_of: dict[int, NDArray[np.float64]]
    """Motion [4, 4] in C0 since the reference frame, of the ids that moved."""
    memory: Memory
    """Points of objects that the reference frame does not see, as of its time."""
    pair: FramePair
    """The last pair, whose current frame `label` belongs to; NO_PAIR before the first."""
    born: dict[int, int]
    doubtful: frozenset[int]
    """Ids that may be two objects, see doubt.py."""
    next_id: int
    episode: int
    """Counts the times that something began to move."""
    last_motion: float
    """When something moved last, s."""

    @property
    def mask(self) -> NDArray[np.uint16]:
        """L_t [H, W]: object ids, 0 = background."""
        return np.where(self.label == UNKNOWN, np.uint16(0), self.label)

    @property
    def settled_mask(self) -> NDArray[np.uint16]:
        """L_t [H, W] without the objects in doubt: what needs no further push."""
        mask = self.mask
        return np.where(np.isin(mask, list(self.doubtful)), np.uint16(0), mask) if self.doubtful else mask

    @property
    def object_ids(self) -> tuple[int, ...]:
        """All ids ever found, in the view or not."""
        return tuple(sorted(self.born))


def nothing_segmented(shape: tuple[int, int]) -> Segmentation:
    """L_0: an empty mask [H, W] (Alg. 1, line 3)."""
    empty = np.zeros(shape, np.uint16)
    return Segmentation(
        sequence=-1,
        label=empty,
        reference_sequence=-1,
        known=KnownObjects(empty, {}, 1),
        pieces=None,
        decided=empty,
        motion_of={},
        memory={},
        pair=NO_PAIR,
        born={},
        doubtful=frozenset(),
        next_id=1,
        episode=0,
        last_motion=-np.inf,
    )


def segment(
    before: Segmentation,
    pair: FramePair,
    expected_flow: NDArray[np.float32],
    optical_flow: NDArray[np.float32],
    groups: BFIFGroups,
    above_0: AboveTable,
    above_1: AboveTable,
    parameters: SegmentParameters,
    bfif: BFIFParameters,
) -> Segmentation:
    """L_t from G_t, O_t and L_t-1.

    Args:
        before: L_t-1; if it already belongs to this pair's frame it is the answer.
        pair: the frames of t-1 and t.
        expected_flow: E_t [H, W, 2], pixels.
        optical_flow: O_t [H, W, 2], pixels.
        groups: G_t.
        above_0: objMask at t-1.
        above_1: objMask at t.
        parameters: see there.
        bfif: what the groups were made with: noise of the measurements, and when two motions are one.

    Raises:
        ValueError: for an unknown kind of outline or propagation.
    """
    if before.sequence == pair.current.sequence:
        return before
    now = _renew_reference(before, pair, above_0, parameters)
    if groups.flow_span > 0:
        starts = pair.current.time - before.last_motion > parameters.episode_gap
        now = replace(now, last_motion=pair.current.time, episode=now.episode + int(starts))
    motions = with_earlier_motions(groups, now.motion_of.values(), pair.current.intrinsics.fx, bfif.motions)
    something_stands = above_0.mask.any()
    if something_stands and (len(motions) or groups.flow_span > 0):
        if parameters.outline == "motion" and now.pieces is None:
            pieces = cut_pieces(pair.reference, above_0, _moved_as_one(now), bfif.noise, parameters.labels)
            now = replace(now, pieces=pieces)
        if now.pieces is not None:
            motions = align_motions(
                pair,
                now.pieces.edges,
                motions,
                above_0.depth_noise,
                parameters.labels.alignment,
            )
    if something_stands and len(motions):
        moving = _grow(now, pair, expected_flow, optical_flow, groups, motions, above_0, parameters)
        now = _decide(now, pair, groups, motions, moving, above_0, parameters)
    if parameters.propagation == "flow":
        label = push_by_flow(now.decided, optical_flow)
        # What no label was carried to (it came into view, or lay between two targets) may yet be found.
        label = np.where((label == 0) & above_1.mask, UNKNOWN, label)
    elif parameters.propagation == "reference":
        remembered = moved_memory(now.memory, now.motion_of, pair.reference.X_WC)
        drawn = draw_memory(remembered, pair.current)
        label = carry_labels(pair, now.decided, now.motion_of, above_1, drawn)
    else:
        raise ValueError(f"no propagation {parameters.propagation!r}: choose reference or flow")
    return replace(now, sequence=pair.current.sequence, label=label, pair=pair)


def push_by_flow(label: NDArray[np.uint16], optical_flow: NDArray[np.float32]) -> NDArray[np.uint16]:
    """L_t(x, y) = L_t-1(i, j) with (x, y) = (i, j) + O_t(i, j) in whole pixels, [H, W], as the paper has it."""
    out = np.zeros_like(label)
    v, u = np.nonzero(label)
    target = np.rint(pixel_grid(*label.shape)[v, u] + optical_flow[v, u]).astype(int)
    inside = (target >= 0).all(1) & (target[:, 0] < label.shape[1]) & (target[:, 1] < label.shape[0])
    out[target[inside, 1], target[inside, 0]] = label[v, u][inside]
    return out


def _renew_reference(
    before: Segmentation, pair: FramePair, above_0: AboveTable, parameters: SegmentParameters
) -> Segmentation:
    """What is known at this pair's reference frame."""
    if pair.reference.sequence == before.reference_sequence:
        return before
    # The new reference is the frame before this one, so its labels are those decided last.
    label = before.label
    if before.sequence != pair.reference.sequence or label.shape != above_0.mask.shape:
        label = np.where(above_0.mask, UNKNOWN, np.uint16(0))
    memory: Memory = {}
    if parameters.memory and before.pair is not NO_PAIR:
        memory = remember(before.memory, before.pair, before.decided, before.motion_of)
    return replace(
        before,
        reference_sequence=pair.reference.sequence,
        known=KnownObjects(label, before.born, before.next_id),
        pieces=None,
        decided=label,
        motion_of={},
        memory=memory,
    )


def _moved_as_one(now: Segmentation) -> NDArray[np.uint16]:
    """L_t-1 [H, W] without what was found in this episode of motion only, or is in doubt."""
    earlier = [a for a, episode in now.born.items() if episode < now.episode and a not in now.doubtful]
    label = now.known.label
    return np.where(np.isin(label, earlier), label, np.uint16(0))


def _grow(
    now: Segmentation,
    pair: FramePair,
    expected_flow: NDArray[np.float32],
    optical_flow: NDArray[np.float32],
    groups: BFIFGroups,
    motions: NDArray[np.float64],
    above_0: AboveTable,
    parameters: SegmentParameters,
) -> NDArray[np.int16]:
    """Line 7's growth from seeds to pixels, in the view of t-1: 1 + motion, 0 = stands still."""
    if now.pieces is not None:
        return label_by_motion(pair, now.pieces, motions, above_0.depth_noise, parameters.labels)
    if parameters.outline != "flow":
        raise ValueError(f"no outline {parameters.outline!r}: choose motion or flow")
    X_t = effective_flow(optical_flow, expected_flow)
    with np.errstate(invalid="ignore"):
        moving = above_0.mask & ((X_t**2).sum(-1) > parameters.growth.flow_min**2)
    return grow_by_similar_flow(X_t, moving, groups, parameters.growth.similar_flow)


def _decide(
    now: Segmentation,
    pair: FramePair,
    groups: BFIFGroups,
    motions: NDArray[np.float64],
    moving: NDArray[np.int16],
    above_0: AboveTable,
    parameters: SegmentParameters,
) -> Segmentation:
    """Labels at the reference frame in the light of what moves."""
    if parameters.ids == "fresh":
        fresh = np.where(moving > 0, moving + (now.next_id - 1), 0).astype(np.uint16)
        ids = [int(a) for a in np.unique(fresh[fresh > 0])]
        return replace(
            now,
            decided=np.where(moving > 0, fresh, now.known.label),
            motion_of={a: motions[a - now.next_id] for a in ids},
            born={**now.born, **dict.fromkeys(ids, now.episode)},
            next_id=max([now.next_id - 1, *ids]) + 1,
        )
    pixels_per_metre = above_0.pixels_per_metre(pair.reference.intrinsics)
    region = bounding_region(now.known.label > 0, margin=1)
    gaps = motion_gaps(_points(groups, pair, above_0), motions, pair.current.intrinsics.fx)
    association = associate(
        replace(now.known, label=now.known.label[region]),
        moving[region],
        now.decided[region] if now.sequence > now.reference_sequence else None,
        gaps,
        now.episode,
        pixels_per_metre,
        parameters.association,
    )
    decided = now.known.label.copy()
    decided[region] = association.label
    doubtful = doubtful_ids(
        association.label,
        association.born,
        now.episode,
        {a: float(gaps[0, 1 + g]) for a, g in association.motion_of.items()},
        now.doubtful,
        pixels_per_metre,
        parameters.doubt,
    )
    return replace(
        now,
        decided=decided,
        doubtful=doubtful,
        motion_of={a: motions[g] for a, g in association.motion_of.items()},
        born=association.born,
        next_id=max(association.next_id, now.next_id),
    )


def _points(groups: BFIFGroups, pair: FramePair, above_0: AboveTable) -> NDArray[np.float64]:
    """Points [N, 3] on what moves, or if no group says what, on all that stands on the table."""
    if len(groups.p_C0Q):
        return groups.p_C0Q
    p_C0Q = back_project(pair.reference.depth, pair.reference.intrinsics)[above_0.mask]
    return p_C0Q[p_C0Q[:, 2] > 0][::50].astype(float)
