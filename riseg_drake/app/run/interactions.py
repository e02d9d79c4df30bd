"""Alg. 1: the robot acts and segments, and every interaction leaves L*_t behind."""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, EventStatus

from riseg_drake.app.diagram import WiredDiagram
from riseg_drake.app.output import Step
from riseg_drake.app.work_state import RunStoppedError
from riseg_drake.evaluation.disturbance import Disturbance, motion_between, object_at
from riseg_drake.evaluation.in_motion import FramesInMotion, moved_objects
from riseg_drake.evaluation.scores import score
from riseg_drake.geometry.rgbd import Frame
from riseg_drake.pushing.arm_path import ArmPhase
from riseg_drake.pushing.decision import UNDECIDED, Decision, Ending
from riseg_drake.pushing.push import NO_PUSH, Push
from riseg_drake.segmentation.remembered_pair import PassedOver
from riseg_drake.segmentation.segmentation import Segmentation
from riseg_drake.segmentation.untouched import untouched_clusters
from riseg_drake.stations.object_models import SceneError
from riseg_drake.stations.physics import advance
from riseg_drake.systems.stage_clock import StageClock

BLIND = 30.0
"""A run ends when no picture has shown the table for this long, s: longer than any push takes."""

Listener = Callable[[Frame, Context], None]
"""Is told every camera frame once, with the diagram's context at that moment."""


@dataclass(frozen=True)
class Truth:
    """What somebody knows who may cheat, of the moment of one frame."""

    draw: Callable[[], NDArray[np.uint16]] = field(repr=False)
    """Gives the true visible object ids [H, W]; drawing them takes as long as a picture."""
    poses: dict[str, NDArray[np.float64]]
    """The true poses X_WBcm [4, 4] of the objects, by name: B's axes in the centre of mass."""
    names: Mapping[int, str]
    """By object id."""
    axes: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)
    """By name, the unit vectors in B [k, 3] about which an object is a body of revolution."""

    @cached_property
    def labels(self) -> NDArray[np.uint16]:
        """The true visible object ids [H, W]; must be asked for before the diagram goes on."""
        return self.draw()


TruthSource = Callable[[Frame, Context], Truth | None]
"""Asked for the truth behind a frame; None where it is not known."""


@dataclass(frozen=True)
class WallClock:
    """To run at wall time, as with a real robot, instead of as fast as possible from 0 on."""

    start: float
    """Wall time now, s: the diagram's time at the start."""
    look: Callable[[Context], bool]
    """Called after every step; true stops the diagram for a moment, to look at `Progress.end`."""


@dataclass
class Progress:
    """How far a run has come; renewed at every camera frame."""

    interaction_step: int = 0
    """The interaction that is under way; 0 before the first."""
    phase: ArmPhase = ArmPhase.OBSERVE
    objects: int = 0
    """Objects found so far."""
    time: float = 0.0
    """Since the start, s."""
    frames: int = 0
    end: str = ""
    """Why the run ended, in words; empty while it goes on."""
    decision: Decision = UNDECIDED
    """That to end; UNDECIDED while the run goes on, and where somebody else ended it."""
    unsettled_area: float = float("nan")
    """What was yet to be segmented at the last decision, m^2; NaN before the first."""


