"""What is known of borders, carried to a new keyframe, whose superpixels and borders are others."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.se3 import inverse
from riseg_drake.segmentation.belief import Belief
from riseg_drake.segmentation.keyframe import Keyframe
from riseg_drake.segmentation.propagation import DEPTH_AGREES
from riseg_drake.segmentation.surface import seek, surface_pixels

_MOST = 0.5
"""Share of a superpixel's pixels."""


@dataclass(frozen=True)
class Origin:
    """Of the N superpixels of a new keyframe, what they were in the old one."""

    source: NDArray[np.intp]
    """[N], superpixel of the old keyframe; -1 where it shows none."""
    body: NDArray[np.intp]
    """[N], ids."""
    in_sight: NDArray[np.bool_]
    """[M], of each border of the new keyframe: of its sides one is new, and as one with the other it would have
    been seen before."""


def were_in_sight(
    old: Keyframe,
    new: Keyframe,
    source: NDArray[np.intp],
    motion: NDArray[np.intp],
    motions_K: NDArray[np.float64],
) -> NDArray[np.bool_]:
    """[M], the borders of a new keyframe one side of which is new, though it would have been in sight before.

    If it is one body with the other side, it was somewhere then. Either it was hidden, by anything, itself too
    (a thing that turns shows a new side), or the old keyframe would have shown it.

    Args:
        old: a keyframe.
        new: the next one, of N superpixels and M borders.
        source: [N], which superpixel of the old one each is; -1 where that shows none.
        motion: [N], index of the motion that each has made since; of no meaning where it is new.
        motions_K: [G, 4, 4], seen from the old keyframe's camera.
    """
    is_new = source < 0
    in_sight = np.zeros(len(new.borders), bool)
    owner_of = new.image_of(np.where(is_new, np.arange(new.count), -1), outside=-1)
    pixels = surface_pixels(owner_of >= 0, new.frame.depth, new.frame.intrinsics)
    owner = owner_of.ravel().take(pixels.index)
    count = np.maximum(np.bincount(owner, minlength=new.count), 1)
    X_ON = inverse(old.frame.X_WC) @ new.frame.X_WC
    for k in np.unique(motion[~is_new]):
        then = seek(pixels, inverse(motions_K[k]) @ X_ON)
        seen = then.read(old.frame.depth) > then.depth - DEPTH_AGREES
        was_seen = np.bincount(owner[seen], minlength=new.count) > _MOST * count
        for one, other in (new.borders.T, new.borders.T[::-1]):
            in_sight |= is_new[one] & ~is_new[other] & (motion[other] == k) & was_seen[one]
    return in_sight


def carried_evidence(
    old: Belief, new: Keyframe, new_prior: NDArray[np.float64], origin: Origin, inside: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Evidence [M] for the borders of the new keyframe, how much of it as both sides have moved alike [M], and
    how much as it is known of their bodies [M].

    What comes into sight may be of any body beside it with which it was hidden before. Of what was one
    superpixel before, both sides are one body by `inside` nats.
    """
    a, b = new.borders.T
    body = origin.body
    from_a, from_b = origin.source[a], origin.source[b]
    known = (from_a >= 0) & (from_b >= 0)
    same_border, place = _same_borders(old.keyframe, from_a, from_b)
    was, prior, alike = (np.append(each, 0.0)[place] for each in (old.evidence, old.prior, old.alike))
    # Of a border that there was what it showed, of any other what all borders of its bodies did. Of what the
    # pictures say half is the last one's: a gap is remembered when it has closed, and noise does not add up.
    between, gap, alike_between = _between_bodies(old, new, body)
    was, prior = np.where(same_border, was, between), np.where(same_border, prior, gap)
    remembered = was + (prior - new_prior) / 2
    hidden = ((from_a < 0) ^ (from_b < 0)) & ~origin.in_sight
    # What has parted is two, and so is what may lie on the other and goes along with it; what was told apart by
    # less is as much two as all that was seen between them says.
    unlike = np.where((between > -inside) & ~new.over, remembered, -2 * inside)
    apart = np.where(
        body[a] == body[b],
        # A gap in what is one body is one in the picture.
        np.where(body[a] > 0, inside / 2 - np.where(new.across, new_prior, 0.0), 0),
        np.where(hidden, 0, unlike),
    )
    evidence = np.where(known & (from_a == from_b), inside, np.where(same_border, remembered, apart))
    evidence = np.where(known | (body[a] > 0) | (body[b] > 0), evidence, 0.0)
    of_two = np.where(body[a] != body[b], np.maximum(alike_between, 0.0), 0.0)
    of_bodies = np.where((body[a] != body[b]) & (evidence != 0), apart, 0.0)
    inherited = np.where(same_border, np.append(old.inherited, 0.0)[place], of_bodies)
    return evidence, np.where(same_border, alike, of_two), inherited


def _same_borders(
    old: Keyframe, from_a: NDArray[np.intp], from_b: NDArray[np.intp]
) -> tuple[NDArray[np.bool_], NDArray[np.intp]]:
    """Which borders between what was `from_a` and `from_b` [M], -1 for nothing, the old keyframe had, and where
    among its own [M]; what it did not have may be one beyond its last."""
    code = np.minimum(from_a, from_b) * old.count + np.maximum(from_a, from_b)
    old_code = np.append(old.borders @ [old.count, 1], old.count**2)  # rising
    place = np.searchsorted(old_code, code)
    return (from_a >= 0) & (from_b >= 0) & (from_a != from_b) & (old_code[place] == code), place


def _between_bodies(
    old: Belief, new: Keyframe, body: NDArray[np.intp]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Of all borders that both bodies of a new border had, the mean evidence [M], prior [M] and evidence for
    having moved alike [M]; -inf if they had none."""
    pairs = np.sort(np.concatenate([old.body[old.keyframe.borders], body[new.borders]]), axis=1)
    _, pair = np.unique(pairs, axis=0, return_inverse=True)
    before, now = np.split(pair.ravel(), [len(old.evidence)])
    length = np.bincount(before, old.keyframe.length, len(pairs))

    def mean(values: NDArray[np.float64]) -> NDArray[np.float64]:
        total = np.bincount(before, old.keyframe.length * values, len(pairs))
        return np.divide(total, length, out=np.full(len(pairs), -np.inf), where=length > 0)[now]

    return mean(old.evidence), mean(old.prior), mean(old.alike)
