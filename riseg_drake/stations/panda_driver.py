"""What drake-franka-driver and the Panda behind it make of a stream of commands, tick by tick.

The driver holds each command until the next, at the robot's 1 kHz; the robot smooths what it is given,
follows it, and refuses what its joints could not do. Read in the driver's source (RobotLocomotion/
drake-franka-driver) and in the Franka Control Interface documentation.
"""

from dataclasses import dataclass, field

import numpy as np
from drake import lcmt_panda_command, lcmt_panda_status
from numpy.typing import NDArray

from riseg_drake.robot.limits import PANDA_LIMITS

MOVE = lcmt_panda_status.kMove
IDLE = lcmt_panda_status.kIdle
REFLEX = lcmt_panda_status.kReflex
USER_STOPPED = lcmt_panda_status.kUserStopped

_EXPECTED = {
    "velocity": lcmt_panda_status.CONTROL_MODE_VELOCITY,
    "position": lcmt_panda_status.CONTROL_MODE_POSITION,
}
_TICK = 1e-3  # s, of the robot
_WINDOW = 0.025  # s; acceleration is judged by the mean speeds in two of them, one after the other
_LONG_WINDOW = 0.1  # s; speed is judged by its mean in one of these
_LONGEST_PREDICTION = 0.02  # s; after a longer gap no more deviation is forgiven


class DriverEndedError(RuntimeError):
    """The driver ends, as the real one does after a command that it was not started for."""


@dataclass
class PandaDriverConfig:
    """How the driver was started, and how strict the robot is."""

    control_mode: str = field(default="position", metadata={"choices": ("status_only", "velocity", "position")})
    """The driver's --control_mode."""
    expire_sec: float = 0.1
    """Age by wall clock at which a command has expired, s."""
    low_pass_freq: float = 30.0
    """Cut-off of the filter that every command passes, Hz."""
    jitter: float = 0.003
    """By how much a command's stamp may be off the time that it was planned for, s."""
    step: float = 5e-4
    """Discontinuity that is always forgiven, rad (in velocity mode 20 times this, rad/s)."""


