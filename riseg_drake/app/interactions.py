"""Alg. 1: the robot acts and segments, and every interaction leaves L*_t behind."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field

from numpy.typing import NDArray
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, EventStatus

from riseg_drake.app.diagram import WiredDiagram
from riseg_drake.app.output import Step, motion_between
from riseg_drake.evaluation.scores import score
from riseg_drake.geometry.rgbd import Frame
from riseg_drake.pushing.push import ArmPhase
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
            book.frames += 1
            for listener in listeners:
                listener(news.frame, context)
        decided = progress.phase is ArmPhase.OBSERVE and news.phase is not ArmPhase.OBSERVE
        progress.time, progress.phase = context.get_time(), news.phase
        if decided:
            # The arm has looked and chosen, but not moved yet: picture, mask and truth are of one moment.
            yield book.close(wired.interaction_step(context), news.frame)  # line 10
            progress.interaction_step += 1  # line 9
        if news.phase is ArmPhase.DONE:
            progress.end = "the arm is done: no push left, or as many made as were asked for"
        elif progress.time >= longest:
            progress.end = f"{longest:g} s were simulated"


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


@dataclass
class _Book:
    """What is counted between two steps."""

    wired: WiredDiagram
    context: Context
    clock: StageClock
    frames: int = 0
    poses: Mapping[str, NDArray] = field(default_factory=dict)

    def close(self, interaction_step: int, frame: Frame) -> Step:
        """The step that ends now; the count starts anew."""
        mask = self.wired.mask(self.context)
        ground_truth = self.wired.true_labels(self.context)
        poses = self.wired.true_poses(self.context)
        step = Step(
            interaction_step=interaction_step,
            time=frame.time,
            color=frame.color,
            depth=frame.depth,
            mask=mask,
            frames=self.frames,
            stage_seconds={stage: tuple(times) for stage, times in self.clock.seconds.items()},
            ground_truth=ground_truth,
            scores=score(mask, ground_truth),
            motions=motion_between(self.poses, poses) if self.poses else {},
        )
        self.frames, self.poses = 0, poses
        self.clock.seconds.clear()
        return step
