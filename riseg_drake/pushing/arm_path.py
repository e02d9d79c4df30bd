"""What the arm does over time, for a push and between two of them."""

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray
from pydrake.trajectories import PiecewisePolynomial


class ArmPhase(Enum):
    """What the arm is doing."""

    OBSERVE = "observe"
    """At rest at the observation posture."""
    APPROACH = "approach"
    """From there to where the pusher is lowered behind the object."""
    PUSH = "push"
    """Forward: up to the contact and d_push beyond it."""
    RETREAT = "retreat"
    """Back a little, up, and to the observation posture."""
    DONE = "done"
    """At rest for good: there is nothing more to push."""


@dataclass(frozen=True)
class PushPath:
    """Joint angles over time, from rest at the observation posture to rest there again."""

    trajectory: PiecewisePolynomial
    """[7], rad, over [0, duration] s; velocity and acceleration are continuous."""
    push_start: float
    """When the tip, lowered behind the object, starts to move forward, s."""
    push_end: float
    """When it is d_push beyond the contact, s."""

    @property
    def duration(self) -> float:
        """Of the whole interaction, s."""
        return float(self.trajectory.end_time())

    def position(self, time: float) -> NDArray[np.float64]:
        """Joint angles [7] at a time since the start; the end's beyond it."""
        clamped = min(max(time, 0.0), self.duration)
        return self.trajectory.value(clamped)[:, 0]

    def phase(self, time: float) -> ArmPhase:
        """What the arm does at a time since the start, s."""
        if time < self.push_start:
            return ArmPhase.APPROACH
        return ArmPhase.PUSH if time < self.push_end else ArmPhase.RETREAT
