"""L_t, and what must be remembered for L_t+1: the one state of Alg. 2's line 7."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.rgbd import Frame, Immutable
from riseg_drake.segmentation.belief import Belief
from riseg_drake.segmentation.bodies import Bodies
from riseg_drake.segmentation.comparison import ViewError
from riseg_drake.segmentation.keyframe import Keyframe
from riseg_drake.segmentation.memory import Memory
from riseg_drake.segmentation.missing_motion import Missed
from riseg_drake.segmentation.partition import Margins
from riseg_drake.segmentation.propagation import UNKNOWN


@dataclass(frozen=True)
class Segmentation(Immutable):
    """L_t, and what must be remembered for L_t+1."""

    sequence: int
    """Number of the frame that `label` belongs to; -1 before the first."""
    label: NDArray[np.uint16]
    """[H, W], ids, UNKNOWN where something stands that has not moved yet, 0 for table and robot."""
    margins: Margins = field(default_factory=Margins)
    """By how many nats a border the partition is better than the next best one."""
    settled: float = 0.0
    """The margin that leaves no doubt."""
    belief: Belief | None = None
    """As of the keyframe; None before anything stood on the table."""
    views: tuple[Keyframe, ...] = ()
    """The belief's keyframe in the pixels that frames in motion are compared in; and, if it was seen again
    before anything moved, from there."""
    bodies: Mapping[int, Bodies] = field(default_factory=dict)
    """By frame number, since the pair's reference: the bodies, and how they moved since the keyframe."""
    poses: Mapping[int, NDArray[np.float64]] = field(default_factory=dict)
    """By frame number, since the pair's reference: X_WC [4, 4] as they agree with each other."""
    seen: Frame | None = None
    """The last frame, in as few pixels as is worked with in motion."""
    still_since: float | None = None
    """s; None while something moves."""
    decided: bool = True
    """Whether the present rest has been looked at."""
    said: NDArray[np.float64] | None = None
    """[M], the running mean of the evidence that frames in motion have for the keyframe's borders; None before
    the first."""
    searched: float = float("-inf")
    """s; when a motion that nothing proposed was looked for."""
    missed: Missed = field(default_factory=Missed)
    """What came of that since the keyframe."""
    view_error: ViewError = field(default_factory=ViewError)
    """What the pairs so far have shown of it."""
    memory: Memory = field(default_factory=dict)
    """Points of objects that the keyframe does not see, as of its time."""
    at_reference: tuple[int, NDArray[np.uint16]] | None = None
    """Number of the pair's reference frame and its label [H, W]: all that the literal paper remembers."""

    @property
    def margin(self) -> dict[int, float]:
        """For each id, by how many nats a border the partition is better than the next best one."""
        return self.margins.least

    @property
    def frame(self) -> Frame | None:
        """The last frame, in all its pixels: what `label` is drawn on."""
        return None if self.seen is None else self.seen.whole

    @property
    def mask(self) -> NDArray[np.uint16]:
        """L_t [H, W]: object ids, 0 = background."""
        return np.where(self.label == UNKNOWN, np.uint16(0), self.label)

    @property
    def settled_mask(self) -> NDArray[np.uint16]:
        """L_t [H, W] without the objects in doubt: what needs no further push.

        An id that was seen in motion alone is in doubt until a rest decides on it.
        """
        mask = self.mask
        remembered = dict.fromkeys(self.memory, self.settled)
        margins = {**dict.fromkeys(np.unique(mask).tolist(), 0.0), **remembered, **self.margin}
        doubtful = [a for a, margin in margins.items() if margin < self.settled]
        return np.where(np.isin(mask, doubtful), np.uint16(0), mask) if doubtful else mask

    @property
    def confidence(self) -> dict[int, float]:
        """For each id the probability, by the margin, that it is one object and all of it."""
        return {a: self._sure(margin) for a, margin in self.margin.items()}

    @property
    def untouched_confidence(self) -> float:
        """The same, a probability, of a thing of which motion has said nothing."""
        return self._sure(0.0)

    @property
    def object_ids(self) -> tuple[int, ...]:
        """All ids that are held now, in the view or not; of those that no rest has decided on, what is in the
        mask."""
        ids = set(self.memory) | set(np.unique(self.mask).tolist()) - {0}
        if self.belief is not None:
            newest = self.bodies[max(self.bodies)].body if self.bodies else self.belief.body
            ids |= set(np.unique(newest[(newest > 0) & (newest < self.belief.next_id)]).tolist())
        return tuple(sorted(int(a) for a in ids))

    def _sure(self, margin: float) -> float:
        return float(1 / (1 + np.exp(self.settled - 2 * margin)))


def nothing_segmented(shape: tuple[int, int]) -> Segmentation:
    """L_0: an empty mask [H, W] (Alg. 1, line 3)."""
    return Segmentation(sequence=-1, label=np.zeros(shape, np.uint16))
