"""Targets that come in bursts, played out evenly: what keeps a busy program from stopping the arm.

Whoever plans the motion also segments images, and falls silent for a few tenths of a second every now and
then. So its targets carry the time they are meant for and are played out a little later, by a clock of
their own. Where they run out the clock slows down, smoothly and ahead of time, and the arm with it: it is
late then, but never off its path, and nothing ever jumps.
"""

from bisect import bisect_right
from collections import deque
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from riseg_drake.robot.command_limiter import Target


@dataclass
class PlayoutParameters:
    """How late targets are played out, and how the clock behaves."""

    delay: float = field(default=0.6, metadata={"least": 0.05, "most": 5.0})
    """Targets are played out this long after the time they were meant for, s; silence up to about half of it
    goes unnoticed."""
    slope: float = field(default=2.0, metadata={"least": 0.1, "most": 20.0})
    """The clock's rate changes by at most this much a second, 1/s: from full speed to standstill in 0.5 s."""
    longest: float = field(default=120.0, metadata={"least": 1.0, "most": 3600.0})
    """So much motion may wait at most, s; when the arm is further behind, new targets are refused."""


class TargetPlayout:
    """Targets by time, and the clock that goes through them. Knows no other clock.

    `time` is what is played out now, s, None before the first target; `rate` how fast it goes, 0 to 1.
    """

    REACH = 1.0
    """After a stop the path goes on at most this far from where it was left, s: braking takes the arm some
    tenths ahead, one whose driver died is as far behind; and a path that comes back is not cut short."""
    RESERVE = 0.03
    """The clock stands still this long before the last target, s: the motion beyond is not known yet."""

    def __init__(self, parameters: PlayoutParameters | None = None):
        self._parameters = parameters or PlayoutParameters()
        self._times: deque[float] = deque()
        self._positions: deque[NDArray[np.float64]] = deque()
        self._last_change = -np.inf
        self.time: float | None = None
        self.rate = 0.0

    @property
    def remaining(self) -> float:
        """How much there is still to be played out, s."""
        return 0.0 if self.time is None else self._times[-1] - self.time

    @property
    def in_motion(self) -> bool:
        """Whether targets that move are played out, or wait for it."""
        return self.time is not None and self.time < self._last_change

    def add(self, time: float, position: NDArray) -> None:
        """Take in a target: joint angles [7], rad, for a time, s, later than all before.

        Of a posture that is held the first and the last two are kept: that may take as long as it likes.

        Raises ValueError for a time that is not, and where too much is waiting already.
        """
        if self.time is None:
            self.time = time - self._parameters.delay
        elif time <= self._times[-1]:
            raise ValueError(f"a target for {time} s comes after one for {self._times[-1]} s")
        elif self._last_change - self.time > self._parameters.longest:
            raise ValueError(f"targets of more than {self._parameters.longest} s are waiting")
        self._skip_rest()
        position = np.asarray(position, np.float64)
        if self._positions and not np.array_equal(position, self._positions[-1]):
            self._last_change = time
        elif len(self._positions) > 3 and np.array_equal(position, self._positions[-4]):
            self._times[-2], self._times[-1] = self._times[-1], time
            return
        self._times.append(time)
        self._positions.append(position)

    def advance(self, period: float) -> Target | None:
        """Go on by one period, s; what to be at then, or None before the first target."""
        if self.time is None:
            return None
        wanted = float(np.sqrt(2 * self._parameters.slope * max(self.remaining - self.RESERVE, 0.0)))
        change = self._parameters.slope * period
        self.rate = float(np.clip(min(wanted, 1.0), self.rate - change, self.rate + change))
        self.time = min(self.time + self.rate * period, self._times[-1])
        self._skip_rest()
        self._forget()
        return self._at(self.time)

    def halt(self) -> None:
        """Stand still: what is played out next starts slowly."""
        self.rate = 0.0

    def drop(self) -> None:
        """Forget all targets: a motion that will not be gone on with."""
        self._times.clear()
        self._positions.clear()
        self._last_change, self.time, self.rate = -np.inf, None, 0.0

    def resume_near(self, position: NDArray) -> None:
        """Go on from the point of the path nearest to `position` [7], a little ahead or behind."""
        if self.time is not None:
            self.time = self._nearest(position)[1]

    def distance(self, position: NDArray) -> float:
        """How far `position` [7] is from the part of the path where `resume_near` looks, rad; 0 without any."""
        return 0.0 if self.time is None else self._nearest(position)[0]

    def _nearest(self, position: NDArray) -> tuple[float, float]:
        """Distance, rad, and time, s, of the nearest point of the path within REACH s."""
        assert self.time is not None
        near = [k for k, time in enumerate(self._times) if abs(time - self.time) <= self.REACH]
        times = [self.time, *(self._times[k] for k in near)]
        positions = np.array([self._at(self.time).position, *(self._positions[k] for k in near)])
        distances = np.abs(positions - position).max(axis=1)
        nearest = int(np.argmin(distances))
        return float(distances[nearest]), times[nearest]

    def _skip_rest(self) -> None:
        """Where nothing moves go to where the clock should be: nothing is lost by it, or seen."""
        if self.time is not None and self._times and not self.in_motion:
            self.time = max(self._last_change, self._times[-1] - self._parameters.delay)

    def _forget(self) -> None:
        """Drop what neither interpolation nor the way back to the path needs any more."""
        assert self.time is not None
        while len(self._times) > 3 and self._times[2] < self.time - self.REACH:
            self._times.popleft()
            self._positions.popleft()

    def _at(self, time: float) -> Target:
        """Position (a cubic between targets), velocity and acceleration with respect to wall time.

        The targets' own derivatives are differences between neighbours; at both ends they stand still.
        """
        k = self._interval(time)
        if k is None:
            end = self._positions[0] if time < self._times[0] else self._positions[-1]
            return Target(end, np.zeros(7), np.zeros(7))
        before, after = self._times[k], self._times[k + 1]
        h = after - before
        q_0, q_1 = self._positions[k], self._positions[k + 1]
        v_0, a_0 = self._derivatives(k)
        v_1, a_1 = self._derivatives(k + 1)
        s = (time - before) / h
        position = (
            (1 + 2 * s) * (1 - s) ** 2 * q_0
            + s * (1 - s) ** 2 * h * v_0
            + s**2 * (3 - 2 * s) * q_1
            + s**2 * (s - 1) * h * v_1
        )
        velocity = 6 * s * (1 - s) * (q_1 - q_0) / h + (1 - s) * (1 - 3 * s) * v_0 + s * (3 * s - 2) * v_1
        acceleration = (1 - s) * a_0 + s * a_1
        return Target(position, self.rate * velocity, self.rate**2 * acceleration)

    def _interval(self, time: float) -> int | None:
        """k with times[k] <= time < times[k + 1]; None outside."""
        k = bisect_right(self._times, time) - 1
        return k if 0 <= k < len(self._times) - 1 else None

    def _derivatives(self, k: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Velocity and acceleration at target k."""
        if k == 0 or k == len(self._times) - 1:
            return np.zeros(7), np.zeros(7)
        earlier = (self._positions[k] - self._positions[k - 1]) / (self._times[k] - self._times[k - 1])
        later = (self._positions[k + 1] - self._positions[k]) / (self._times[k + 1] - self._times[k])
        return (earlier + later) / 2, 2 * (later - earlier) / (self._times[k + 1] - self._times[k - 1])
