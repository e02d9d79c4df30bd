"""Alg. 1: the robot acts and segments, and every interaction leaves L*_t behind."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field

from numpy.typing import NDArray
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, EventStatus

from riseg_drake.app.diagram import WiredDiagram
from riseg_drake.app.output import Step, motion_between
from riseg_drake.evaluation.scores import score
from riseg_drake.geometry.rgbd import Frame, FramePair
from riseg_drake.pushing.push import ArmPhase
from riseg_drake.systems.stage_clock import StageClock

Listener = Callable[[Frame, Context], None]
"""Is told every camera frame once, with the diagram's context at that moment."""


@dataclass
class Progress:
    """How far a run has come; renewed at every camera frame."""

    interaction_step: int = 0
    """Interactions that were begun."""
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
    most_interactions: int,
    longest: float,
    listeners: tuple[Listener, ...] = (),
) -> Iterator[Step]:
    """Run Alg. 1; yields how things stand before the first and after every interaction.

    It ends when no push is left (a_i = null), after `most_interactions`, or when `longest` seconds were
    simulated; `progress.end` says which.
    """
    clock.watch(wired.stages)
    simulator = Simulator(wired.diagram)
    context = simulator.get_mutable_context()
    news = _News(wired)
    simulator.set_monitor(news.look)
    book = _Book(wired, context, clock)
    simulator.Initialize()
    while not progress.end:  # line 4
        simulator.AdvanceTo(longest)  # lines 5 to 8, up to the next frame or the arm's next phase
        frame = news.frame()
        progress.time = context.get_time()
        if frame is not None and news.is_first_look():
            progress.frames += 1
            progress.objects = wired.objects(context)
            book.frames += 1
            for listener in listeners:
                listener(frame, context)
        decided = progress.phase is ArmPhase.OBSERVE and news.phase is not ArmPhase.OBSERVE
        progress.phase = news.phase
        if decided and frame is not None:
            # The arm has looked and chosen, but not moved yet: the frame and the truth show one moment.
            yield book.close(progress.interaction_step, frame)  # line 10
            if news.phase is ArmPhase.DONE:
                progress.end = "there is nothing left that it can push"
            elif progress.interaction_step == most_interactions:
                progress.end = f"{most_interactions} interactions were asked for"
            else:
                progress.interaction_step += 1  # line 9
        elif progress.time >= longest:
            progress.end = f"{longest:g} s were simulated"


class _News:
    """Stops the simulator when there is a new frame, or the arm begins something else."""

    def __init__(self, wired: WiredDiagram):
        self.phase = ArmPhase.OBSERVE
        self._wired = wired
        self._pair: FramePair | None = None
        self._looked_at = -1

    def look(self, context: Context) -> EventStatus:
        """The simulator's monitor; it is called after every step, a thousand times a second."""
        phase = self._wired.phase(context)
        self._pair = self._wired.pair(context)
        if phase is self.phase and self._sequence() == self._looked_at:
            return EventStatus.DidNothing()
        self.phase = phase
        return EventStatus.ReachedTermination(self._wired.diagram, "news")

    def frame(self) -> Frame | None:
        """I_t, once there is one."""
        return None if self._pair is None else self._pair.current

    def is_first_look(self) -> bool:
        """Whether this is asked about the present frame for the first time."""
        first = self._sequence() != self._looked_at
        self._looked_at = self._sequence()
        return first

    def _sequence(self) -> int:
        return -1 if self._pair is None else self._pair.current.sequence


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
        poses = self.wired.object_poses(self.context)
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
