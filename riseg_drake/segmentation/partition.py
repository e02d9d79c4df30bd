"""Which superpixels are one body, which bodies have moved, and what the next best answer would cost."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from riseg_drake.segmentation.keyframe import Keyframe
from riseg_drake.segmentation.likelihood import nats_of_parts
from riseg_drake.segmentation.multicut import multicut
from riseg_drake.segmentation.potts import PottsGraph, potts_labels
from riseg_drake.segmentation.scales import SMALLEST_OBJECT

_NEVER = 1e3
"""Nats that a superpixel would cost in a part that is not beside its own."""


@dataclass
class PartitionParameters:
    """What counts as a body."""

    area_min: float = SMALLEST_OBJECT
    """m^2; what is smaller is no object of its own."""
    rigid_min: float = 60.0
    """Nats that it must cost two parts to have one motion, before it counts against their being one body:
    fifteen superpixels' worth, as highlights and shadows make errors that are alike in many."""
    most_apart: float = 4.0
    """Nats a border that this is remembered as, at most: more than the still picture (2) and one push
    along (1.6) say against it together."""
    moved_min: float = 8.0
    """Nats by which a motion must explain a body better than standing still does: two superpixels' worth."""
    margins: list[float] = field(default_factory=lambda: [0.5, 1.0, 1.5, 2.0, 3.0, 4.0])
    """Log-odds by which every bond is weakened, and strengthened, to see which bodies fall apart or merge."""


def partition(
    keyframe: Keyframe,
    bond: NDArray[np.float64],
    parameters: PartitionParameters,
    known: NDArray[np.float64] | None = None,
    nats: NDArray[np.float64] | None = None,
) -> NDArray[np.intp]:
    """The part 0.. of each superpixel [N] for the log-odds of each border [M]; no part is too small.

    With what is `known` of B bodies [B, N], nats that it costs each superpixel to be one with them
    (`told_apart`). With `nats` [G, N], how badly each motion explains each superpixel: a body is rigid, and
    what saw it move may be far from the border that is in question.
    """
    weight = bond * keyframe.length
    asked = ((known, 0.0), (nats, parameters.rigid_min))
    questions = [(costs, free) for costs, free in asked if costs is not None]
    part = multicut(keyframe.count, keyframe.borders, weight, questions)
    if nats is not None and len(nats) > 1:
        part = redrawn(part, keyframe.borders, weight, nats, parameters)
    joins = ~keyframe.across | (weight > 0)
    return _without_small(
        part,
        keyframe.borders[joins],
        weight[joins],
        keyframe.area,
        parameters.area_min * keyframe.pixels_per_metre**2,
    )


def redrawn(
    part: NDArray[np.intp],
    borders: NDArray[np.intp],
    weight: NDArray[np.float64],
    nats: NDArray[np.float64],
    parameters: PartitionParameters,
) -> NDArray[np.intp]:
    """The parts [N], with the outlines between those of unlike motions where all superpixels' costs have them.

    Near a contact two motions are nearly alike, so that the two sides of a border say little of it; all that
    lies between that border and the true one says more.

    Args:
        part: [N], 0.., of each superpixel.
        borders: [M, 2], pairs of superpixels that touch.
        weight: [M], nats that it brings not to cut each border.
        nats: [G, N], how badly each motion explains each superpixel.
        parameters: see there.
    """
    motion = motions_of_parts(part, nats, parameters)
    beside = np.zeros((len(motion), len(motion)), bool)
    beside[part[borders[:, 0]], part[borders[:, 1]]] = True
    beside = (beside | beside.T) & (motion[:, None] != motion)
    # Parts all of whose neighbours move as they do stay as they are, and so do their borders.
    asked = np.flatnonzero(beside.any(1))
    if not len(asked):
        return part
    mine = np.flatnonzero(np.isin(part, asked))
    place = np.full(len(part), -1)
    place[mine] = np.arange(len(mine))
    inner = (place[borders] >= 0).all(1)
    edges, coupling = place[borders[inner]], weight[inner]
    before = np.searchsorted(asked, part[mine])
    may_be = (np.eye(len(motion), dtype=bool) | beside)[np.ix_(asked, part[mine])]
    own = nats[:, mine]
    unary = np.where(may_be, own[motion[asked]], _NEVER)
    label, _ = potts_labels(unary.astype(np.float32), PottsGraph(len(mine), edges, np.maximum(coupling, 0.0)))

    def energy(label: NDArray[np.intp]) -> float:
        cut = label[edges[:, 0]] != label[edges[:, 1]]
        return float(coupling[cut].sum() + own[motion[asked[label]], np.arange(len(label))].sum())

    if energy(label) >= energy(before):
        return part
    redrawn_part = part.copy()
    redrawn_part[mine] = asked[label]
    return np.unique(redrawn_part, return_inverse=True)[1]


