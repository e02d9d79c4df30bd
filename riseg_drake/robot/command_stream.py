"""The command path: targets and status in, one command every 5 ms out, or none while nobody should hear one.

All of it is arithmetic on what it is given, time included; the process around it only waits and sends.

Silence is what keeps the arm from moving unasked. A driver that was started anew follows whatever it hears; so
once the arm's status is too old and the commands are at rest nothing is sent, and when its status has ended
nothing is until the operator says so. What is sent first then is where the arm was measured to be.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from riseg_drake.robot.command_limiter import LONGEST_STOP, CommandLimiter, CommandLimits, Target
from riseg_drake.robot.limits import RobotLimits
from riseg_drake.robot.supervisor import (
    LOST,
    MOVE,
    Cause,
    Mode,
    Observation,
    SafetyParameters,
    SafetyState,
    ended,
    released,
    status_is_old,
    supervise,
)
from riseg_drake.robot.target_playout import PlayoutParameters, TargetPlayout
from riseg_drake.robot.tip_geometry import TipGeometry
from riseg_drake.robot.velocity_drift import VelocityDrift

POSITION, VELOCITY = "position", "velocity"


@dataclass
class CommandParameters:
    """What the arm is sent, and when it must stop."""

    mode: str = field(default=VELOCITY, metadata={"choices": (POSITION, VELOCITY)})
    """What is commanded: joint angles or their velocities; the arm's driver must be in the same mode. It
    filters what it hears: at 200 Hz velocities leave it calm, and positions at the limits of acceleration."""
    rate: float = 200.0
    """Commands a second."""
    limits: CommandLimits = field(default_factory=CommandLimits)
    """Shares of the joints' limits; motions are planned with smaller ones."""
    playout: PlayoutParameters = field(default_factory=PlayoutParameters)
    safety: SafetyParameters = field(default_factory=SafetyParameters)

    def check(self, robot: RobotLimits | None = None) -> None:
        """Raise ValueError for settings that cannot be, or with which a robot could not stop in time."""
        if not 100 <= self.rate <= 1000:
            raise ValueError(f"rate is {self.rate:g}; expected 100 to 1000 commands a second")
        if robot is None:
            return
        longest = self.limits.longest_stop(robot)
        if longest > LONGEST_STOP:
            raise ValueError(
                f"limits: a stop from full speed would take {longest:.2f} s, at most {LONGEST_STOP} s is "
                "allowed; lower velocity or raise stop_acceleration"
            )


@dataclass(frozen=True)
class ArmStatus:
    """What the arm says."""

    time: float
    """When it was so, s, by the clock of whoever listens."""
    position: NDArray[np.float64]
    """Measured joint angles, rad [7]."""
    velocity: NDArray[np.float64]
    """rad/s [7]"""
    torque_external: NDArray[np.float64]
    """External torques as the driver gives them, N m [7]; only their size is used."""
    robot_mode: int
    contradicted: bool = False
    """Whether others that came with it cannot be of the same arm."""
    gap: float | None = None
    """Largest time between the stamps of two statuses, one after the other, from the one that was handed on
    before this up to this one, s; None where those in between were not seen."""


