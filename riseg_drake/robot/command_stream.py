"""The command path: targets and status in, one command every 5 ms out, or none while the arm is not ready.

All of it is arithmetic on what it is given, time included; the process around it only waits and sends.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from riseg_drake.robot.command_limiter import CommandLimiter, CommandLimits, Target
from riseg_drake.robot.limits import RobotLimits
from riseg_drake.robot.supervisor import (
    MOVE,
    Cause,
    Mode,
    Observation,
    SafetyParameters,
    SafetyState,
    ended,
    released,
    supervise,
)
from riseg_drake.robot.target_playout import PlayoutParameters, TargetPlayout

POSITION, VELOCITY = "position", "velocity"
LONGEST_STOP = 0.25
"""A stop must be possible in this time, s: 0.3 s less some periods in which its cause is noticed."""


@dataclass
class CommandParameters:
    """What the arm is sent, and when it must stop."""

    mode: str = field(default=VELOCITY, metadata={"choices": (POSITION, VELOCITY)})
    """What is commanded: joint angles or their velocities; the arm's driver must be in the same mode."""
    rate: float = 200.0
    """Commands a second."""
    limits: CommandLimits = field(default_factory=CommandLimits)
    """Shares of the joints' limits; motions are planned with smaller ones."""
    playout: PlayoutParameters = field(default_factory=PlayoutParameters)
    safety: SafetyParameters = field(default_factory=SafetyParameters)

    def check(self, robot: RobotLimits) -> None:
        """Raise ValueError for settings with which a robot could not stop in time."""
        if not 100 <= self.rate <= 1000:
            raise ValueError(f"rate: {self.rate} commands a second; expected 100 to 1000")
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
    """Wall time, s."""
    position: NDArray[np.float64]
    """Measured joint angles, rad [7]."""
    velocity: NDArray[np.float64]
    """rad/s [7]"""
    torque_external: NDArray[np.float64]
    """External torques as the driver gives them, N m [7]; only their size is used."""
    robot_mode: int

    def shifted(self, offset: float) -> "ArmStatus":
        """The same, said `offset` s later."""
        return replace(self, time=self.time + offset) if offset else self


@dataclass(frozen=True)
class TipGeometry:
    """What the command path needs to know of the arm's shape."""

    position: Callable[[NDArray], NDArray[np.float64]]
    """q [7] -> p_WE [3], m."""
    jacobian: Callable[[NDArray], NDArray[np.float64]]
    """q [7] -> J [6, 7] with V_WE = J dq/dt."""

    def force(self, q: NDArray, torque: NDArray) -> float:
        """Size of the force at the tip, N, that explains external torques [7] best."""
        wrench = np.linalg.lstsq(self.jacobian(q).T, torque, rcond=0.02)[0]
        return float(np.linalg.norm(wrench[3:]))