def apart(
    keyframe: Keyframe,
    part: NDArray[np.intp],
    nats: NDArray[np.float64],
    parameters: PartitionParameters,
) -> NDArray[np.float64]:
    """[M], log-odds of each border that speak against it since its two parts [N] have no one motion."""
    a, b = part[keyframe.borders].T
    cost = nats_of_parts(nats, part)
    # What it costs both parts to have one motion.
    shared = (cost[:, a] + cost[:, b]).min(0) - cost[:, a].min(0) - cost[:, b].min(0)
    lost = shared - parameters.rigid_min
    pair = np.minimum(a, b) * cost.shape[1] + np.maximum(a, b)
    _, inverse = np.unique(pair, return_inverse=True)
    length = np.bincount(inverse, keyframe.length)[inverse]
    return np.where(a != b, -np.clip(lost / np.maximum(length, 1e-9), 0.0, parameters.most_apart), 0.0)


def motions_of_parts(
    part: NDArray[np.intp], nats: NDArray[np.float64], parameters: PartitionParameters
) -> NDArray[np.intp]:
    """Which motion 0..G-1 each part [P] has: a body is rigid, so the one that explains all of it best.

    Args:
        part: [N], 0.., part of each superpixel.
        nats: [G, N], how badly each motion explains each superpixel; the first is standing still.
        parameters: see there.
    """
    worse = nats_of_parts(nats, part)
    worse[1:] += parameters.moved_min
    return worse.argmin(0)


def shared_area(
    one: NDArray[np.intp], other: NDArray[np.intp], area: NDArray[np.intp], shape: tuple[int, int]
) -> NDArray[np.float64]:
    """[I, J] = `shape`, the area that each number of `one` [N] shares with each of the `other` [N].

    `area` [N], pixels of each superpixel.
    """
    rows, columns = shape
    return np.asarray(np.bincount(one * columns + other, area, rows * columns), float).reshape(shape)


def with_ids(
    part: NDArray[np.intp],
    moved: NDArray[np.bool_],
    area: NDArray[np.intp],
    previous: Sequence[NDArray[np.intp]],
    next_id: int,
) -> tuple[NDArray[np.intp], int]:
    """Ids [N] (0 = has not moved), and the next free one: the larger part of what was one keeps its id.

    Args:
        part: [N], part of each superpixel.
        moved: [P], of each part.
        area: [N].
        previous: ids [N] to keep, the most binding first.
        next_id: the first that is free.
    """
    id_of = np.zeros(len(moved), np.intp)
    for ids in previous:
        known = (ids > 0) & moved[part] & (id_of[part] == 0) & ~np.isin(ids, id_of)
        pairs, inverse = np.unique(np.stack([part[known], ids[known]]), axis=1, return_inverse=True)
        shared = np.bincount(inverse.ravel(), area[known], pairs.shape[1])
        for p, a in pairs[:, np.argsort(-shared, kind="stable")].T:
            if id_of[p] == 0 and a not in id_of:
                id_of[p] = a
    fresh = np.flatnonzero(moved & (id_of == 0))
    id_of[fresh] = next_id + np.arange(len(fresh))
    return id_of[part], max(next_id, int(id_of.max(initial=0)) + 1)