class PandaDriver:
    """Driver and robot as one state machine; `tick` once a millisecond, `receive` in between.

    `q_d`, `v_d`, `a_d` [7] are what the robot sets itself at each tick (rad, rad/s, rad/s^2),
    `robot_mode` is one of MOVE, IDLE, REFLEX and USER_STOPPED, `reflex_reason` is libfranka's word.
    """

    def __init__(self, config: PandaDriverConfig, q: NDArray):
        self._config = config
        self._gain = _TICK / (_TICK + 1 / (2 * np.pi * config.low_pass_freq))
        self.q_d = np.array(q, np.float64)
        self.v_d = np.zeros(7)
        self.a_d = np.zeros(7)
        self.reflex_reason = ""
        self.robot_mode = IDLE if config.control_mode == "status_only" else MOVE
        self._start(self.q_d)

    def _start(self, q: NDArray) -> None:
        self._command: lcmt_panda_command | None = None
        self._is_new = False
        self._hold(q)

    def _hold(self, q: NDArray) -> None:
        """No stream is coming in: stay at q [7], or at zero speed."""
        self._target = q.copy() if self._config.control_mode != "velocity" else np.zeros(7)
        self._stream: list[tuple[int, NDArray]] = []  # stamps and targets of the last tenth of a second

    @property
    def is_moving(self) -> bool:
        """Whether the robot has set itself more than 1 mrad/s in any joint."""
        return bool(np.abs(self.v_d).max() > 1e-3)

    def receive(self, command: lcmt_panda_command) -> None:
        """A command has come; of several in one tick the last one counts."""
        self._command, self._is_new = command, True

    def enter_reflex(self, reason: str) -> None:
        """The robot stops by itself, and waits for `recover`."""
        if self.robot_mode == MOVE:
            self.robot_mode, self.reflex_reason = REFLEX, reason

    def user_stop(self) -> None:
        """Somebody pressed the stop button."""
        self.robot_mode = USER_STOPPED

    def die(self) -> None:
        """The driver is gone: the robot stops, and hears nothing until `restart`."""
        self.robot_mode = IDLE

    def restart(self) -> None:
        """The driver was started anew, or the operator has unlocked the robot: no command, hold still."""
        self.robot_mode = IDLE if self._config.control_mode == "status_only" else MOVE
        self.reflex_reason = ""
        self._start(self.q_d)

    def tick(self, now: int) -> None:
        """One millisecond of the robot; `now` is wall time, us. Raises DriverEndedError."""
        if self.robot_mode == MOVE:
            self._poll(now)
        v_before = self.v_d
        if self.robot_mode != MOVE:
            self._command = None
            self._advance(_limited(-self.v_d))
        elif self._config.control_mode == "position":
            q = self.q_d + self._gain * (self._target - self.q_d)
            self.v_d, self.q_d = (q - self.q_d) / _TICK, q
        else:
            self._advance(_limited(self._gain * (self._target - self.v_d)))
            if not PANDA_LIMITS.contains(self.q_d):
                self.enter_reflex("joint_position_limits_violation")
        self.a_d = (self.v_d - v_before) / _TICK

    def _advance(self, dv: NDArray) -> None:
        self.v_d = self.v_d + dv
        self.q_d = self.q_d + _TICK * self.v_d

    def _poll(self, now: int) -> None:
        """What the driver does with its newest command, in the driver's order."""
        command = self._command
        if command is None:
            return
        mode = self._config.control_mode
        present = {
            "position": command.num_joint_position,
            "velocity": command.num_joint_velocity,
            "torque": command.num_joint_torque,
        }
        if command.control_mode_expected != _EXPECTED[mode]:
            raise DriverEndedError(
                f"control_mode_expected is {command.control_mode_expected}, but the driver runs with "
                f"--control_mode={mode}, which is {_EXPECTED[mode]}"
            )
        for other in sorted(present.keys() - {mode}):
            if present[other]:
                raise DriverEndedError(f"joint_{other} must be empty with --control_mode={mode}")
        if abs(now - command.utime) > 1e6 * self._config.expire_sec:
            self._command = None
            self._hold(self._target)
            return
        if present[mode] != 7:
            raise DriverEndedError(f"joint_{mode} has {present[mode]} values, not 7")
        if self._is_new:
            self._is_new = False
            self._take(np.array(getattr(command, f"joint_{mode}"), np.float64), command.utime)

    def _take(self, target: NDArray, utime: int) -> None:
        """Follow a new command, unless it breaks with those before it."""
        if not np.isfinite(target).all():
            raise DriverEndedError("commanding value is infinite or NaN")
        if not self._stream:  # it stood still until now
            self._stream = [(utime - int(2e6 * _LONG_WINDOW), self._target), (utime - 5000, self._target)]
        gap = (utime - self._stream[-1][0]) / 1e6
        gap = min(max(gap, _TICK), self._config.expire_sec)
        break_of_stream = (
            self._position_break if self._config.control_mode == "position" else self._velocity_break
        )
        reason = break_of_stream(target, gap)
        if reason:
            return self.enter_reflex(f"joint_motion_generator_{reason}")
        self._target = target
        earliest = utime - int(2e6 * _LONG_WINDOW)
        self._stream = [item for item in self._stream if earliest <= item[0] < utime] + [(utime, target)]

    def _velocity_break(self, v: NDArray, gap: float) -> str:
        """What is wrong with a velocity [7] that comes `gap` s after the last; "" if nothing is."""
        if (np.abs(v) > PANDA_LIMITS.velocity).any():
            return "velocity_limits_violation"
        most = PANDA_LIMITS.acceleration * (min(gap, _LONGEST_PREDICTION) + self._config.jitter)
        jump = np.abs(v - self._target) > most + 20 * self._config.step
        return "acceleration_discontinuity" if jump.any() else ""

    def _position_break(self, q: NDArray, gap: float) -> str:
        """What is wrong with a position [7] that comes `gap` s after the last; "" if nothing is."""
        jitter = self._config.jitter
        q1, q2, q3, q4 = (self._planned_before(age) for age in (0, _WINDOW, 2 * _WINDOW, _LONG_WINDOW))
        v, v_earlier = (q1 - q2) / _WINDOW, (q2 - q3) / _WINDOW
        change = np.abs(v - v_earlier)
        forgiven = (
            PANDA_LIMITS.acceleration * min(gap, _LONGEST_PREDICTION) ** 2
            + change * gap  # the mean speed of a window lags behind while it grows
            + 2 * jitter * np.abs(v)
            + self._config.step
        )
        if (np.abs(q - q1 - v * gap) > forgiven).any():
            return "velocity_discontinuity"
        if not PANDA_LIMITS.contains(q):
            return "position_limits_violation"
        most = PANDA_LIMITS.acceleration * (_WINDOW + jitter) + 2 * jitter / _WINDOW * np.abs(v) + 0.02
        if (change > most).any():
            return "acceleration_discontinuity"
        if (np.abs(q1 - q4) > PANDA_LIMITS.velocity * (_LONG_WINDOW + 2 * jitter)).any():
            return "velocity_limits_violation"
        return ""

    def _planned_before(self, age: float) -> NDArray:
        """Where the stream was `age` s before its last command, [7]."""
        when = self._stream[-1][0] - 1e6 * age
        later = self._stream[-1]
        for earlier in reversed(self._stream[:-1]):
            if earlier[0] <= when:
                share = (when - earlier[0]) / (later[0] - earlier[0])
                return earlier[1] + share * (later[1] - earlier[1])
            later = earlier
        return later[1]


def _limited(dv: NDArray) -> NDArray:
    """A change of speed [7], rad/s, cut to what the joints can do in one tick."""
    most = PANDA_LIMITS.acceleration * _TICK
    return np.clip(dv, -most, most)