class CommandStream:
    """See above. `state` is what the supervisor thinks; `position` what was commanded last, rad [7]."""

    DRIFT_GAIN = 1.0
    """Velocity mode: the arm's drift is taken back with this rate, 1/s ..."""
    DRIFT_SPEED = 0.01
    """... at most this fast, rad/s, ..."""
    SLOW = 0.1
    """... and only while no joint is faster than this, rad/s: in fast motion lag looks like drift."""

    def __init__(self, parameters: CommandParameters, tip: TipGeometry, robot: RobotLimits):
        parameters.check(robot)
        self._parameters = parameters
        self._robot = robot
        self._tip = tip
        self.mode = parameters.mode
        self.period = 1 / parameters.rate
        """Time from one step to the next, s."""
        self._playout = TargetPlayout(parameters.playout)
        self._limiter: CommandLimiter | None = None  # None: the next command is where the arm is
        self._drift = np.zeros(7)
        self._contacts: list[tuple[float, float]] = []
        self.state = SafetyState()

    @property
    def position(self) -> NDArray[np.float64] | None:
        """The last command, rad [7]; None while none is sent."""
        return None if self._limiter is None else self._limiter.position

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

    def add_target(self, time: float, position: NDArray) -> None:
        """Joint angles [7], rad, for a wall time, s. Raises ValueError where it cannot be taken."""
        self._playout.add(time, position)

    def expect_contact(self, start: float, end: float) -> None:
        """Targets between these times, s, are a push: the force allowed is that of a push."""
        self._contacts = [(a, b) for a, b in self._contacts if b > (self._playout.time or 0.0)]
        self._contacts.append((start, end))

    def release(self) -> None:
        """The operator's word that a stopped arm may move again."""
        self.state = released(self.state)
        if self._limiter is not None:
            self._limiter.held_back = False

    def begin_at_rest(self, position: NDArray) -> None:
        """Go on from joint angles [7], rad, where the arm came to rest because nothing was sent for long."""
        if self._limiter is None:
            return
        self._limiter.restart(position)
        self._drift = np.zeros(7)
        self._playout.halt()
        self._playout.resume_near(position)

    def end(self, cause: Cause) -> None:
        """Come to rest for good."""
        if self.state.mode is not Mode.ENDED:
            self.state = ended(cause)

    def step(
        self, now: float, status: ArmStatus | None, image_time: float | None
    ) -> NDArray[np.float64] | None:
        """The command of one period: joint angles or velocities [7] by mode; None while there is none.

        `now` and `image_time`, that of the newest picture, are in s.
        """
        could_move = self.state.may_move
        target = self._playout.advance(self.period) if could_move else None
        self.state = supervise(self.state, self._look(now, status, image_time, target), self._parameters.safety)
        if self.state.may_move and not could_move and self._limiter is not None:
            self._playout.resume_near(self._limiter.position - self._drift)
        if self._limiter is None:
            if not self.state.may_move or status is None:
                return None
            self._limiter = CommandLimiter(status.position, self._robot, self.period, self._parameters.limits)
            self._drift = np.zeros(7)
            self._playout.resume_near(status.position)
            return self._command()  # the first command: where the arm is
        if self.state.may_move and could_move and target is not None:
            self._correct_drift(status)
            self._limiter.follow(target._replace(position=target.position + self._drift))
        else:
            self._limiter.stop()
        if not self.state.may_move:
            self._playout.halt()
            if status is not None and status.robot_mode != MOVE and self._limiter.at_rest:
                # It follows nothing now; when it is ready again, it begins anew from where it is.
                self._limiter = None
                return np.zeros(7) if self.mode == VELOCITY else None
        return self._command()

    def _command(self) -> NDArray[np.float64]:
        assert self._limiter is not None
        return self._limiter.velocity if self.mode == VELOCITY else self._limiter.position

    def _look(
        self, now: float, status: ArmStatus | None, image_time: float | None, target: Target | None
    ) -> Observation:
        limiter, measured = self._limiter, np.zeros(7) if status is None else status.position
        rest = measured if limiter is None else limiter.rest_position - self._drift
        time = self._playout.time
        return Observation(
            now=now,
            status_time=None if status is None else status.time,
            robot_mode=0 if status is None else status.robot_mode,
            image_time=image_time,
            in_motion=self._playout.in_motion,
            contact_planned=time is not None and any(a <= time <= b for a, b in self._contacts),
            tip_force=0.0 if status is None else self._tip.force(measured, status.torque_external),
            p_WE=self._tip.position(rest),
            held_back=limiter is not None and limiter.held_back,
            lag=0.0 if limiter is None else _largest(measured - (limiter.position - self._drift)),
            gap=0.0
            if limiter is None or target is None
            else _largest(target.position + self._drift - limiter.position),
        )

    def _correct_drift(self, status: ArmStatus | None) -> None:
        """Velocity mode: what was commanded is not quite where the arm came to."""
        assert self._limiter is not None
        if self.mode != VELOCITY or status is None or _largest(self._limiter.velocity) > self.SLOW:
            return
        error = self._limiter.position - self._drift - status.position
        speed = np.clip(self.DRIFT_GAIN * error, -self.DRIFT_SPEED, self.DRIFT_SPEED)
        self._drift = self._drift + speed * self.period


def _largest(difference: NDArray) -> float:
    return float(np.abs(difference).max())
