"""An even stream of commands from a process that is not always woken in time.

Every command is that of a whole number of periods after the one before, and carries the time that it was
planned for as its stamp, not the time at which the process came to send it. So whoever judges the stream by
its stamps sees the trajectory as it was planned, whatever kept the process from running, and wherever in
its work that happened.

A driver holds the last command until the next. After a short pause the arm is still about where the
trajectory has got to, and the trajectory makes up for it in one step. After a long one the arm has come to
rest at the last command: the trajectory begins there again, at rest.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from riseg_drake.robot.command_stream import VELOCITY, ArmStatus, CommandStream

LONGEST_PAUSE = 0.05
"""The longest pause that is made up for, s: half the driver's expiry. An arm at 0.3 rad/s brakes in 40 ms."""
STILL, STILL_FOR = 0.002, 0.02
"""An arm that has been left alone has come to rest where no joint turns by more than the one, rad, in the
other, s: below 0.1 rad/s it stops within a milliradian."""


@dataclass(frozen=True)
class StampedCommand:
    """One command to be sent."""

    values: NDArray[np.float64]
    """Joint angles, rad, or velocities, rad/s, [7] by mode."""
    stamp: float
    """The wall time that it was planned for, s."""
    planned: float
    """The same by the steady clock, s."""

    def is_in_time(self, steady: float) -> bool:
        """Whether it may be sent at a time, s; else it is to be forgotten, and counts as a pause."""
        return steady - self.planned <= LONGEST_PAUSE


class PacedCommands:
    """A CommandStream on the clocks of the process that sends its commands; the clocks are given, not asked."""

    def __init__(self, stream: CommandStream, steady: float):
        """`steady` is the time by a steady clock at which the first command is due, s."""
        self._stream = stream
        self._period = stream.period
        self._due = self._followed = steady
        self._last: NDArray[np.float64] | None = None
        self._is_coasting = False
        self._seen: ArmStatus | None = None  # while it is coasting

    def next(
        self, steady: float, wall: float, status: ArmStatus | None, image_time: float | None
    ) -> StampedCommand | None:
        """The command that is due now, by both clocks, s; None while there is none.

        Status and pictures tell their time by the steady clock.
        """
        if steady - self._followed > LONGEST_PAUSE:
            self._is_coasting, self._seen = self._last is not None, None
            self._due = steady
        if self._is_coasting and status is not None:
            self._begin_at_rest(status, steady)
        return self._due_now(steady, wall, lambda: self._stream.step(steady, status, image_time))

    def brake(self, steady: float, wall: float) -> StampedCommand | None:
        """The same, by both clocks, s, for an arm that must come to rest whatever is known of it."""
        if steady - self._followed > LONGEST_PAUSE and self._last is not None:
            self._stream.begin_at_rest(self._last)
            self._due = steady
        return self._due_now(steady, wall, self._stream.brake)

    def _due_now(
        self, steady: float, wall: float, step: Callable[[], NDArray[np.float64] | None]
    ) -> StampedCommand | None:
        periods = 1 + max(int((steady - self._due) / self._period), 0)
        planned = self._due + (periods - 1) * self._period
        stamp = wall - (steady - planned)
        for _ in range(periods):
            values = step()
            self._due += self._period  # one by one: what fails half way is gone on with from there
        if values is None:
            self._followed, self._last = planned, None
            return None
        return StampedCommand(values, stamp, planned)

    def was_sent(self, command: StampedCommand) -> None:
        """Take note of it: it is what the driver holds until the next."""
        self._followed, self._last = command.planned, self._stream.position

    def wait(self, steady: float) -> float:
        """How long there is nothing to do, s."""
        return max(self._due - steady, 0.0)

    def _begin_at_rest(self, status: ArmStatus, now: float) -> None:
        """At the last command in position mode, and wherever the arm comes to in velocity mode.

        There it has gone on with the last velocity until that expired, brakes now that commands are zero, and
        what it has told meanwhile may be as old as the pause was long.
        """
        if self._stream.mode != VELOCITY:
            assert self._last is not None
            self._stream.begin_at_rest(self._last)
            self._is_coasting = False
            return
        self._stream.begin_at_rest(status.position)
        if self._seen is None or status.time - self._seen.time >= STILL_FOR:
            turned = np.inf if self._seen is None else np.abs(status.position - self._seen.position).max()
            is_recent = now - status.time <= LONGEST_PAUSE
            self._seen = status
            self._is_coasting = not (is_recent and turned <= STILL)
