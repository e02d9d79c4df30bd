"""ArmMotion: the loop of Alg. 1 as seen from the arm. Observe, approach, push, retreat, observe."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import BasicVector, Context, EventStatus, LeafSystem, State
from pydrake.trajectories import PiecewisePolynomial

from riseg_drake.geometry.rgbd import NO_MASK, NO_PAIR, FramePair, Immutable
from riseg_drake.pushing.arm_path import ArmPhase, PushPath
from riseg_drake.pushing.decision import UNDECIDED, Decision, Ending
from riseg_drake.pushing.push import NO_PUSH, Push
from riseg_drake.pushing.time_law import minimum_jerk
from riseg_drake.pushing.tried_pushes import SegmentedSoFar, TriedPush, segmented_so_far
from riseg_drake.systems.memory import replace_memory
from riseg_drake.systems.value_input import ValueInput


class Permission(Enum):
    """What the operator says to a push that was found."""

    WAIT = "no answer yet"
    DO = "do it"
    SKIP = "not this one; find another"
    END = "no push any more"


@dataclass
class ArmMotionParameters:
    """When to look, and when to stop."""

    most_interactions: int = field(default=5, metadata={"least": 0, "most": 1000})
    """Pushes of one run (paper: up to 5)."""
    settle_time: float = 0.25
    """A push is chosen in a frame taken this long after the arm came to rest, s, ..."""
    settle_longest: float = 2.0
    """... or so long after it, s, where it is not decided by then: something may move for ever."""
    rest_tolerance: float = 0.01
    """The arm is at rest where it should be when every joint is this close, rad."""
    null_frames: int = 2
    """In how many frames in a row no push may be found before the scene counts as done."""
    unchanged_area: float = 3e-4
    """A push that changed the segmented area by less, m^2, and found no object, brought nothing."""
    period: float = 1 / 30
    """Time between two looks at what to do, s."""
    largest_jump: float = 0.05
    """A path may begin and end this far from the observation posture, rad; the rest is faded out ..."""
    fade_time: float = 0.5
    """... and in, over this time, s."""


@dataclass(frozen=True)
class _Attempt(Immutable):
    """A push, and what was segmented before it."""

    push: Push
    before: SegmentedSoFar

    def tried(self, changed: bool) -> TriedPush:
        """What the planner is told of it."""
        return TriedPush(self.push.p_WB, self.push.direction_W, changed)


@dataclass(frozen=True)
class _Observing(Immutable):
    """At the observation posture, or on the last bit of the way there."""

    since: float | None = None
    """Since when it has been at rest there, s; None while it is not."""


@dataclass(frozen=True)
class _Proposed(Immutable):
    """At the observation posture, with a push that has not been permitted yet."""

    attempt: _Attempt
    since: float
    """Since when it has been at rest there, s."""


@dataclass(frozen=True)
class _Pushing(Immutable):
    """On the path of a push."""

    attempt: _Attempt
    path: PushPath
    start_time: float
    """s."""
    offset: NDArray[np.float64]
    """Of the commanded joint angles from the path at its start, rad."""


@dataclass(frozen=True)
class _Returning(Immutable):
    """It was moved by hand, and comes back to the observation posture."""

    path: PiecewisePolynomial
    start_time: float
    """s."""
    given_up: _Attempt | None
    """The push that it was at."""


@dataclass(frozen=True)
class _Finished(Immutable):
    """There is no push any more."""


@dataclass(frozen=True)
class _Memory(Immutable):
    """All that ArmMotion remembers. Never changed, only replaced."""

    doing: _Observing | _Proposed | _Pushing | _Returning | _Finished = _Observing()
    interaction_step: int = 0
    end_time: float = -np.inf
    """When the last motion was over, as far as commands go, s."""
    unjudged: _Attempt | None = None
    """A push that is over but of which it is not known yet what it brought."""
    tried: tuple[TriedPush, ...] = ()
    decision: Decision = UNDECIDED
    """What was decided last, ..."""
    asked: int = -1
    """... and in which frame."""
    nulls: int = 0
    """Frames in a row in which no push was found."""

    @property
    def attempt(self) -> _Attempt | None:
        """The push that is being done, or waits for permission."""
        match self.doing:
            case _Proposed(attempt) | _Pushing(attempt) | _Returning(given_up=attempt):
                return attempt
        return None

    @property
    def active_push(self) -> Push:
        """The same for those who want a push alone: NO_PUSH where there is none."""
        return NO_PUSH if self.attempt is None else self.attempt.push


class ArmMotion(LeafSystem):
    """Turns pushes into joint angles, and asks for the next push when it is time.

    Inputs:
        decision: Decision, a Push with a path or why there is none; evaluated only when the arm rests and
            sees, once for a frame.
        pair: FramePair; tells when the frame was taken that decision and mask belong to.
        mask: L_t of the pair's current frame, to tell whether a push brought anything.
        decided: bool, whether the mask is that of a scene at rest; not wired, every mask is.
        position_measured: the arm's joint angles [7], rad.

    Outputs:
        position: commanded joint angles [7], rad; velocity and acceleration are continuous, but for the
            beginning of a way back.
        phase: ArmPhase.
        interaction_step: int, how many pushes are over.
        active_push: the Push that is being done, or waits for permission, or NO_PUSH.
        tried_pushes: tuple of TriedPush.
        last_decision: the Decision that was made last, with the arm done why there is no push any more;
            where the operator ended it that still has its push.

    `permit` is asked about every push, again and again while it says WAIT; without it each is done.
    `done_until` tells up to what time, s, the commanded positions have been gone through, where that may be
    later than they are commanded: an arm that has not set out yet is also at rest where it should be.
    `way_back` is asked at every look for a motion [7] over [0, T] s from where the arm is to q_observe, if it
    was moved by hand: then whatever it does is given up, and a push counts as one that was made.

    No output depends on an input at the same moment: `tried_pushes` and `position` may be wired back to
    the planner.
    """

    def __init__(
        self,
        q_observe: NDArray,
        parameters: ArmMotionParameters | None = None,
        permit: Callable[[Push], Permission] | None = None,
        done_until: Callable[[], float] | None = None,
        way_back: Callable[[], PiecewisePolynomial | None] | None = None,
    ):
        super().__init__()
        self.set_name("ArmMotion")
        self._q_observe = np.array(q_observe, float)
        self._parameters = parameters or ArmMotionParameters()
        self._permit = permit
        self._done_until = done_until
        self._way_back = way_back
        self._decision = ValueInput(self, "decision", UNDECIDED)
        self._pair = ValueInput(self, "pair", NO_PAIR)
        self._mask = ValueInput(self, "mask", NO_MASK)
        self._decided = ValueInput(self, "decided", True)
        self._measured = self.DeclareVectorInputPort("position_measured", 7)
        self._memory = self.DeclareAbstractState(AbstractValue.Make(_Memory()))
        state = {self.abstract_state_ticket(self._memory)}
        with_time = state | {self.time_ticket()}
        self.DeclareVectorOutputPort("position", 7, self._calc_position, with_time)
        self._declare("phase", ArmPhase.OBSERVE, self._calc_phase, with_time)
        self._declare("interaction_step", 0, lambda m, t: m.interaction_step, state)
        self._declare("active_push", NO_PUSH, lambda m, t: m.active_push, state)
        self._declare("tried_pushes", (), lambda m, t: m.tried, state)
        self._declare("last_decision", UNDECIDED, lambda m, t: m.decision, state)
        self.DeclarePeriodicUnrestrictedUpdateEvent(self._parameters.period, 0.0, self._update)

    def _declare(self, name: str, model: Any, read: Any, prerequisites: set) -> None:
        def calc(context: Context, output: AbstractValue) -> None:
            output.set_value(read(self._recall(context), context.get_time()))

        self.DeclareAbstractOutputPort(name, AbstractValue.Make(model).Clone, calc, prerequisites)

    def _recall(self, context: Context) -> _Memory:
        return context.get_abstract_state(int(self._memory)).get_value()

    def _calc_position(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._command(self._recall(context), context.get_time()))

    def _command(self, memory: _Memory, time: float) -> NDArray[np.float64]:
        """The joint angles [7] to command at a time."""
        match memory.doing:
            case _Returning(path, start_time):
                return path.value(min(time - start_time, path.end_time()))[:, 0]
            case _Pushing(_, push_path, start_time, offset):
                since = time - start_time
                to_an_end = min(since, push_path.duration - since) / self._parameters.fade_time
                fading = 1.0 - minimum_jerk(np.clip(to_an_end, 0.0, 1.0))[0]
                return push_path.position(since) + fading * offset
        return self._q_observe

    def _calc_phase(self, memory: _Memory, time: float) -> ArmPhase:
        match memory.doing:
            case _Finished():
                return ArmPhase.DONE
            case _Returning(given_up=_Attempt()):
                return ArmPhase.RETREAT
            case _Pushing(_, path, start_time):
                return path.phase(time - start_time)
        return ArmPhase.OBSERVE

    def _update(self, context: Context, state: State) -> EventStatus:
        after = self._next(self._recall(context), context)
        return replace_memory(context, state, self._memory, after)

    def _next(self, memory: _Memory, context: Context) -> _Memory:
        """One step of the loop; it does one thing at a time, so that each sees the one before done."""
        time = context.get_time()
        if isinstance(memory.doing, _Finished):
            return memory
        way_back = self._way_back() if self._way_back is not None else None
        if way_back is not None:
            given_up = None if isinstance(memory.doing, _Proposed) else memory.attempt
            return replace(memory, doing=_Returning(way_back, time, given_up))
        match memory.doing:
            case _Proposed(attempt, since):
                return self._ask(memory, attempt, since, time)
            case _Pushing(attempt, path, start_time):
                return _after_motion(memory, attempt, start_time + path.duration, time)
            case _Returning(way, start_time, attempt):
                return _after_motion(memory, attempt, start_time + way.end_time(), time)
            case _Observing(since):
                return self._observe(memory, since, context)

    def _observe(self, memory: _Memory, since: float | None, context: Context) -> _Memory:
        """Wait until the arm rests and sees; judge the push before, or find the next one."""
        parameters, time = self._parameters, context.get_time()
        error = np.abs(self._measured.Eval(context) - self._q_observe).max()
        done = self._done_until is None or self._done_until() >= memory.end_time
        if error > parameters.rest_tolerance or not done:
            return memory if since is None else replace(memory, doing=_Observing())
        if since is None:
            return replace(memory, doing=_Observing(time))
        pair = self._pair.Eval(context)
        decided = not self._decided.HasValue(context) or self._decided.Eval(context)
        settle = parameters.settle_time if decided else parameters.settle_longest
        if pair is NO_PAIR or pair.current.time < since + settle:
            return memory
        if memory.unjudged is not None:
            return self._judge(memory, memory.unjudged, pair, context)
        if memory.asked == pair.current.sequence:
            return memory

        decision = self._decision.Eval(context)
        memory = replace(memory, decision=decision, asked=pair.current.sequence)
        if memory.interaction_step >= parameters.most_interactions:
            return replace(memory, decision=_enough(decision), doing=_Finished())
        if decision.push is NO_PUSH:
            nulls = memory.nulls + 1
            doing = _Finished() if nulls >= parameters.null_frames else memory.doing
            return replace(memory, nulls=nulls, doing=doing)
        attempt = _Attempt(decision.push, self._segmented(pair, context))
        return self._ask(replace(memory, doing=_Proposed(attempt, since), nulls=0), attempt, since, time)

    def _ask(self, memory: _Memory, attempt: _Attempt, since: float, time: float) -> _Memory:
        """Begin with the proposed push, if that is permitted."""
        match Permission.DO if self._permit is None else self._permit(attempt.push):
            case Permission.DO:
                path = attempt.push.path
                if path is None:
                    raise ValueError("the push has no path; give it one with plan_push_path")
                return replace(memory, doing=_Pushing(attempt, path, time, self._offset_from(path)))
            case Permission.SKIP:
                tried = (*memory.tried, attempt.tried(changed=False))
                return replace(memory, doing=_Observing(since), tried=tried)
            case Permission.END:
                return replace(memory, doing=_Finished())
        return memory

    def _judge(self, memory: _Memory, attempt: _Attempt, pair: FramePair, context: Context) -> _Memory:
        """Remember what the last push brought."""
        segmented = self._segmented(pair, context)
        changed = segmented.differs_from(attempt.before, self._parameters.unchanged_area)
        return replace(memory, tried=(*memory.tried, attempt.tried(changed)), unjudged=None)

    def _segmented(self, pair: FramePair, context: Context) -> SegmentedSoFar:
        frame = pair.current
        return segmented_so_far(self._mask.Eval(context), frame.depth, frame.intrinsics)

    def _offset_from(self, path: PushPath) -> NDArray[np.float64]:
        """How far the arm's command is from where a push's path begins."""
        offset = self._q_observe - path.position(0.0)
        if np.abs(offset).max() > self._parameters.largest_jump:
            raise ValueError(
                f"the push's path begins {np.abs(offset).max():.3f} rad away from the observation "
                f"posture, at most {self._parameters.largest_jump} is allowed; plan from `position`"
            )
        return offset


def _after_motion(memory: _Memory, attempt: _Attempt | None, end: float, time: float) -> _Memory:
    """The arm observes once its motion is over; a push counts as made, also one that was given up."""
    if time < end:
        return memory
    after = replace(memory, doing=_Observing(), end_time=time)
    if attempt is None:
        return after
    return replace(after, interaction_step=memory.interaction_step + 1, unjudged=attempt)


def _enough(decision: Decision) -> Decision:
    """The decision that stands once as many pushes as may be were made."""
    if decision.ending is Ending.NOTHING_LEFT:
        return decision
    return replace(decision, push=NO_PUSH, ending=Ending.ENOUGH_INTERACTIONS, candidates=0, failed={})