@dataclass(frozen=True)
class Margins:
    """By how many nats a border the best partition is better than the next one, for each id."""

    whole: Mapping[int, float] = field(default_factory=dict)
    """Than one in which it is two: how much weaker every bond may be before it falls apart."""
    alone: Mapping[int, float] = field(default_factory=dict)
    """Than one in which it is part of another that moved: how much stronger every bond may be."""

    @property
    def least(self) -> dict[int, float]:
        """Than any other."""
        return {a: min(by, self.alone[a]) for a, by in self.whole.items()}


def margins(
    keyframe: Keyframe,
    bond: NDArray[np.float64],
    body: NDArray[np.intp],
    parameters: PartitionParameters,
    known: NDArray[np.float64] | None = None,
) -> Margins:
    """How sure each id in `body` [N] is, by bonds [M] and what is `known`, as `partition` has them."""
    ids = [int(a) for a in np.unique(body[body > 0])]
    whole = dict.fromkeys(ids, 2 * parameters.margins[-1])
    alone = dict(whole)
    area_min = parameters.area_min * keyframe.pixels_per_metre**2
    for by in reversed(parameters.margins):
        weaker = partition(keyframe, bond - by, parameters, known)
        stronger = partition(keyframe, bond + by, parameters, known)
        for a in ids:
            mine = body == a
            if np.count_nonzero(np.bincount(weaker[mine], keyframe.area[mine]) >= area_min) > 1:
                whole[a] = by
            own = np.bincount(stronger[mine], keyframe.area[mine]).argmax()
            others = (stronger == own) & ~mine & (body > 0)
            if keyframe.area[others].sum() >= area_min:
                alone[a] = by
    return Margins(whole, alone)


def as_tested(now: Margins, before: Margins, moved: Collection[int]) -> Margins:
    """The margins of a rest, where ids that have not moved since the rest `before` are as whole as they were.

    What stood still was not put to the test, though its new superpixels may hold together better, or worse.
    """
    whole = {a: by if a in moved else before.whole.get(a, by) for a, by in now.whole.items()}
    return replace(now, whole=whole)


def _without_small(
    part: NDArray[np.intp],
    borders: NDArray[np.intp],
    weight: NDArray[np.float64],
    area: NDArray[np.intp],
    area_min: float,
) -> NDArray[np.intp]:
    """The parts, those smaller than `area_min` pixels joined to the neighbour they are bound to most."""
    count = int(part.max(initial=-1)) + 1
    size = np.bincount(part, area, count)
    if count == 0 or (size >= area_min).all():
        return part
    a, b = part[borders].T
    outer = a != b
    bonds: list[dict[int, float]] = [{} for _ in range(count)]
    for i, j, w in zip(a[outer].tolist(), b[outer].tolist(), weight[outer].tolist(), strict=True):
        bonds[i][j] = bonds[j][i] = bonds[i].get(j, 0.0) + w
    parent = np.arange(count)
    queue = sorted(np.flatnonzero(size < area_min).tolist(), key=lambda p: size[p])
    while queue:
        small = queue.pop(0)
        if parent[small] != small or size[small] >= area_min or not bonds[small]:
            continue
        into = max(bonds[small], key=lambda p: bonds[small][p])
        parent[small] = into
        size[into] += size[small]
        for p, w in bonds[small].items():
            del bonds[p][small]
            if p != into:
                bonds[into][p] = bonds[p][into] = bonds[into].get(p, 0.0) + w
        bonds[small] = {}
        if size[into] < area_min:
            queue.append(into)
    while not np.array_equal(parent, parent[parent]):
        parent = parent[parent]
    return np.unique(parent[part], return_inverse=True)[1]
