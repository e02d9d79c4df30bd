"""What one frame says of a keyframe: which motion each superpixel has, and which neighbours moved as one.

Superpixels a, b have the motion k, of the share pi_k of what stands there, with the probabilities q_a(k),
q_b(k). Those of one body have the same. If a has k, a neighbour that is another body has l with the probability
rho(l | k): what moves pushes it along now and then, what lies on it goes along as often as not, what stands
still mostly stands beside what does so, too. All other motions are as likely as they are common.

    evidence(a, b) = log( sum_k q_a(k) q_b(k) / pi_k ) - log( sum_k,l q_a(k) rho(l | k) q_b(l) / pi_l )

Standing still together says little, moving together more, moving apart most; who says nothing says nothing.
That two which touch have moved together is only as much of a coincidence as both show of a motion
(`coincidence`): rho(k | k) is raised to that power.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.rgbd import Immutable
from riseg_drake.segmentation.alignment import AlignmentParameters, align_motions
from riseg_drake.segmentation.comparison import Comparison
from riseg_drake.segmentation.keyframe import Keyframe
from riseg_drake.segmentation.likelihood import LikelihoodParameters, motion_costs, nats_of_parts
from riseg_drake.segmentation.motions import flow_difference
from riseg_drake.segmentation.potts import PottsGraph, potts_labels


@dataclass
class ObservationParameters:
    """How motions are given to superpixels."""

    likelihood: LikelihoodParameters = field(default_factory=LikelihoodParameters)
    alignment: AlignmentParameters = field(default_factory=AlignmentParameters)
    outlier: float = 0.02
    """Probability with which a superpixel's motion says nothing of its body."""
    motion_cost: float = 20.0
    """Nats that a motion must explain better than all others do, to be one: five superpixels' worth, as
    errors are common to neighbours."""
    view_cost: float = 2.0
    """So much more for each pixel by which what stands still may seem to have moved (`Comparison.shift`): from
    another view gloss and wrong depth look like a motion over larger patches."""
    along: float = 0.2
    """rho(k | k) of a motion: probability with which a thing pushes its neighbour along as if they were one."""
    carried: float = 0.5
    """The same where one of two may lie on the other: as often as not."""
    across: float = 0.05
    """The same across a gap: what does not touch is pushed along by a third thing at most."""
    touching: float = 1.0
    """Freedoms of a motion that things which touch have in common anyway, as they go on touching."""
    stays: float = 0.8
    """rho(k | k) of standing still: with which the neighbour of what stands still stands still, too."""
    still_share: float = 0.5
    """Least share of standing still: most does."""
    still: float = 0.5
    """Nats by which a superpixel that says nothing stands still rather than moves."""
    border: float = 1.0
    """Share of a border's log-odds by which unequal motions on both sides are less likely."""
    border_least: float = 0.2
    """Nats of a border that is none in the image, as of one that is known to be one."""


@dataclass(frozen=True)
class Observation(Immutable):
    """Of N superpixels and M borders of a keyframe, at one frame."""

    motions_K: NDArray[np.float64]
    """[G, 4, 4] since the keyframe, seen from its camera; the first is standing still."""
    motion: NDArray[np.intp]
    """[N], which of them each superpixel has."""
    nats: NDArray[np.float64]
    """[G, N], how much worse each motion explains each superpixel than the best one does."""
    evidence: NDArray[np.float64]
    """[M], log-odds that both sides of a border are one body."""
    span: NDArray[np.float64]
    """[N], pixels by which its motion moves a superpixel: how well it tells motions apart."""
    share: NDArray[np.float64]
    """[G], how common each motion is."""
    strangers: NDArray[np.bool_]
    """[N], what has proved to be no part of its body."""


