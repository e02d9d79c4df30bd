"""When the arm may move: a state machine on plain values, asked once for every command.

No motion before the arm has told where it is. What only concerns news (status or images too old) makes a
pause that ends by itself; everything else holds until the operator says otherwise; Ctrl-C is the end.
"""

from dataclasses import dataclass, field, replace
from enum import Enum

import numpy as np
from numpy.typing import NDArray

MOVE, REFLEX, USER_STOPPED = 2, 4, 5
"""`robot_mode` of lcmt_panda_status, as far as it matters here (franka::RobotMode)."""


@dataclass
class SafetyParameters:
    """What makes the arm stop."""

    status_age: float = field(default=0.1, metadata={"least": 0.02, "most": 0.3})
    """Oldest status in motion and at rest, s. So long may it move unseen: no longer than a stop may take."""
    image_age: float = field(default=0.5, metadata={"least": 0.1, "most": 5.0})
    """Oldest picture while the arm moves, s; age counts from the picture's own time stamp."""
    contact_force: float = field(default=15.0, metadata={"least": 1.0, "most": 100.0})
    """Largest external force at the tip where no contact is planned, N; above 100 the robot stops by itself."""
    push_force: float = field(default=30.0, metadata={"least": 1.0, "most": 100.0})
    """Largest external force at the tip during a push, N."""
    workspace_lower: list[float] = field(
        default_factory=lambda: [0.15, -0.6, 0.0], metadata={"sizes": (3,), "least": -2.0, "most": 2.0}
    )
    """Least coordinates of the tip in W, m, 3; z = 0 is the table."""
    workspace_upper: list[float] = field(
        default_factory=lambda: [0.85, 0.6, 0.9], metadata={"sizes": (3,), "least": -2.0, "most": 2.0}
    )
    """Largest coordinates of the tip in W, m, 3; no arm reaches as far as 2 m."""
    largest_gap: float = field(default=0.1, metadata={"least": 0.01, "most": 0.3})
    """The arm may be this far from where it is told to be, and its targets from there, rad."""
    fresh_for: float = field(default=0.3, metadata={"least": 0.05, "most": 10.0})
    """A pause ends when nothing has been too old for this long, s."""

    def check(self) -> None:
        """Raise ValueError for bounds that contradict each other."""
        lower, upper = self.workspace_lower, self.workspace_upper
        if not all(a < b for a, b in zip(lower, upper, strict=True)):
            raise ValueError(f"workspace_lower is {lower}; each less than in workspace_upper, {upper} m")
        if not self.contact_force <= self.push_force:
            force, most = self.contact_force, self.push_force
            raise ValueError(f"contact_force is {force:g}; at most push_force, {most:g} N")


class Mode(Enum):
    """What the arm may do."""

    WAITING = "waiting for the arm"
    """No status yet, or the arm is not ready to move."""
    FOLLOWING = "following"
    PAUSED = "paused"
    """At rest, or coming to it; goes on by itself."""
    STOPPED = "stopped"
    """At rest, or coming to it; goes on when the operator says so."""
    ENDED = "ended"
    """At rest, or coming to it, for good."""


class Cause(Enum):
    """Why the arm does not move; each as one would say it."""

    NONE = ""
    STATUS_OLD = "the arm's status is too old"
    IMAGES_OLD = "the camera's images are too old"
    REFLEX = "the arm stopped by reflex"
    USER_STOP = "the arm's user stop is pressed"
    NOT_READY = "the arm left the mode in which it takes commands"
    JOINT_LIMIT = "a joint would leave its range"
    WORKSPACE = "the tip would leave the workspace"
    FORCE = "something pushes against the arm where no contact was planned"
    NOT_FOLLOWING = "the arm is not where it was told to be"
    GAP = "the motion asked for begins somewhere else"
    CONTRADICTION = "the arm's status contradicts itself, as if two drivers sent it"
    FAULT = "the process that sends commands failed"
    INTERRUPT = "Ctrl-C"
    FINISHED = "the program is done"
    CLIENT_GONE = "the program that plans the motion is gone"


