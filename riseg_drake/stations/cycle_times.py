"""How long the cycles of a loop took, for days, in memory that does not grow."""

from array import array

RESOLUTION = 1e-5
"""Times are told apart by this much, s."""
MOST = 0.1
"""Longer ones are counted as of this much, s."""


class CycleTimes:
    """Counts times in bins of RESOLUTION, which are there from the beginning: nothing is allocated in the loop.

    `count` is how many there were, `longest` the longest, s.
    """

    def __init__(self) -> None:
        self._bins = array("q", [0] * (round(MOST / RESOLUTION) + 1))
        self.count = 0
        self.longest = 0.0

    def add(self, seconds: float) -> None:
        """One more took so long, s."""
        self._bins[min(int(seconds / RESOLUTION), len(self._bins) - 1)] += 1
        self.count += 1
        self.longest = max(self.longest, seconds)

    def percentile(self, percent: float) -> float:
        """The time, s, that so many in a hundred did not exceed, up to RESOLUTION more; 0 of none."""
        passed = 0
        for index, number in enumerate(self._bins):
            passed += number
            if number and 100 * passed >= percent * self.count:
                return min((index + 1) * RESOLUTION, self.longest)
        return 0.0

    def told(self) -> str:
        """All of it in one line."""
        p50, p999 = self.percentile(50), self.percentile(99.9)
        return (
            f"{1e3 * p50:.2f} ms (median), {1e3 * p999:.2f} ms (99.9 % take no longer), "
            f"{1e3 * self.longest:.2f} ms (longest) in {self.count} cycles"
        )
