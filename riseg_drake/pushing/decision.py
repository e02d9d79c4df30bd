"""What Alg. 3 decides: a push, or why there is none."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from math import isnan

from riseg_drake.geometry.rgbd import Immutable
from riseg_drake.pushing.push import NO_PUSH, Push


class Ending(Enum):
    """Why a run ends. The first three are Alg. 3's null, the others the loop's."""

    NOTHING_LEFT = "nothing_left"
    """Everything that stands on the table is segmented, and nothing is in doubt."""
    NOTHING_VALID = "nothing_valid"
    """Something is left or in doubt, but no push of it passes every criterion."""
    NO_PATH = "no_path"
    """There are valid pushes, but the arm can do none of them."""
    ENOUGH_INTERACTIONS = "enough_interactions"
    """As many pushes as a run may have were made."""
    TIME = "time"
    """The run took as long as it may."""


class Criterion(Enum):
    """What a push must pass to be valid: the paper's three (Alg. 3, line 10), and those of a tool on a table.

    Each stands for the function or the field of that name; its value says what is wrong where it fails.
    """

    CENTER_ON_OBJECT = "the cluster's center does not lie on an object"
    ACCESSIBLE = "the area that the end effector needs is not free"
    MOVES_ALONE = "too much of the cluster would be pushed onto other objects"
    HIGH_ENOUGH = "the tool would have to come too close to the table"
    ONLY_TARGET = "the tool would meet other things, too"
    ROOM_BELOW_THE_TOOL = "things are too tall for what of the tool is beside its tip"
    STAYS_IN_WORK_AREA = "the cluster would be driven out of the work area"
    STAYS_ON_TOP = "the cluster would be pushed off what it lies on"
    NOT_IN_VAIN = "too little is to be expected of it, or it was tried before"


class PathStage(Enum):
    """What the arm must be able to do for a push; its value says what is wrong where it cannot."""

    ROOM_BELOW_THE_FLANGE = "things on the table are as tall as the tool is long"
    POSTURE = "no posture brings the tip behind the object"
    STROKE = "the arm cannot follow the stroke"
    DESCENT = "the arm cannot come straight down behind the object"
    CROSSING = "the arm cannot get there from where it looks"
    DURATION = "the way there takes too long"


@dataclass(frozen=True)
class Decision(Immutable):
    """A push with its path, or the reason why there is none."""

    push: Push = NO_PUSH
    ending: Ending | None = None
    """Why there is no push; None where there is one, and before the first frame."""
    unsettled_area: float = float("nan")
    """objsToSegment, what is yet to be segmented, m^2 on the table; NaN before the first frame."""
    doubtful_area: float = 0.0
    """The part of it, m^2, that has moved, and may be one object or two."""
    candidates: int = 0
    """Without a valid push: the candidates there were; without a path: the valid pushes that were tried."""
    failed: Mapping[Criterion | PathStage, int] = field(default_factory=dict)
    """How many of these fail each criterion (one may fail several), or at which stage of the path."""

    @property
    def fails_most(self) -> Criterion | PathStage | None:
        """What most candidates fail; None where there was none."""
        return max(self.failed, key=lambda criterion: self.failed[criterion], default=None)

    @property
    def why(self) -> str:
        """Why there is no push, in words; empty where there is one, and before the first frame."""
        if self.ending is None or isnan(self.unsettled_area):
            return ""
        if self.ending is Ending.NOTHING_LEFT:
            return "nothing is left to find"
        unmoved = 1e4 * (self.unsettled_area - self.doubtful_area)
        areas = [f"{unmoved:.0f} cm^2 are left to find"] if unmoved > 0 or not self.doubtful_area else []
        areas += [f"{1e4 * self.doubtful_area:.0f} cm^2 are in doubt"] if self.doubtful_area else []
        area = ", ".join(areas)
        if self.ending is Ending.NOTHING_VALID:
            what = f"no push is valid, {area}"
        elif self.ending is Ending.NO_PATH:
            what = f"the arm has no path for any valid push, {area}"
        else:
            return area
        most = self.fails_most
        if most is None:
            return f"{what}: none of it borders on free table"
        return f"{what}: {most.value} ({self.failed[most]} of {self.candidates})"


UNDECIDED = Decision()
"""Before the first frame."""
