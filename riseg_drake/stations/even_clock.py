"""One clock for the whole program that goes on evenly, whatever is done to the computer's."""

import time
from collections.abc import Callable

SET = 0.005
"""The computer's clock has been set when it is off by this much, s; less is the time between two looks."""


class EvenClock:
    """Wall time as it was at the start, and since then what a steady clock has counted.

    Stamps of drivers are by the computer's clock, which may be set at any moment; `shift` brings them here.
    """

    def __init__(self, wall: Callable[[], float] = time.time, steady: Callable[[], float] = time.monotonic):
        self._wall, self._steady = wall, steady
        self._start = wall() - steady()
        self._shift = 0.0

    def __call__(self) -> float:
        """The time now, s."""
        return self._start + self._steady()

    def shift(self) -> float:
        """What is to be added to a stamp of now to have it by this clock, s: 0 until the clock is set.

        It stays the same until then, so that stamps keep their differences to the last digit.
        """
        before = self()
        shift = before - self._wall()
        # A program that was kept from running between its two looks learns nothing from them.
        if self() - before < SET / 2 and abs(shift - self._shift) > SET:
            self._shift = shift
        return self._shift
