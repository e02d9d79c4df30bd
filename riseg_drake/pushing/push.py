"""The paper's action a_i: one push."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.rgbd import Immutable
from riseg_drake.pushing.arm_path import PushPath


@dataclass(frozen=True)
class Push(Immutable):
    """a_i = (b, bc, d_push), as the robot will do it."""

    p_WE: NDArray[np.float64]
    """[3], where the tip E is lowered to, `clearance` (and half the tip) behind the contact, m."""
    tip_height: float
    """Height of the tip during the push above the table, or above what carries the target where that lies on
    other things, m."""
    direction_W: NDArray[np.float64]
    """[2], unit vector bc on the table."""
    p_WB: NDArray[np.float64]
    """[3], the contact b on the tip's face, m; an arrow goes from here along the direction."""
    length: float
    """How far E travels forward, m: the clearance and d_push."""
    d_push: float
    """How far beyond the contact, m."""
    center_W: NDArray[np.float64]
    """[2], the center c of the cluster that is pushed, m."""
    cluster_W: NDArray[np.float64]
    """[M, 2], the cluster's points P, m."""
    tallest: float
    """Height of the tallest object, m, above what `tip_height` is told from: the pusher crosses above it."""
    cost: float
    """What is lost of one object: less the more objects the push can be expected to settle."""
    turned: bool = False
    """Whether the tool pushes with its back, turned by half a turn: the arm gets to other places so, and a
    camera on the wrist looks at the target from the other side, past the tool."""
    path: PushPath | None = field(default=None, repr=False)
    """The arm's way there and back; None until it has been planned."""

    @property
    def ahead_W(self) -> NDArray[np.float64]:
        """[2], E's x axis: where the tool's front points."""
        return -self.direction_W if self.turned else self.direction_W

    @property
    def yaw(self) -> float:
        """Of the tool, the direction of E's x axis about W's z, rad."""
        return float(np.arctan2(self.ahead_W[1], self.ahead_W[0]))


NO_PUSH = Push(
    p_WE=np.zeros(3),
    tip_height=0.0,
    direction_W=np.zeros(2),
    p_WB=np.zeros(3),
    length=0.0,
    d_push=0.0,
    center_W=np.zeros(2),
    cluster_W=np.zeros((0, 2)),
    tallest=0.0,
    cost=np.inf,
)
"""The paper's a_i = null, where a push goes through ports."""
