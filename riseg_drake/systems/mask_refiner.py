"""MaskRefiner: the outlines of L*_t made sharper by a slow model, which no frame waits for."""

import os
import sys
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, EventStatus, LeafSystem, State

from riseg_drake.geometry.rgbd import NO_MASK, NO_PAIR, Frame, Immutable
from riseg_drake.pushing.arm_path import ArmPhase
from riseg_drake.systems.memory import replace_memory
from riseg_drake.systems.value_input import ValueInput

Refinement = Callable[[Frame, NDArray[np.uint16]], NDArray[np.uint16]]
"""Makes of a frame and its mask [H, W] a better mask [H, W] with the same ids. It is called in a thread of its
own, one call after the other."""

_NICENESS = 10
"""By how much the worker is nicer, on Linux: while frames have work to do, the processor is theirs."""

_NO_DEMAND = object()


@dataclass(frozen=True)
class RefinedMask(Immutable):
    """What became of a mask."""

    time: float
    """Of the frame that it belongs to, s."""
    mask: NDArray[np.uint16]
    """[H, W], ids as in L_t."""


NO_REFINED_MASK = RefinedMask(-np.inf, NO_MASK)
"""What there is before the first."""


@dataclass(frozen=True)
class _Memory(Immutable):
    """All that MaskRefiner remembers. Never changed, only replaced."""

    refined: RefinedMask = NO_REFINED_MASK
    under_way: tuple[Future, ...] = ()
    """Oldest first."""
    at_rest: tuple[Frame, NDArray[np.uint16]] | None = None
    """The last frame, with its mask, that was seen from the observation posture."""
    demand: Any = _NO_DEMAND
    """The last one that was met."""


class MaskRefiner(LeafSystem):
    """Refines the mask of every interaction step, in the background.

    When the arm leaves the observation posture, or is done, the last mask that was seen from there (that is
    L*_t, line 10 of Alg. 1) goes to a worker; its answer appears at the output some frames later. No update
    ever waits for the worker.

    Inputs:
        pair: FramePair.
        mask: L_t of its current frame [H, W].
        phase: ArmPhase.
        demand: any object, may be left unconnected; when it changes, the present mask is refined as well.

    Outputs:
        refined: RefinedMask, the newest; NO_REFINED_MASK before the first.
    """

    def __init__(self, refine: Refinement, period: float, offset: float) -> None:
        """Look every `period` s, `offset` s after the camera's tick and after the mask's."""
        super().__init__()
        self.set_name("MaskRefiner")
        self._refine = refine
        self._worker = ThreadPoolExecutor(1, "MaskRefiner", initializer=_stand_back)
        self._pair = ValueInput(self, "pair", NO_PAIR)
        self._mask = ValueInput(self, "mask", NO_MASK)
        self._phase = ValueInput(self, "phase", ArmPhase.OBSERVE)
        self._demand = ValueInput(self, "demand", _NO_DEMAND)
        self._memory = self.DeclareAbstractState(AbstractValue.Make(_Memory()))
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, offset, self._update)
        self.DeclareAbstractOutputPort(
            "refined",
            AbstractValue.Make(NO_REFINED_MASK).Clone,
            lambda context, output: output.set_value(self._recall(context).refined),
            prerequisites_of_calc={self.all_state_ticket()},
        )

    def finish(self, context: Context) -> list[RefinedMask]:
        """Wait for what is under way in this system's context; what it brings, oldest first.

        For an application that ends, when no update will come any more: the last mask seen at rest is
        refined, too. An error of the refinement is raised here, as it is in an update.
        """
        memory = self._recall(context)
        if memory.at_rest is not None:
            memory = self._begin(memory, *memory.at_rest)
        return [future.result() for future in memory.under_way]

    def _recall(self, context: Context) -> _Memory:
        return context.get_abstract_state(int(self._memory)).get_value()

    def _update(self, context: Context, state: State) -> EventStatus:
        after = self._next(self._recall(context), context)
        return replace_memory(context, state, self._memory, after)

    def _next(self, memory: _Memory, context: Context) -> _Memory:
        if memory.under_way and memory.under_way[0].done():
            # One an update, so that whoever watches the output misses none.
            memory = replace(memory, refined=memory.under_way[0].result(), under_way=memory.under_way[1:])
        pair = self._pair.Eval(context)
        if pair is NO_PAIR:
            return memory
        seen = memory.at_rest
        if self._phase.Eval(context) is ArmPhase.OBSERVE:
            if seen is None or seen[0] is not pair.current:
                memory = replace(memory, at_rest=(pair.current, self._mask.Eval(context)))
        elif seen is not None:
            memory = replace(self._begin(memory, *seen), at_rest=None)
        if self._demand.HasValue(context):
            demand = self._demand.Eval(context)
            if memory.demand is not _NO_DEMAND and demand != memory.demand:
                memory = self._begin(memory, pair.current, self._mask.Eval(context))
            if demand != memory.demand:
                memory = replace(memory, demand=demand)
        return memory

    def _begin(self, memory: _Memory, frame: Frame, mask: NDArray[np.uint16]) -> _Memory:
        future = self._worker.submit(self._work, frame, mask.copy())
        return replace(memory, under_way=(*memory.under_way, future))

    def _work(self, frame: Frame, mask: NDArray[np.uint16]) -> RefinedMask:
        return RefinedMask(frame.time, self._refine(frame, mask))


def _stand_back() -> None:
    """Let other threads go first: on Linux each thread, and those that it starts, has its own niceness."""
    if sys.platform == "linux":  # elsewhere the whole process has one niceness
        os.nice(_NICENESS)