def observe(
    compared: Comparison,
    bond: NDArray[np.float64],
    divisions: NDArray[np.intp],
    shown: NDArray[np.float64],
    candidates_K: NDArray[np.float64],
    parameters: ObservationParameters,
) -> Observation:
    """Explain a frame by standing still and some of the candidate motions.

    Args:
        compared: the keyframe, which is explained, and the frame.
        bond: [M], log-odds of each border so far.
        divisions: [L, N], 0.., ways to tell which superpixels are one body, the likeliest first.
        shown: [M], of how many freedoms of a motion both sides of a border tell, see `coincidence`.
        candidates_K: [C, 4, 4], motions since the keyframe, seen from its camera.
        parameters: see there.
    """
    keyframe = compared.keyframe
    candidates_K = candidates_K.reshape(-1, 4, 4)
    if len(candidates_K):
        candidates_K = align_motions(
            compared.pair, keyframe.edges, candidates_K, compared.depth_noise, parameters.alignment
        )
    motions_K = np.concatenate([np.eye(4)[None], candidates_K])
    costs = motion_costs(compared, motions_K, parameters.likelihood)
    nats = costs.nats(parameters.likelihood)
    moves = _more_than_the_view_errs(compared, motions_K, nats, parameters.likelihood.view_errors)
    price = motion_price(compared, parameters)
    among, motion = _fewest_motions(nats[moves], keyframe, bond, divisions, price, parameters)
    needed = np.flatnonzero(moves)[among]
    nats = costs.nats(parameters.likelihood, which=needed)
    share = np.bincount(motion, keyframe.area, len(needed)) / max(1, keyframe.area.sum())
    share = np.maximum(share, parameters.outlier)
    share[0] = max(share[0], parameters.still_share)
    share /= share.sum()
    q = motion_posterior(nats, share, parameters.outlier)
    focal_length, p_KQ = compared.frame.intrinsics.fx, keyframe.edges.p_C0Q[::10]
    spans = [flow_difference(p_KQ, X, np.eye(4), focal_length) if len(p_KQ) else 0.0 for X in motions_K[needed]]
    return Observation(
        motions_K=motions_K[needed],
        motion=motion,
        nats=nats,
        evidence=_evidence(keyframe, q, share, shown, parameters),
        span=np.array(spans)[motion],
        share=share,
        strangers=np.zeros(keyframe.count, bool),
    )


def evidence_of_parts(
    seen: Observation,
    keyframe: Keyframe,
    part: NDArray[np.intp],
    shown: NDArray[np.float64],
    parameters: ObservationParameters,
) -> NDArray[np.float64]:
    """[M], log-odds that both sides of a border are one body, by all of the parts [N] that they belong to.

    A superpixel of a blank thing says little of its motion, all of them together may be sure of it.
    """
    q = motion_posterior(nats_of_parts(seen.nats, part), seen.share, parameters.outlier)
    return _evidence(keyframe, q[:, part], seen.share, shown, parameters)


def _evidence(
    keyframe: Keyframe,
    q: NDArray[np.float64],
    share: NDArray[np.float64],
    shown: NDArray[np.float64],
    parameters: ObservationParameters,
) -> NDArray[np.float64]:
    """[M], by how likely each motion is each superpixel's own [G, N], how common each is [G], and of how many
    freedoms of a motion both sides of a border tell [M]."""
    along = np.where(keyframe.over, parameters.carried, parameters.along)
    along[keyframe.across] = parameters.across
    # What both sides do not show, or have in common as they touch, is no coincidence.
    along **= np.clip(shown - np.where(keyframe.across, 0.0, parameters.touching), 0.0, 1.0)
    # That what does not touch stands still says nothing.
    stays = np.where(keyframe.across | keyframe.behind, 1.0, parameters.stays)
    return bond_evidence(q, share, keyframe.borders, stays, along)


def motion_price(compared: Comparison, parameters: ObservationParameters) -> float:
    """Nats that a motion must explain better than all others do."""
    return parameters.motion_cost * (1 + parameters.view_cost * compared.shift)


