"""Velocity mode: what commands add up to is not quite where the arm has come to, and how far off it may be.

Velocities that come late or not at all are not made up for; the difference, the drift, is measured where that
can be done: in slow motion, where lag is no part of it, and where the arm stands in a pause.
"""

import numpy as np
from numpy.typing import NDArray

STANDING = 0.1
"""An arm stands still this long after its commands do, s: the driver's filter of 30 Hz has died away."""


class VelocityDrift:
    """`value` is by how much commands are ahead of the arm, rad [7]; less that, they are where it is."""

    GAIN = 3.0
    """Drift is taken back with this rate, 1/s ..."""
    SPEED = 0.01
    """... at most this fast, rad/s, ..."""
    SLOW = 0.1
    """... and only while no joint is faster than this, rad/s: in fast motion lag looks like drift."""
    NOTICED, LEFT = 3e-4, 5e-5
    """Drift counts from the one on, until less than the other is left, rad: seven joints together are then
    within a millimetre at the tip, and noise, of which the filter leaves a ninth, moves nothing."""
    FILTER = 0.2
    """Time constant of the filter of measured drift, s."""
    LAG = 0.0053
    """The driver's low pass of 30 Hz keeps the arm so far behind its commands, s."""

    def __init__(self, period: float):
        """`period` is the time from one command to the next, s."""
        self._period = period
        self._now = -np.inf  # of the last step
        self._unheard = np.zeros(7)  # see `listen`
        self._standing = 0.0  # s, for which the arm has stood in a pause
        self._taken_back = np.zeros(7, bool)
        self.restart()

    def restart(self) -> None:
        """Commands begin where the arm is."""
        self.value, self._seen = np.zeros(7), np.zeros(7)

    def listen(self, now: float, speed: NDArray, heard: float | None) -> None:
        """Take note of how far each joint was told to go since the arm was last heard of: it has gone, or not.

        `speed` [7], rad/s, is that of the commands. `heard` is the time of a status that is new, s; None where
        there is none, or where a silence is still to be explained.
        """
        if heard is not None:
            self._unheard = np.abs(speed) * (now - heard)
        elif np.isfinite(self._now):
            self._unheard = self._unheard + np.abs(speed) * (now - self._now)
        self._now = now

    def has_stood(self, stands: bool) -> bool:
        """Whether in this period the arm has come to stand still; `stands` tells whether its commands do."""
        before = self._standing
        self._standing = before + self._period if stands else 0.0
        return before < STANDING <= self._standing

    def explains(self, told: NDArray, measured: NDArray, displacement: float) -> bool:
        """Whether an arm measured where it is, rad [7], may be there by itself, within `displacement`, rad.

        `told` is what commands add up to. Of velocities that came late, it has followed some and not others.
        """
        return bool((np.abs(told - self.value - measured) - self._unheard <= displacement).all())

    def take_back(self, behind: float, told: NDArray, speed: NDArray, measured: NDArray) -> None:
        """Look at it, and take some of it back, in one period.

        `told`, rad, and `speed`, rad/s, [7] are those of the commands; where the arm was `measured`, rad [7],
        is `behind` them, s.
        """
        if np.abs(speed).max() > self.SLOW:
            self._seen = np.zeros(7)
            return
        # A velocity holds from its command to the next: half a period on the mean, of the one that has passed.
        reached = told - self.value - (behind + self.LAG - self._period / 2) * speed
        share = self._period / (self._period + self.FILTER)
        self._seen = self._seen + share * (reached - measured - self._seen)
        self._taken_back = np.abs(self._seen) > np.where(self._taken_back, self.LEFT, self.NOTICED)
        rate = np.clip(self.GAIN * self._seen, -self.SPEED, self.SPEED)
        self.value = self.value + self._period * rate * self._taken_back
