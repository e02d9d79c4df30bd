"""What is believed of a keyframe: which borders lie inside one body, what has moved, and the ids."""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.rgbd import Immutable
from riseg_drake.segmentation.border_prior import BorderPriorParameters
from riseg_drake.segmentation.keyframe import Keyframe, KeyframeParameters
from riseg_drake.segmentation.observation import Observation
from riseg_drake.segmentation.partition import PartitionParameters


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
    told: bool = True
    """Remember which bodies motion has told apart, wherever they are (`told_apart`)."""
    arrivals: bool = True
    """What stands where nothing stood before has moved, though no motion was found (`arrivals`)."""
    most: float = 12.0
    """Evidence of a border adds up to no more than that, nats, so that it can be revised."""
    strangers: bool = True
    """What falls off its body was no part of it: forget what was known of it as a part (not in the paper)."""
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
    inherited: NDArray[np.float64]
    """[M], how much of the evidence is known of the bodies that the sides belong to, and was not seen here."""
    body: NDArray[np.intp]
    """[N], ids; 0 where nothing has moved yet."""
    next_id: int
    told: NDArray[np.float64]
    """[I, I], nats that speak against two ids' being one body (`told_apart`)."""
    part: NDArray[np.intp]
    """[N], 0.., which superpixels are one body by all that is known: what has not moved, too."""
    shown: NDArray[np.float64]
    """[M], of how many freedoms of a motion these parts on both sides of a border tell."""
    finer: NDArray[np.intp]
    """[L, N], the same if all bonds were weaker."""

    @property
    def divisions(self) -> NDArray[np.intp]:
        """[1 + L, N], 0.., ways to tell which superpixels are one body, the likeliest first."""
        return np.vstack([self.part[None], self.finer])

    @property
    def bond(self) -> NDArray[np.float64]:
        """[M], log-odds that both sides of a border are one body."""
        return self.prior + self.evidence

    def with_evidence(self, seen: Observation, parameters: BeliefParameters) -> "Belief":
        """The same with what one frame adds to the evidence of each border."""
        inherited = np.where(seen.strangers[self.keyframe.borders].any(1), 0.0, self.inherited)
        before = self.alike if parameters.once else np.zeros_like(self.alike)
        alike = np.maximum(before, seen.evidence)
        known = self.evidence - self.inherited + inherited
        evidence = known + np.minimum(seen.evidence, 0.0) + alike - before
        evidence = np.clip(evidence, -parameters.most, parameters.most)
        return replace(self, evidence=evidence, alike=alike, inherited=inherited)
