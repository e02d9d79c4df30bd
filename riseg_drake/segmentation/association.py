"""Alg. 2, line 7: is a moving group an object already known, two of them, or one that must be split?

The paper gives every group a fresh id at every step. Here the decision is made in one place, from what
was labelled before (`known`) and what moves now (`moving`), both in the view of t-1:

* a known object that a group covers moves with that group; two known objects may share one;
* a known object of which a solid part moves otherwise than the rest, by clearly more than noise, was
  two objects: the larger part keeps the id;
* unknown pixels that move with an object found in this same episode of motion belong to it;
* unknown pixels that move with an object known from an earlier episode do not: they stood still when
  it was found. They are another object, unless they are only a rim;
* any other solid unknown piece that moves is a new object. It keeps the id that it was given in the
  frame before, while the reference stays the same.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import find_objects

from riseg_drake.geometry.camera import Region, bounding_region

UNKNOWN = np.uint16(65535)
"""Label of pixels above the table that no object has claimed yet; never leaves the propagator."""


@dataclass
class AssociationParameters:
    """Evidence that a decision needs."""

    area_min: float = 3.0e-4
    """m^2; a smaller moving piece is no object."""
    rim: float = 0.005
    """m; what is nowhere wider than twice that is a rim of something else, not a piece of its own."""
    split_share: float = 0.2
    """A part that moves otherwise splits an object if it is at least that share of it."""
    split_flow: float = 1.5
    """Pixels (root mean square) by which the two motions must differ for that."""
    same_share: float = 0.5
    """Overlap, of the smaller of the two, from which a piece is the one seen in the frame before."""


@dataclass(frozen=True)
class KnownObjects:
    """What was known at the reference frame."""

    label: NDArray[np.uint16]
    """[H, W], ids, UNKNOWN, or 0 for the table."""
    born: dict[int, int]
    """The episode of motion in which each id was found."""
    next_id: int


@dataclass(frozen=True)
class Association:
    """The labels at the reference frame in the light of what moves."""

    label: NDArray[np.uint16]
    """[H, W], ids, UNKNOWN, or 0."""
    motion_of: dict[int, int]
    """The group that each moving id moves with; an id that is not there stands still."""
    born: dict[int, int]
    next_id: int


def associate(
    known: KnownObjects,
    moving: NDArray[np.int16],
    previous: NDArray[np.uint16] | None,
    motion_gap: NDArray[np.float64],
    episode: int,
    pixels_per_metre: float,
    parameters: AssociationParameters,
) -> Association:
    """Give ids to what moves.

    Args:
        known: what was labelled before, in the view of t-1.
        moving: [H, W], 1 + group, 0 = stands still, in the same view.
        previous: [H, W], the answer for the frame before with the same reference, or None.
        motion_gap: [1 + G, 1 + G], pixels by which two motions differ; index 0 is standing still.
        episode: number of the present episode of motion.
        pixels_per_metre: focal length over distance.
        parameters: see there.
    """
    decision = _Decision(known, previous, episode, pixels_per_metre, parameters)
    moving = np.where(known.label > 0, moving, 0)
    unknown = known.label == UNKNOWN
    boxes = find_objects(np.where(unknown, 0, known.label))
    for a in known.born:
        if a <= len(boxes) and boxes[a - 1] is not None:
            decision.place_known(a, boxes[a - 1], moving, motion_gap)
    unknown_moving = np.where(unknown, moving, 0)
    for g in range(1, int(unknown_moving.max(initial=0)) + 1):
        decision.place_unknown(g, unknown_moving == g)
    decision.name_pieces()
    return Association(decision.label, decision.motion_of, decision.born, decision.next_id)


@dataclass(frozen=True)
class _Piece:
    """A part of the view that becomes an object."""

    box: Region
    inside: NDArray[np.bool_]
    """Its pixels in that box."""
    moving: int
    """1 + its group, 0 = it stands still."""


class _Decision:
    """The labels while they are being decided; lives for one call of `associate`."""

    def __init__(
        self,
        known: KnownObjects,
        previous: NDArray[np.uint16] | None,
        episode: int,
        pixels_per_metre: float,
        parameters: AssociationParameters,
    ) -> None:
        self.known, self.previous, self.episode = known, previous, episode
        self.parameters = parameters
        self.label = known.label.copy()
        self.born = dict(known.born)
        self.next_id = known.next_id
        self.motion_of: dict[int, int] = {}
        self.pieces: list[_Piece] = []
        self.pixels_min = parameters.area_min * pixels_per_metre**2
        radius = max(1, round(parameters.rim * pixels_per_metre))
        self.rim = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * radius + 1, 2 * radius + 1))

    def place_known(self, a: int, box: Region, moving: NDArray[np.int16], motion_gap: NDArray) -> None:
        """Which motion a known object has, that lies in a box of the view, and whether it must be split."""
        inside = self.known.label[box] == a
        area = np.bincount(moving[box][inside], minlength=len(motion_gap))
        main = int(area.argmax())
        if main > 0:
            self.motion_of[a] = main - 1
        for g in np.flatnonzero(area):
            if g == main or area[g] < max(self.parameters.split_share * area.sum(), self.pixels_min):
                continue
            if motion_gap[g, main] < self.parameters.split_flow:
                continue
            part = inside & (moving[box] == g)
            if not self._is_solid(part):
                continue
            if self.born[a] == self.episode and g == 0:
                # It was found in this very episode, and too much of it: give the rest back.
                self.label[box][part] = UNKNOWN
            else:
                self.pieces.append(_Piece(box, part, int(g)))

    def place_unknown(self, g: int, region: NDArray[np.bool_]) -> None:
        """Whose the unknown pixels are that move with group g - 1."""
        if not region.any():
            return
        box = bounding_region(region, margin=len(self.rim))
        region, known, label = region[box], self.known.label[box], self.label[box]
        count, piece, stats, _ = cv2.connectedComponentsWithStats(region.astype(np.uint8), connectivity=4)
        owner = np.zeros(count, np.uint16)
        solid = {
            number
            for number in range(1, count)
            if stats[number, cv2.CC_STAT_AREA] >= self.pixels_min and self._is_solid(piece == number)
        }
        young_first = sorted(
            (a for a, motion in self.motion_of.items() if motion == g - 1),
            key=lambda a: self.born[a] != self.episode,
        )
        for a in young_first:
            near = cv2.dilate((known == a).astype(np.uint8), self.rim) > 0
            for number in np.unique(piece[near & region]):
                if owner[number] == 0 and (self.born[a] == self.episode or number not in solid):
                    owner[number] = a
        label[region] = np.where(owner[piece[region]] > 0, owner[piece[region]], label[region])
        for number in sorted(solid):
            if owner[number] == 0:
                self.pieces.append(_Piece(box, piece == number, g))

    def _is_solid(self, region: NDArray[np.bool_]) -> bool:
        """Whether a region is more than a rim, and large enough."""
        area = np.count_nonzero(region)
        if area < self.pixels_min:
            return False
        opened = cv2.morphologyEx(
            region[bounding_region(region)].astype(np.uint8),
            cv2.MORPH_OPEN,
            self.rim,
            borderType=cv2.BORDER_CONSTANT,
            borderValue=0,
        )
        return bool(np.count_nonzero(opened) >= max(self.pixels_min, 0.4 * area))

    def name_pieces(self) -> None:
        """Label the new objects: by the ids of the frame before where they are the same pieces."""
        former = self._former_ids()
        for number, piece in enumerate(self.pieces):
            a = former.get(number)
            if a is None:
                a = self.next_id
            self.next_id = max(self.next_id, a + 1)
            self.born[a] = self.episode
            self.label[piece.box][piece.inside] = a
            if piece.moving > 0:
                self.motion_of[a] = piece.moving - 1

    def _former_ids(self) -> dict[int, int]:
        """For the pieces that were there in the frame before, their ids; greatest overlap first."""
        if self.previous is None:
            return {}
        overlaps = []
        for number, piece in enumerate(self.pieces):
            candidates, shared = np.unique(self.previous[piece.box][piece.inside], return_counts=True)
            for a, pixels in zip(candidates.tolist(), shared.tolist(), strict=True):
                if a in (0, UNKNOWN) or a in self.known.born:
                    continue
                smaller = min(np.count_nonzero(piece.inside), np.count_nonzero(self.previous == a))
                if pixels >= self.parameters.same_share * smaller:
                    overlaps.append((pixels, number, a))
        former: dict[int, int] = {}
        for _, number, a in sorted(overlaps, reverse=True):
            if number not in former and a not in former.values():
                former[number] = a
        return former
