"""When the arm may move: a state machine on plain values, asked once for every command.

No motion before the arm has told where it is. News that is late, of arm or camera, makes a pause that ends by
itself; everything else holds until the operator says otherwise; Ctrl-C is the end. The states, what is sent in
each and what leads out of it stand in a table in docs/hardware.md.

Late or ended? An arm whose driver has died, after a reflex, a user stop or a crash, says nothing but that its
status ends, and may be moved by hand before a new driver speaks. The robot gives up control some 20 ms after
the last packet of its driver, and a driver takes 0.5 s and more to start and recover. So stamps of statuses
that fill the time belong to one control of the arm, however late they come; a gap between two of them of more
than `status_gap`, which lies between those two figures, is the end of one and the beginning of another.

Numbers are compared so that one that is none (NaN) is a danger.
"""

from dataclasses import dataclass, field, replace
from enum import Enum

import numpy as np
from numpy.typing import NDArray

MOVE, REFLEX, USER_STOPPED = 2, 4, 5
"""`robot_mode` of lcmt_panda_status, as far as it matters here (franka::RobotMode)."""
OVERSHOT = 0.01
"""A stop at an end of the workspace leaves the tip beyond it by less, m: what it moves in a period or two."""


@dataclass
class SafetyParameters:
    """What makes the arm stop."""

    status_age: float = field(default=0.1, metadata={"least": 0.02, "most": 0.3})
    """Oldest status in motion and at rest, s. So long may it move unseen: no longer than a stop may take."""
    status_gap: float = field(default=0.1, metadata={"least": 0.03, "most": 0.15})
    """Largest time between the stamps of two statuses, one after the other, of a driver that was there all
    along, s; see above."""
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
    fresh_for: float = field(default=0.3, metadata={"least": 0.25, "most": 10.0})
    """A pause ends when nothing has been too old for this long, s; by then the arm is at rest."""
    displacement: float = field(default=0.01, metadata={"least": 0.001, "most": 0.1})
    """After a pause the arm must be this near to where it is told to be, rad; contact makes less."""
    off_path: float = field(default=0.02, metadata={"least": 0.001, "most": 0.1})
    """A path is gone on with where the arm is this near to it, rad."""

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
    """No status yet; or the operator's word came, and nothing was looked at since."""
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
    STATUS_ENDED = "the arm's status ended: its driver, or the robot itself, has stopped"
    MOVED = "the arm is not where it was held"
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


LOST = frozenset({Cause.REFLEX, Cause.USER_STOP, Cause.NOT_READY, Cause.STATUS_ENDED})
"""After these the arm has not followed what it was sent last, even if it takes commands again."""


@dataclass(frozen=True)
class Observation:
    """All that is looked at, at one moment."""

    now: float
    """By a steady clock, as are the times below, s."""
    status_time: float | None
    """Of the newest status, s; None before the first."""
    status_gap: float
    """Largest time between the stamps of two statuses, one after the other, since the last look, s."""
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
    p_WE_begun: NDArray[np.float64] | None = None
    """Where the tip was when the arm set out, m [3]; from a little outside it may come back. None before."""


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
    lost = _loss(seen, parameters)
    if state.mode is Mode.STOPPED:
        # What the arm itself says is the more important news.
        return state if lost is Cause.NONE else replace(state, cause=lost)
    old = status_is_old(seen, parameters)
    if state.mode is Mode.WAITING:
        if seen.status_time is None:
            return state
        refusal = lost if lost is not Cause.NONE else Cause.STATUS_OLD if old else Cause.NONE
        if refusal is Cause.NONE and seen.contradicted:
            refusal = Cause.CONTRADICTION
        return SafetyState(Mode.FOLLOWING) if refusal is Cause.NONE else SafetyState(Mode.STOPPED, refusal)
    if lost is not Cause.NONE:
        return SafetyState(Mode.STOPPED, lost)
    if old:  # what it told last says nothing of where the arm is now
        return SafetyState(Mode.PAUSED, Cause.STATUS_OLD)
    danger = _danger(seen, parameters)
    if danger is not Cause.NONE:
        return SafetyState(Mode.STOPPED, danger)
    if seen.in_motion and not _is_recent(seen.image_time, seen.now, parameters.image_age):
        return SafetyState(Mode.PAUSED, Cause.IMAGES_OLD)
    if state.mode is Mode.PAUSED:
        since = seen.now if state.fresh_since is None else state.fresh_since
        if seen.now - since < parameters.fresh_for:
            return replace(state, fresh_since=since)
        if not seen.lag <= parameters.displacement:
            return SafetyState(Mode.STOPPED, Cause.MOVED)
    return SafetyState(Mode.FOLLOWING)


def released(state: SafetyState) -> SafetyState:
    """The state after the operator's word: as at the beginning, if it was a stop that can be released."""
    return SafetyState() if state.mode is Mode.STOPPED else state


def ended(cause: Cause) -> SafetyState:
    """The state after which there is no motion any more."""
    return SafetyState(Mode.ENDED, cause)


def status_is_old(seen: Observation, parameters: SafetyParameters) -> bool:
    """Whether the arm says nothing at present."""
    return not _is_recent(seen.status_time, seen.now, parameters.status_age)


def _is_recent(time: float | None, now: float, age: float) -> bool:
    """Whether news of a time, s, is at most `age` s old; what is of a time to come is as wrong as old."""
    return time is not None and -age <= now - time <= age


def _loss(seen: Observation, parameters: SafetyParameters) -> Cause:
    """Why the arm does not take commands any more, as far as its status tells."""
    if seen.status_time is None:
        return Cause.NONE
    if seen.robot_mode != MOVE:
        return {REFLEX: Cause.REFLEX, USER_STOPPED: Cause.USER_STOP}.get(seen.robot_mode, Cause.NOT_READY)
    return Cause.NONE if seen.status_gap <= parameters.status_gap else Cause.STATUS_ENDED


def _danger(seen: Observation, parameters: SafetyParameters) -> Cause:
    """What must not go on unless a person has looked at it."""
    if seen.contradicted:
        return Cause.CONTRADICTION
    allowed = parameters.push_force if seen.contact_planned else parameters.contact_force
    if not seen.tip_force <= allowed:
        return Cause.FORCE
    if seen.held_back:
        return Cause.JOINT_LIMIT
    if not _is_in_workspace(seen, parameters):
        return Cause.WORKSPACE
    if not seen.lag <= parameters.largest_gap:
        return Cause.NOT_FOLLOWING
    return Cause.NONE if seen.gap <= parameters.largest_gap else Cause.GAP


def _is_in_workspace(seen: Observation, parameters: SafetyParameters) -> bool:
    """Whether the tip would come to rest there, or no further outside than a stop at the end had left it."""
    lower, upper = np.array(parameters.workspace_lower), np.array(parameters.workspace_upper)
    if seen.p_WE_begun is not None:
        lower = np.minimum(lower, np.maximum(seen.p_WE_begun, lower - OVERSHOT))
        upper = np.maximum(upper, np.minimum(seen.p_WE_begun, upper + OVERSHOT))
    return bool(((seen.p_WE >= lower) & (seen.p_WE <= upper)).all())
