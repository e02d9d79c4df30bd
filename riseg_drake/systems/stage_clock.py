"""How long each stage works, without the stages knowing who wants to know.

A system marks the method that does its work, an application that cares hands it a clock:

    class OpticalFlow(LeafSystem):
        @timed
        def _calc_flow(self, context, output): ...

    clock = StageClock()
    clock.watch(diagram.GetSystems())
    ...
    clock.seconds["OpticalFlow"]  # one number a call
"""

import functools
from collections import defaultdict
from collections.abc import Callable, Iterable
from time import perf_counter
from typing import Any, TypeVar

from pydrake.systems.framework import System

Method = TypeVar("Method", bound=Callable[..., Any])


class StageClock:
    """Wall time of every call of every watched stage, by the system's name.

    A stage that evaluates its inputs may set other stages to work: their time is theirs alone and is
    taken out of the caller's, so that the times of one frame add up to the whole.
    """

    def __init__(self) -> None:
        self.seconds: dict[str, list[float]] = defaultdict(list)
        """By stage, the time of each call in order, s."""
        self._others: list[float] = []  # for each call under way, the time spent in stages it called

    def watch(self, systems: Iterable[System]) -> None:
        """Time the marked methods of these systems from now on."""
        for system in systems:
            system._stage_clock = self

    def measure(self, stage: str, work: Callable[[], Any]) -> Any:
        """Do the work, book its time under the stage's name, return what the work returned."""
        self._others.append(0.0)
        start = perf_counter()
        try:
            return work()
        finally:
            elapsed = perf_counter() - start
            self.seconds[stage].append(elapsed - self._others.pop())
            if self._others:
                self._others[-1] += elapsed


def timed(method: Method) -> Method:
    """Mark a method of a system as its stage's work; without a clock it costs a look-up."""

    @functools.wraps(method)
    def measured(self: Any, *arguments: Any) -> Any:
        clock: StageClock | None = getattr(self, "_stage_clock", None)
        if clock is None:
            return method(self, *arguments)
        return clock.measure(self.get_name(), lambda: method(self, *arguments))

    return measured  # type: ignore[return-value]
