"""Where the arm was a moment ago: pictures arrive late, and belong to the joint angles of their own time."""

from bisect import bisect_right

import numpy as np
from numpy.typing import NDArray


class PositionHistory:
    """Joint angles and velocities by time, in whatever order they come in.

    What lies more than `span` s, and up to twice that, from the one that came last is forgotten, before it and
    after: a time that was wrong is gone as soon as the next one has come.
    """

    def __init__(self, span: float = 5.0):
        self._span = span
        self._times: list[float] = []
        self._states: list[NDArray[np.float64]] = []

    def add(self, time: float, position: NDArray, velocity: NDArray) -> None:
        """Take in what the arm said: [7] rad and [7] rad/s at a time, s; what was said twice counts once."""
        place = bisect_right(self._times, time)
        if place and self._times[place - 1] == time:
            return
        self._times.insert(place, time)
        self._states.insert(place, np.concatenate([position, velocity]))
        if self._times[-1] - self._times[0] > 2 * self._span:  # now and then, many at a time
            old = bisect_right(self._times, time - self._span)
            ahead = bisect_right(self._times, time + self._span)
            self._times, self._states = self._times[old:ahead], self._states[old:ahead]

    @property
    def newest(self) -> float:
        """Time of the latest, s; minus infinity while there is none."""
        return self._times[-1] if self._times else -np.inf

    def at(self, time: float) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
        """Position and velocity [7] at a time, s, on the straight line between its neighbours.

        None for a time before the first or after the last: nothing is guessed.
        """
        later = bisect_right(self._times, time)
        if later == 0 or (later == len(self._times) and self._times[-1] != time):
            return None
        if later == len(self._times):
            state = self._states[-1]
        else:
            share = (time - self._times[later - 1]) / (self._times[later] - self._times[later - 1])
            state = self._states[later - 1] + share * (self._states[later] - self._states[later - 1])
        return state[:7].copy(), state[7:].copy()
