"""Alg. 1: the robot acts and segments, and every interaction leaves L*_t behind."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, EventStatus

from riseg_drake.app.diagram import WiredDiagram
from riseg_drake.app.output import Step
from riseg_drake.evaluation.disturbance import Disturbance, motion_between, object_at
from riseg_drake.evaluation.scores import score
from riseg_drake.geometry.rgbd import Frame
from riseg_drake.pushing.push import ArmPhase, Push
from riseg_drake.systems.stage_clock import StageClock

Listener = Callable[[Frame, Context], None]
"""Is told every camera frame once, with the diagram's context at that moment."""


@dataclass
class Progress:
    """How far a run has come; renewed at every camera frame."""

    interaction_step: int = 0
    """The interaction that is under way; 0 before the first."""
    phase: ArmPhase = ArmPhase.OBSERVE
    objects: int = 0
    """Objects found so far."""
    time: float = 0.0
    """Simulated, s."""
    frames: int = 0
    end: str = ""
    """Why the run ended; empty while it goes on."""


def interactions(
    wired: WiredDiagram,
    clock: StageClock,
    progress: Progress,
    longest: float,
    listeners: tuple[Listener, ...] = (),
) -> Iterator[Step]:
    """Run Alg. 1; yields how things stand before the first and after every interaction.

    It ends when the arm is done (no push is left, a_i = null, or enough were made), or when `longest`
    seconds were simulated; `progress.end` says which.
    """
    clock.watch(wired.stages)
    simulator = Simulator(wired.diagram)
    context = simulator.get_mutable_context()
    news = _News(wired)
    simulator.set_monitor(news.look)
    book = _Book(wired, context, clock)
    simulator.Initialize()
    while not progress.end:  # line 4
        simulator.AdvanceTo(longest)  # lines 5 to 8, up to the next mask or the arm's next phase
        if news.mask_is_new:
            news.mask_is_new = False
            progress.frames += 1
            progress.objects = len(wired.segmentation(context).object_ids)
            book.count(news.frame, is_at_rest=news.phase is ArmPhase.OBSERVE)
            for listener in listeners:
                listener(news.frame, context)
        decided = progress.phase is ArmPhase.OBSERVE and news.phase is not ArmPhase.OBSERVE
        progress.time, progress.phase = context.get_time(), news.phase
        if decided:
            yield book.close(wired.interaction_step(context))  # line 10
            progress.interaction_step += 1  # line 9
        if news.phase is ArmPhase.DONE:
            made = wired.interaction_step(context)
            enough = made >= wired.most_interactions
            progress.end = (
                f"{made} of {made} interactions were made" if enough else "no push is left that could find more"
            )
        elif progress.time >= longest:
            progress.end = f"{longest:g} s were simulated"


class _Seen(NamedTuple):
    frame: Frame
    mask: NDArray[np.uint16]
    true_labels: NDArray[np.uint16]
    true_poses: dict[str, NDArray[np.float64]]


class _News:
    """Stops the simulator when there is a new mask, or the arm begins something else."""

    frame: Frame
    """I_t of the newest mask; not there before the first."""

    def __init__(self, wired: WiredDiagram):
        self.phase = ArmPhase.OBSERVE
        self.mask_is_new = False
        self._wired = wired
        self._sequence = -1

    def look(self, context: Context) -> EventStatus:
        """The simulator's monitor; it is called after every step, hundreds of times a second."""
        phase = self._wired.phase(context)
        sequence = self._wired.segmentation(context).sequence
        if phase is self.phase and sequence == self._sequence:
            return EventStatus.DidNothing()
        if sequence != self._sequence:
            pair = self._wired.pair(context)
            assert pair is not None
            self.frame, self.mask_is_new, self._sequence = pair.current, True, sequence
        self.phase = phase
        return EventStatus.ReachedTermination(self._wired.diagram, "news")


class _Book:
    """What is counted between two steps, and what was last seen from the observation posture."""

    def __init__(self, wired: WiredDiagram, context: Context, clock: StageClock):
        self._wired, self._context, self._clock = wired, context, clock
        self._frames = 0
        self._start: dict[str, NDArray] | None = None  # poses before the first interaction,
        self._before: dict[str, NDArray] = {}  # and before the one that is under way,
        self._pushed: str | None = None  # and what that one pushes
        self._seen: _Seen | None = None

    def count(self, frame: Frame, is_at_rest: bool) -> None:
        """Take note of a frame; of one at rest also of the truth of the same moment."""
        self._frames += 1
        if is_at_rest:
            wired, context = self._wired, self._context
            self._seen = _Seen(
                frame, wired.mask(context), wired.true_labels(context), wired.true_poses(context)
            )

    def close(self, interaction_step: int) -> Step:
        """The step that ends with the last frame at rest; the count starts anew."""
        assert self._seen is not None
        frame, mask, ground_truth, poses = self._seen
        step = Step(
            interaction_step=interaction_step,
            time=frame.time,
            color=frame.color,
            depth=frame.depth,
            mask=mask,
            frames=self._frames,
            stage_seconds={stage: tuple(times) for stage, times in self._clock.seconds.items()},
            ground_truth=ground_truth,
            scores=score(mask, ground_truth),
            disturbance=None
            if self._start is None
            else Disturbance(self._pushed, motion_between(self._start, self._before, poses)),
        )
        self._start = self._start or poses
        self._frames, self._before, self._pushed = 0, poses, self._next_pushed(frame, ground_truth)
        self._clock.seconds.clear()
        return step

    def _next_pushed(self, frame: Frame, ground_truth: NDArray[np.uint16]) -> str | None:
        """The object that the push now beginning goes for."""
        push: Push | None = self._wired.read("active_push", self._context)
        object_id = None if push is None else object_at(push.p_WB, frame, ground_truth)
        return None if object_id is None else self._wired.object_names[object_id]
