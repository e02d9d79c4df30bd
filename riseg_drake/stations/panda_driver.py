"""What drake-franka-driver and the Panda behind it make of a stream of commands, tick by tick.

The driver holds each command until the next, at the robot's 1 kHz; libfranka smooths what it is given and
limits its rates, and the robot follows. Read in the driver's source (RobotLocomotion/drake-franka-driver: a
low pass of 30 Hz, `limit_rate`), libfranka's, and the Franka Control Interface documentation.
"""

from dataclasses import dataclass, field

import numpy as np
from drake import lcmt_panda_command, lcmt_panda_status
from numpy.typing import NDArray

from riseg_drake.robot.limits import PANDA_LIMITS
from riseg_drake.stations.stream_judge import StreamJudge

MOVE = lcmt_panda_status.kMove
IDLE = lcmt_panda_status.kIdle
REFLEX = lcmt_panda_status.kReflex
USER_STOPPED = lcmt_panda_status.kUserStopped

_EXPECTED = {
    "velocity": lcmt_panda_status.CONTROL_MODE_VELOCITY,
    "position": lcmt_panda_status.CONTROL_MODE_POSITION,
}
_TICK = 1e-3  # s, of the robot


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
        self._judge = StreamJudge(config.control_mode == "velocity", config.jitter, config.step)
        self._start(self.q_d)

    def _start(self, q: NDArray) -> None:
        self._command: lcmt_panda_command | None = None
        self._is_new = False
        self._hold(q)

    def _hold(self, q: NDArray) -> None:
        """No stream is coming in: stay at q [7], or at zero speed."""
        self._target = q.copy() if self._config.control_mode != "velocity" else np.zeros(7)
        self._judge.begin()

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

    def miss(self) -> None:
        """Time was left out in which commands may have come: the next one is not judged by those before."""
        self._judge.miss()

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
            most = _TICK * PANDA_LIMITS.acceleration
            self.v_d = self.v_d - np.clip(self.v_d, -most, most)
        else:
            if self._config.control_mode == "position":
                smooth = self._gain * (self._target - self.q_d) / _TICK
            else:
                smooth = self.v_d + self._gain * (self._target - self.v_d)
            self.v_d = limit_rate(smooth, self.v_d, self.a_d)
            if not PANDA_LIMITS.contains(self.q_d + _TICK * self.v_d):
                self.enter_reflex("joint_position_limits_violation")
        self.q_d = self.q_d + _TICK * self.v_d
        self.a_d = (self.v_d - v_before) / _TICK

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
        reason = self._judge.judge(target, utime, self._target, self._config.expire_sec)
        if reason:
            return self.enter_reflex(f"joint_motion_generator_{reason}")
        self._target = target


def limit_rate(v: NDArray, v_d: NDArray, a_d: NDArray) -> NDArray[np.float64]:
    """The velocity [7], rad/s, of the next tick: `v`, as far as jerk, acceleration and velocity let it.

    libfranka's franka::limitRate. `v_d`, rad/s, and `a_d`, rad/s^2, are those of the last tick. The nearer
    a joint is to its greatest speed, the less acceleration is allowed towards it; nothing here brakes ahead
    of time, so that a step of positions is overshot.
    """
    limits = PANDA_LIMITS
    steepness = limits.jerk / limits.acceleration
    change = _TICK * limits.jerk
    wanted = np.clip((v - v_d) / _TICK, a_d - change, a_d + change)
    most = np.minimum(steepness * (limits.velocity - v_d), limits.acceleration)
    least = np.maximum(-steepness * (limits.velocity + v_d), -limits.acceleration)
    return v_d + _TICK * np.clip(wanted, least, most)