def interactions(
    wired: WiredDiagram,
    clock: StageClock,
    progress: Progress,
    longest: float,
    listeners: tuple[Listener, ...] = (),
    *,
    truth: TruthSource | None = None,
    wall: WallClock | None = None,
) -> Iterator[Step]:
    """Run Alg. 1; yields how things stand before the first and after every interaction.

    It ends when the arm is done (a_i = null, or enough pushes were made), or when `longest` seconds have
    passed; `progress.end` and `progress.decision` say which. At wall time also when somebody else has set
    `progress.end`; how things stand then is yielded, too. The truth is that of the simulation if not given.
    Raises PhysicsError where a simulation cannot go on, SceneError where its camera sees none of its
    objects at the first look, and RunStoppedError where the table is not seen any more.
    """
    clock.watch(wired.stages)
    simulator = Simulator(wired.diagram)
    context = simulator.get_mutable_context()
    news = _News(wired, wall.look if wall else None)
    simulator.set_monitor(news.look)
    book = _Book(wired, context, clock, truth or simulated_truth(wired))
    start = wall.start if wall else 0.0
    go_on = simulator.AdvanceTo if wall else partial(advance, simulator)  # a real arm has no physics to fail
    if wall:
        context.SetTime(start)
        simulator.set_target_realtime_rate(1.0)
    simulator.Initialize()
    while not progress.end:  # line 4
        go_on(start + longest)  # lines 5 to 8, up to the next mask or the arm's next phase
        if news.blind:
            progress.end = f"for {BLIND:g} s no picture has shown a table; the last: {news.blind}"
            raise RunStoppedError(progress.end)
        if news.mask_is_new:
            news.mask_is_new = False
            progress.frames += 1
            progress.objects = len(wired.segmentation(context).object_ids)
            book.count(news.frame, is_at_rest=news.phase is ArmPhase.OBSERVE)
            if progress.frames == 1 and not wall:
                book.check_sight()
            for listener in listeners:
                listener(news.frame, context)
            wired.let_sleep(context)
        decided = progress.phase is ArmPhase.OBSERVE and news.phase is not ArmPhase.OBSERVE
        progress.time, progress.phase = context.get_time() - start, news.phase
        if decided:
            yield book.close(wired.interaction_step(context))  # line 10
            progress.interaction_step += 1  # line 9
        decision = wired.last_decision(context)
        progress.unsettled_area = decision.unsettled_area
        if news.phase is ArmPhase.DONE:
            progress.decision = decision
            made = wired.interaction_step(context)
            progress.end = progress.end or _why(decision, made, wired.most_interactions)
        elif progress.time >= longest:
            progress.decision = replace(decision, push=NO_PUSH, ending=Ending.TIME, candidates=0, failed={})
            progress.end = _and(f"{longest:g} s were {'over' if wall else 'simulated'}", progress.decision.why)
        elif progress.end and wall and book.has_seen:
            yield book.close(wired.interaction_step(context))
    wired.show_end(context)


def _why(decision: Decision, made: int, most: int) -> str:
    """Why the arm is done, in words."""
    if decision.ending is None:
        return "the operator ended it"
    if decision.ending is Ending.ENOUGH_INTERACTIONS:
        return _and(f"{made} of {most} interactions were made", decision.why)
    return decision.why


def _and(*parts: str) -> str:
    return ", ".join(part for part in parts if part)


def simulated_truth(wired: WiredDiagram) -> TruthSource:
    """The truth that a simulated station knows."""

    def truth(_: Frame, context: Context) -> Truth:
        return Truth(
            lambda: wired.true_labels(context),
            wired.true_poses(context),
            wired.object_names,
            wired.object_axes,
        )

    return truth


class _Seen(NamedTuple):
    frame: Frame
    segmentation: Segmentation
    truth: Truth | None


class _News:
    """Stops the simulator when there is a new mask, or the arm begins something else."""

    frame: Frame
    """I_t of the newest mask; not there before the first."""
    blind = ""
    """Why no frame has been taken for long; empty while that is not so."""

    def __init__(self, wired: WiredDiagram, look: Callable[[Context], bool] | None):
        self._look = look
        self.phase = ArmPhase.OBSERVE
        self.mask_is_new = False
        self._wired = wired
        self._sequence = -1
        self._blind_since = math.inf

    def look(self, context: Context) -> EventStatus:
        """The simulator's monitor; it is called after every step, hundreds of times a second."""
        wanted = self._look is not None and self._look(context)
        phase = self._wired.phase(context)
        passed_over: PassedOver = self._wired.read("passed_over", context)
        if passed_over.why:
            self._blind_since = min(self._blind_since, passed_over.time)
            if passed_over.time - self._blind_since > BLIND:
                self.blind = passed_over.why
                return EventStatus.ReachedTermination(self._wired.diagram, "the table is not seen")
        else:
            self._blind_since = math.inf
        sequence = self._wired.segmentation(context).sequence
        if phase is self.phase and sequence == self._sequence:
            if wanted:
                return EventStatus.ReachedTermination(self._wired.diagram, "somebody wants to look")
            return EventStatus.DidNothing()
        if sequence != self._sequence:
            self.frame = self._wired.pair(context).current
            self.mask_is_new, self._sequence = True, sequence
        self.phase = phase
        return EventStatus.ReachedTermination(self._wired.diagram, "news")