@dataclass(frozen=True)
class Observation:
    """All that is looked at, at one moment."""

    now: float
    """By a steady clock, as are the times below, s."""
    status_time: float | None
    """Of the newest status, s; None before the first."""
    robot_mode: int
    image_time: float | None
    """Of the newest picture, s; None before the first."""
    in_motion: bool
    """Whether there is a planned motion to follow."""
    contact_planned: bool
    """Whether it is a push."""
    tip_force: float
    """External force at the tip, N."""
    p_WE: NDArray[np.float64]
    """Where the tip would come to rest if the arm stopped now, m [3]."""
    held_back: bool
    """Whether the last target led out of the joints' ranges."""
    lag: float
    """Largest difference of measured from commanded joint angles, rad; 0 before the first command."""
    gap: float
    """Largest difference of the next target from the last command, rad."""
    contradicted: bool = False
    """Whether what comes as the arm's status cannot all be of one arm."""


@dataclass(frozen=True)
class SafetyState:
    """What the supervisor remembers."""

    mode: Mode = Mode.WAITING
    cause: Cause = Cause.NONE
    fresh_since: float | None = None
    """In a pause: since when nothing has been too old, s."""

    @property
    def may_move(self) -> bool:
        """Whether targets are followed; else the arm comes to rest and stays there."""
        return self.mode is Mode.FOLLOWING


def supervise(state: SafetyState, seen: Observation, parameters: SafetyParameters) -> SafetyState:
    """The state after one look."""
    if state.mode is Mode.ENDED:
        return state
    if state.mode is Mode.STOPPED:
        # What the arm itself says is the more important news.
        worse = _arm_refuses(seen)
        return state if worse is Cause.NONE else replace(state, cause=worse)
    if state.mode is Mode.WAITING:
        ready = seen.status_time is not None and seen.robot_mode == MOVE and not _too_old(seen, parameters)
        ready = ready and not seen.contradicted
        return SafetyState(Mode.FOLLOWING) if ready else state
    danger = _arm_refuses(seen) if _arm_refuses(seen) is not Cause.NONE else _danger(seen, parameters)
    if danger is not Cause.NONE:
        return SafetyState(Mode.STOPPED, danger)
    late = _too_old(seen, parameters)
    if late:
        return SafetyState(Mode.PAUSED, late)
    if state.mode is Mode.PAUSED:
        since = seen.now if state.fresh_since is None else state.fresh_since
        if seen.now - since < parameters.fresh_for:
            return replace(state, fresh_since=since)
    return SafetyState(Mode.FOLLOWING)


def released(state: SafetyState) -> SafetyState:
    """The state after the operator's word: as at the beginning, if it was a stop that can be released."""
    return SafetyState() if state.mode is Mode.STOPPED else state


def ended(cause: Cause) -> SafetyState:
    """The state after which there is no motion any more."""
    return SafetyState(Mode.ENDED, cause)


def _arm_refuses(seen: Observation) -> Cause:
    """Why the arm itself does not take commands."""
    if seen.robot_mode == MOVE or seen.status_time is None:
        return Cause.NONE
    return {REFLEX: Cause.REFLEX, USER_STOPPED: Cause.USER_STOP}.get(seen.robot_mode, Cause.NOT_READY)


def _danger(seen: Observation, parameters: SafetyParameters) -> Cause:
    """What must not go on unless a person has looked at it."""
    if seen.contradicted:
        return Cause.CONTRADICTION
    allowed = parameters.push_force if seen.contact_planned else parameters.contact_force
    if seen.tip_force > allowed:
        return Cause.FORCE
    if seen.held_back:
        return Cause.JOINT_LIMIT
    if (seen.p_WE < parameters.workspace_lower).any() or (seen.p_WE > parameters.workspace_upper).any():
        return Cause.WORKSPACE
    if seen.lag > parameters.largest_gap:
        return Cause.NOT_FOLLOWING
    return Cause.GAP if seen.gap > parameters.largest_gap else Cause.NONE


def _too_old(seen: Observation, parameters: SafetyParameters) -> Cause | None:
    """Which news is too old, if any."""
    if seen.status_time is None or seen.now - seen.status_time > parameters.status_age:
        return Cause.STATUS_OLD
    if seen.in_motion and (seen.image_time is None or seen.now - seen.image_time > parameters.image_age):
        return Cause.IMAGES_OLD
    return None
