"""How calm the motion is that the robot sets itself: what is left when libfranka has smoothed the commands.

A stream may be smooth by itself and yet come out of the low pass and the rate limiter at its limits in most
ticks, as positions do that are held for five ticks each. So the output is judged, tick by tick.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from riseg_drake.stations.rate_limiter import RateLimiter

AT_LIMIT = 0.999
"""From this share of a limit on a joint counts as being at it."""
_STANDING = 1e-3  # rad/s; ticks in which no joint is faster are not counted


@dataclass(frozen=True)
class MotionVerdict:
    """Of all ticks in motion; shares are of the limits of the joint where they are largest."""

    seconds: float = 0.0
    """In motion, s."""
    acceleration_rms: float = 0.0
    acceleration_largest: float = 0.0
    jerk_rms: float = 0.0
    jerk_largest: float = 0.0
    at_limit: float = 0.0
    """Share of the ticks in which a joint was at a limit of velocity, acceleration or jerk."""

    def __str__(self) -> str:
        return (
            f"in {self.seconds:.1f} s of motion: acceleration {self.acceleration_rms:.3f} of the limit rms, "
            f"{self.acceleration_largest:.3f} at most; jerk {self.jerk_rms:.3f} rms, "
            f"{self.jerk_largest:.3f} at most; at a limit in {100 * self.at_limit:.2f} % of the robot's ticks"
        )


class MotionJudge:
    """Takes in what the robot sets itself, one tick of 1 ms after the other."""

    def __init__(self, limiter: RateLimiter):
        self._limiter = limiter
        self._ticks = self._ticks_at_limit = 0
        self._squares = np.zeros((2, 7))  # sums over ticks: acceleration, jerk, in shares of the limits
        self._largest = np.zeros((2, 7))

    def take(self, q: NDArray, v: NDArray, a: NDArray, jerk: NDArray) -> None:
        """A tick: where it began, rad, and its velocity, acceleration and jerk, each [7], in rad and s."""
        if np.abs(v).max() <= _STANDING:
            return
        shares = np.stack([a / self._limiter.acceleration, jerk / self._limiter.jerk])
        lower, upper = self._limiter.velocity_range(q)
        self._ticks += 1
        self._squares += shares**2
        np.maximum(self._largest, np.abs(shares), out=self._largest)
        at_limit = (np.abs(shares) >= AT_LIMIT).any() or (v <= AT_LIMIT * lower).any()
        self._ticks_at_limit += bool(at_limit or (v >= AT_LIMIT * upper).any())

    def verdict(self) -> MotionVerdict:
        """On all ticks so far."""
        ticks = max(self._ticks, 1)
        (a_rms, j_rms), (a_most, j_most) = np.sqrt(self._squares / ticks).max(axis=1), self._largest.max(axis=1)
        return MotionVerdict(
            1e-3 * self._ticks,
            float(a_rms),
            float(a_most),
            float(j_rms),
            float(j_most),
            self._ticks_at_limit / ticks,
        )