def _more_than_the_view_errs(
    compared: Comparison, motions_K: NDArray[np.float64], nats: NDArray[np.float64], view_errors: float
) -> NDArray[np.bool_]:
    """Which motions [G] move what they explain better than standing still does, the first, by more pixels than
    it may seem to move from another view; standing still is among them."""
    least = view_errors * compared.shift
    edges, focal_length = compared.keyframe.edges, compared.frame.intrinsics.fx
    moves = np.ones(len(motions_K), bool)
    for k in range(1, len(motions_K)):
        p_KQ = edges.p_C0Q[(nats[k] < nats[0])[edges.piece]]
        moves[k] = len(p_KQ) > 0 and flow_difference(p_KQ, motions_K[k], np.eye(4), focal_length) > least
    return moves


def motion_posterior(
    nats: NDArray[np.float64], share: NDArray[np.float64], outlier: float
) -> NDArray[np.float64]:
    """q [G, N]: how likely each motion is a superpixel's own, by costs [G, N] and how common each is [G].

    A superpixel may be an `outlier`, with that probability, whose costs say nothing.
    """
    logit = np.log(share)[:, None] - nats
    q = np.exp(logit - logit.max(0))
    return (1 - outlier) * q / q.sum(0) + outlier * share[:, None]


def bond_evidence(
    q: NDArray[np.float64],
    share: NDArray[np.float64],
    borders: NDArray[np.intp],
    stays: float | NDArray[np.float64],
    along: float | NDArray[np.float64],
) -> NDArray[np.float64]:
    """[M], log-odds that both sides of borders [M, 2] are one body, as above.

    `q` [G, N] is how likely each motion is each superpixel's own, `share` [G] how common each is, `stays` and
    `along`, [M] or the same for all, the probabilities with which another body does as its neighbour that
    stands still, or moves.
    """
    q_a, q_b = q[:, borders[:, 0]], q[:, borders[:, 1]]
    pi = share[:, None]
    alike = q_a * q_b / pi
    rho = np.broadcast_to(along, alike.shape).copy()
    rho[0] = stays
    unlike = (q_a * (1 - q_b) + q_b * (1 - q_a)) / 2 / np.maximum(1 - pi, 1e-12)
    by_chance: NDArray[np.float64] = (rho * alike + (1 - rho) * unlike).sum(0)
    return np.log(alike.sum(0) / by_chance)


def _fewest_motions(
    nats: NDArray[np.float64],
    keyframe: Keyframe,
    bond: NDArray[np.float64],
    divisions: NDArray[np.intp],
    price: float,
    parameters: ObservationParameters,
) -> tuple[list[int], NDArray[np.intp]]:
    """The motions that are needed, and which of these each superpixel [N] has; drops the others one by one.

    To be needed takes what it takes to be found (`Search`): superpixels that it explains, or a part of any of
    the divisions [L, N] that no other motion explains.
    """
    coupling = parameters.border * np.maximum(bond, parameters.border_least) * keyframe.length
    graph = PottsGraph(keyframe.count, keyframe.borders, coupling)
    needed, message = list(range(len(nats))), None
    part = divisions[0]
    nats_of_all = np.hstack([nats_of_parts(nats, division) for division in divisions])
    while True:
        unary = nats[needed].astype(np.float32)
        unary[1:] += np.float32(parameters.still)
        motion, message = potts_labels(unary, graph, message)
        # Two other motions may each explain half of a part, and none all of it.
        of_parts = nats_of_all[needed]
        without_best = np.diff(np.partition(of_parts, min(1, len(needed) - 1), axis=0)[:2], axis=0)
        as_parts = [without_best[:, of_parts.argmin(0) == k].max(initial=0) for k in range(len(needed))]
        gains = []
        for k in range(1, len(needed)):
            mine = nats[np.ix_(needed, motion == k)]
            # All of a part, as far as it has this motion, would have another one.
            without, owner = np.delete(mine, k, axis=0) - mine[k], part[motion == k]
            as_labelled = np.min([np.bincount(owner, w) for w in without], axis=0).sum()
            gains.append(float(max(as_labelled, as_parts[k])))
        if not gains or min(gains) >= price:
            return needed, motion
        dropped = int(np.argmin(gains)) + 1
        del needed[dropped]
        message = np.delete(message, dropped, axis=1)