class _Book:
    """What is counted between two steps, and what was last seen from the observation posture."""

    def __init__(self, wired: WiredDiagram, context: Context, clock: StageClock, truth: TruthSource):
        self._wired, self._context, self._clock, self._truth = wired, context, clock, truth
        self._frames = 0
        self._start: dict[str, NDArray] | None = None  # poses before the first interaction,
        self._before: dict[str, NDArray] = {}  # and before the one that is under way,
        self._pushed: str | None = None  # and what that one pushes
        self._seen: _Seen | None = None
        self._in_motion = FramesInMotion()  # since then

    @property
    def has_seen(self) -> bool:
        """Whether there is anything to close a step with."""
        return self._seen is not None

    def count(self, frame: Frame, is_at_rest: bool) -> None:
        """Take note of a frame, and of the truth of the same moment where it counts."""
        self._frames += 1
        truth = self._truth(frame, self._context)
        if not is_at_rest:
            if truth is not None:
                self._count_moved(frame.time, truth)
            return
        if truth is not None:
            _ = truth.labels
        if truth is not None or self._seen is None or self._seen.truth is None:
            self._seen = _Seen(frame, self._wired.segmentation(self._context), truth)

    def check_sight(self) -> None:
        """Raise SceneError where there are objects and none is in sight: empty masks would be right."""
        truth = self._seen.truth if self._seen else None
        if truth is not None and truth.names and not truth.labels.any():
            names = ", ".join(truth.names.values())
            raise SceneError(
                f"the camera sees none of the objects ({names}) at the first look; place them in its view, "
                "or let start_position, centre_W or X_WC look at them"
            )

    def _count_moved(self, time: float, truth: Truth) -> None:
        """Score what has moved in this interaction. Labels are drawn only where there is such a thing."""
        moved = moved_objects(self._before, truth.poses, truth.names)
        if moved:
            self._in_motion.score(time, moved, self._wired.mask(self._context), truth.labels)

    def close(self, interaction_step: int) -> Step:
        """The step that ends with the last frame at rest; the count starts anew."""
        assert self._seen is not None
        frame, segmentation, truth = self._seen
        mask = segmentation.mask
        step = Step(
            interaction_step=interaction_step,
            time=frame.time,
            color=frame.color,
            depth=frame.depth,
            mask=mask,
            confidence=segmentation.confidence,
            untouched=untouched_clusters(segmentation),
            untouched_confidence=segmentation.untouched_confidence,
            frames=self._frames,
            stage_seconds={stage: tuple(times) for stage, times in self._clock.seconds.items()},
            ground_truth=truth.labels if truth else None,
            scores=score(mask, truth.labels) if truth else None,
            disturbance=None
            if self._start is None or truth is None
            else Disturbance(self._pushed, motion_between(self._start, self._before, truth.poses, truth.axes)),
            in_motion=self._in_motion.closed(mask, truth.labels) if truth else None,
            moved={time: sorted(ids) for time, ids in self._in_motion.moved.items()},
        )
        if truth is not None:
            self._start, self._before = self._start or truth.poses, truth.poses
        self._pushed = self._next_pushed(frame, truth) if truth else None
        self._frames, self._seen, self._in_motion = 0, None, FramesInMotion()
        self._clock.seconds.clear()
        return step

    def _next_pushed(self, frame: Frame, truth: Truth) -> str | None:
        """The object that the push now beginning goes for."""
        push: Push = self._wired.read("active_push", self._context)
        object_id = None if push is NO_PUSH else object_at(push.p_WB, frame, truth.labels)
        return None if object_id is None else truth.names[object_id]
