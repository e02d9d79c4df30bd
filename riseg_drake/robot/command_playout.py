"""Commands by their stamps, played out a little later: what an arm's driver follows between two of them.

A sender's commands come every 5 ms or so, by a process and a network that are not always on time; the robot
wants one every millisecond. Played out `DELAY` behind their stamps they are nearly always there when they are
needed, with others after them, so that a smooth curve leads through them.
"""

from collections import deque

import numpy as np
from numpy.typing import NDArray

from riseg_drake.robot.command_limiter import Target

DELAY = 0.02
"""Commands are played out this long after their stamps, s: four periods of a sender at 200 Hz."""
COAST = 0.02
"""Beyond the newest command its motion is gone on with for so long, s; then the arm has to brake. With DELAY
that makes 40 ms of silence that nobody notices; an arm at 0.3 rad/s goes 6 mrad too far in it at most."""
_KEPT = 0.05  # s, behind what is played out
_GAP = 0.1  # s; neighbours further apart belong to two streams


class CommandPlayout:
    """One stream of commands, all of joint angles or all of velocities. Knows no clock.

    Between joint angles there is a cubic, whose velocities at the commands are differences of neighbours;
    between velocities a straight line, and their sum is the path that the sender means.
    """

    def __init__(self, is_velocity: bool):
        self._is_velocity = is_velocity
        self._stamps: deque[float] = deque()
        self._values: deque[NDArray[np.float64]] = deque()
        self._positions: deque[NDArray[np.float64]] = deque()  # what velocities sum up to
        self._velocities: deque[NDArray[np.float64]] = deque()

    @property
    def newest(self) -> float:
        """Stamp of the newest command, s; minus infinity before the first."""
        return self._stamps[-1] if self._stamps else -np.inf

    def begin(self) -> None:
        """Forget all commands: the next ones are of another stream."""
        self._stamps.clear()
        self._values.clear()
        self._positions.clear()
        self._velocities.clear()

    def add(self, stamp: float, values: NDArray, here: NDArray) -> None:
        """Take in a command, rad or rad/s [7], with its stamp, s; one that is not newer than all is left out.

        The first velocities of a stream start from `here`, rad [7].
        """
        if stamp <= self.newest:
            return
        if not self._is_velocity:
            position = values
        elif not self._stamps:
            position = np.array(here)
        else:
            mean = (self._values[-1] + values) / 2
            position = self._positions[-1] + (stamp - self._stamps[-1]) * mean
        self._stamps.append(stamp)
        self._values.append(values)
        self._positions.append(position)
        self._velocities.append(values)
        if not self._is_velocity:  # once a command, and not in each of the robot's cycles
            for k in range(max(len(self._stamps) - 2, 0), len(self._stamps)):
                self._velocities[k] = self._slope(k)

    def moves(self, least: float = 1e-4) -> bool:
        """Whether the newest commands are of a motion, of more than `least` rad/s in any joint."""
        return bool(self._stamps) and bool(np.abs(self._velocities[-1]).max() > least)

    def at(self, time: float) -> Target | None:
        """What to be at, at a time by the clock of the stamps, s; None where no command says that."""
        if not self._stamps or time > self._stamps[-1] + COAST:
            return None
        while len(self._stamps) > 3 and self._stamps[2] < time - _KEPT:
            self._stamps.popleft()
            self._values.popleft()
            self._positions.popleft()
            self._velocities.popleft()
        if time <= self._stamps[0]:
            return Target(self._positions[0], np.zeros(7), np.zeros(7))
        last = len(self._stamps) - 1
        if time >= self._stamps[last]:
            velocity = self._velocities[last]
            ahead = time - self._stamps[last]
            return Target(self._positions[last] + ahead * velocity, velocity, np.zeros(7))
        k = last - 1
        while self._stamps[k] > time:
            k -= 1
        return self._line(k, time) if self._is_velocity else self._cubic(k, time)

    def _line(self, k: int, time: float) -> Target:
        since, T = time - self._stamps[k], self._stamps[k + 1] - self._stamps[k]
        slope = (self._values[k + 1] - self._values[k]) / T
        velocity = self._values[k] + since * slope
        return Target(self._positions[k] + since * (self._values[k] + velocity) / 2, velocity, slope)

    def _cubic(self, k: int, time: float) -> Target:
        T = float(self._stamps[k + 1] - self._stamps[k])
        s = (time - self._stamps[k]) / T
        q_0, v_0, v_1 = self._values[k], T * self._velocities[k], T * self._velocities[k + 1]
        chord = self._values[k + 1] - q_0
        c_2, c_3 = 3 * chord - 2 * v_0 - v_1, v_0 + v_1 - 2 * chord
        position = q_0 + s * (v_0 + s * (c_2 + s * c_3))
        velocity = (v_0 + s * (2 * c_2 + 3 * s * c_3)) / T
        return Target(position, velocity, (2 * c_2 + 6 * s * c_3) / T**2)

    def _slope(self, k: int) -> NDArray[np.float64]:
        """rad/s [7] at a command of joint angles: the parabola's through its neighbours."""
        last = len(self._stamps) - 1
        if last == 0:
            return np.zeros(7)
        if k in (0, last):
            before, after = (0, 1) if k == 0 else (last - 1, last)
            gap = self._stamps[after] - self._stamps[before]
            return np.zeros(7) if gap > _GAP else (self._values[after] - self._values[before]) / gap
        since, until = self._stamps[k] - self._stamps[k - 1], self._stamps[k + 1] - self._stamps[k]
        earlier = (self._values[k] - self._values[k - 1]) / since
        later = (self._values[k + 1] - self._values[k]) / until
        return (until * earlier + since * later) / (since + until)