class CommandStream:
    """See above. `state` is what the supervisor thinks; `position` what was commanded last, rad [7]."""

    def __init__(self, parameters: CommandParameters, tip: TipGeometry, robot: RobotLimits):
        parameters.check(robot)
        self._parameters = parameters
        self._robot = robot
        self._tip = tip
        self.mode = parameters.mode
        self.period = 1 / parameters.rate
        """Time from one step to the next, s."""
        self._playout = TargetPlayout(parameters.playout)
        self._takes_targets = True
        self._limiter: CommandLimiter | None = None  # None: the next command is where the arm is
        self._is_silent = True
        self._drift = VelocityDrift(self.period)
        self._p_WE_begun: NDArray[np.float64] | None = None  # see Observation
        self._was_unseen = False  # whether in this pause the arm's status was too old at any time
        self._contacts: list[tuple[float, float]] = []
        self._status: ArmStatus | None = None
        self.state = SafetyState()
        self.words = 0
        """How often the operator has said that the arm may move again."""

    @property
    def position(self) -> NDArray[np.float64] | None:
        """The last command, rad [7]; None while none is sent."""
        return None if self._limiter is None or self._is_silent else self._limiter.position

    @property
    def behind(self) -> float:
        """How much motion is still to be played out, s; 0 when the arm is where its targets end."""
        return self._playout.remaining if self._playout.in_motion else 0.0

    @property
    def done_until(self) -> float:
        """Targets up to this time have been gone through, s; minus infinity before the first."""
        return -np.inf if self._playout.time is None else self._playout.time

    @property
    def at_rest(self) -> bool:
        """Whether commands stand still."""
        return self._limiter is None or self._limiter.at_rest

    @property
    def off_path(self) -> float:
        """How far the arm is from its path, rad; see SafetyParameters.off_path."""
        return 0.0 if self._status is None else self._playout.distance(self._start(self._status))

    def add_target(self, time: float, position: NDArray) -> None:
        """Joint angles [7], rad, for a wall time, s. Raises ValueError where it cannot be taken."""
        if self._takes_targets:
            self._playout.add(time, position)

    def expect_contact(self, start: float, end: float) -> None:
        """Targets between these times, s, are a push: the force allowed is that of a push."""
        self._contacts = [(a, b) for a, b in self._contacts if b > (self._playout.time or 0.0)]
        self._contacts.append((start, end))

    def abandon_path(self) -> None:
        """Forget all targets, and those to come until `begin_path`: they lead where the arm is not."""
        self._playout.drop()
        self._contacts = []
        self._takes_targets = False

    def begin_path(self) -> None:
        """Targets from now on are of a path that begins where the arm is."""
        self._takes_targets = True

    def release(self) -> None:
        """The operator's word that a stopped arm may move again."""
        self.words += 1
        self.state = released(self.state)
        if self._limiter is not None:
            self._limiter.held_back = False

    def begin_at_rest(self, position: NDArray) -> None:
        """Go on from joint angles [7], rad, where the arm came to rest because nothing was sent for long."""
        if self._limiter is None:
            return
        self._rest_at(position)
        self._playout.resume_near(position)

    def end(self, cause: Cause) -> None:
        """Come to rest for good."""
        if self.state.mode is not Mode.ENDED:
            self.state = ended(cause)

    def step(
        self, now: float, status: ArmStatus | None, image_time: float | None
    ) -> NDArray[np.float64] | None:
        """The command of one period: joint angles or velocities [7] by mode; None while there is none.

        `now` and `image_time`, that of the newest picture, are in s by the steady clock of the status.
        """
        before = self.state
        self._listen(now, status)
        target = self._playout.advance(self.period) if before.may_move else None
        seen = self._look(now, status, image_time, target)
        if before.mode is not Mode.WAITING or self.at_rest:  # a word that came while it brakes has to wait
            self.state = supervise(before, seen, self._parameters.safety)
        if self.state.may_move and not before.may_move:
            assert status is not None
            self._set_out(before, status)
        elif self.state.may_move and target is not None:
            assert self._limiter is not None
            self._take_drift_back(now)
            self._limiter.follow(target._replace(position=target.position + self._drift.value))
        elif self._limiter is not None:
            # Pictures that are late are no danger: no reason to brake at the driver's limits.
            (self._limiter.pause if self.state.cause is Cause.IMAGES_OLD else self._limiter.stop)()
        if not self.state.may_move:
            self._playout.halt()
        was_old = self._was_unseen or self.state.cause is Cause.STATUS_OLD
        self._was_unseen = was_old and self.state.mode is Mode.PAUSED
        self._note_where_it_stands(seen)
        return self._fall_silent() if self._has_no_hearer(seen) else self._command()

    def _listen(self, now: float, status: ArmStatus | None) -> None:
        """See VelocityDrift.listen."""
        is_news = status is not self._status and not self._was_unseen
        speed = np.zeros(7) if self._limiter is None else self._limiter.velocity
        self._drift.listen(now, speed, status.time if status is not None and is_news else None)

    def _note_where_it_stands(self, seen: Observation) -> None:
        """Velocity mode: in a pause the arm is held where it came to rest, which no sum of velocities tells.

        Only once it stands and its status is there: nobody can have moved it by hand while that went on. Where
        that was late at any time of the pause, no further away than what it was told meanwhile explains.
        """
        if self.mode != VELOCITY:
            return
        limiter, safety = self._limiter, self._parameters.safety
        stands = self.state.mode is Mode.PAUSED and limiter is not None and limiter.at_rest
        if not self._drift.has_stood(stands and not status_is_old(seen, safety)):
            return
        assert limiter is not None
        assert self._status is not None
        measured = self._status.position
        if not self._was_unseen or self._drift.explains(limiter.position, measured, safety.displacement):
            self._drift.value = limiter.position - measured

    def _set_out(self, before: SafetyState, status: ArmStatus) -> None:
        """Begin to move, or go on after a pause, at the path's nearest point; stay where that is too far."""
        goes_on = before.mode is Mode.PAUSED
        if goes_on:
            assert self._limiter is not None
            here = self._limiter.stop() - self._drift.value
        else:
            here = self._start(status)
        if not self._playout.distance(here) <= self._parameters.safety.off_path:
            self.state = SafetyState(Mode.STOPPED, Cause.GAP)
            return
        if not goes_on:
            self._rest_at(here)
            self._p_WE_begun = self._tip.position(here)
        self._playout.resume_near(here)

    def _start(self, status: ArmStatus) -> NDArray[np.float64]:
        """Where commands begin at the operator's word, rad [7]: where the arm is, or where they hold it."""
        if self._limiter is None or self.mode == VELOCITY:
            return status.position
        return self._limiter.position

    def _rest_at(self, position: NDArray) -> None:
        """Commands are those of an arm at rest at joint angles [7], rad."""
        if self._limiter is None:
            self._limiter = CommandLimiter(position, self._robot, self.period, self._parameters.limits)
        self._limiter.restart(position)
        self._drift.restart()
        self._playout.halt()

    def _has_no_hearer(self, seen: Observation) -> bool:
        """Whether a command would be heard by nobody, or by somebody who was not there when it was planned."""
        if self._limiter is None or self.state.may_move:
            return self._limiter is None
        if self._is_silent:
            return True
        is_lost = seen.robot_mode != MOVE or self.state.cause in LOST
        if is_lost and not seen.lag <= self._parameters.safety.largest_gap:
            return True
        return self._limiter.at_rest and (is_lost or status_is_old(seen, self._parameters.safety))

    def _fall_silent(self) -> NDArray[np.float64] | None:
        """Send nothing more, in velocity mode after a last zero."""
        last = np.zeros(7) if self.mode == VELOCITY and not self._is_silent else None
        self._is_silent = True
        if self.state.mode is not Mode.PAUSED:  # a pause goes on from where it was
            self._limiter = None
        return last

    def brake(self) -> NDArray[np.float64] | None:
        """The command [7] of one period of coming to rest, whatever is known: nothing is looked at any more."""
        if self._limiter is None or self._is_silent:
            return None
        self._limiter.stop()
        return self._command()

    def _command(self) -> NDArray[np.float64]:
        assert self._limiter is not None
        self._is_silent = False
        return self._limiter.velocity if self.mode == VELOCITY else self._limiter.position

    def _look(
        self, now: float, status: ArmStatus | None, image_time: float | None, target: Target | None
    ) -> Observation:
        gap = self._gap_before(status)
        self._status = status
        limiter, measured = self._limiter, np.zeros(7) if status is None else status.position
        rest = measured if limiter is None else limiter.rest_position - self._drift.value
        time = self._playout.time
        return Observation(
            now=now,
            status_time=None if status is None else status.time,
            status_gap=gap,
            robot_mode=0 if status is None else status.robot_mode,
            image_time=image_time,
            in_motion=self._playout.in_motion,
            contact_planned=time is not None and any(a <= time <= b for a, b in self._contacts),
            tip_force=0.0 if status is None else self._tip.force(measured, status.torque_external),
            p_WE=self._tip.position(rest),
            p_WE_begun=self._p_WE_begun,
            held_back=limiter is not None and limiter.held_back,
            contradicted=status is not None and status.contradicted,
            lag=0.0 if limiter is None else _largest(measured - (limiter.position - self._drift.value)),
            gap=0.0
            if limiter is None or target is None
            else _largest(target.position + self._drift.value - limiter.position),
        )

    def _gap_before(self, status: ArmStatus | None) -> float:
        """Largest time between statuses since the last one, s; 0 where there is no other."""
        last = self._status
        if status is None or last is None or status.time == last.time:
            return 0.0
        if status.time < last.time:  # a clock was set, or another driver speaks
            return np.inf
        return status.time - last.time if status.gap is None else status.gap

    def _take_drift_back(self, now: float) -> None:
        """Velocity mode: see VelocityDrift."""
        if self.mode == VELOCITY:
            assert self._limiter is not None
            assert self._status is not None
            told, speed = self._limiter.position, self._limiter.velocity
            self._drift.take_back(now - self._status.time, told, speed, self._status.position)


def _largest(difference: NDArray) -> float:
    return float(np.abs(difference).max())
