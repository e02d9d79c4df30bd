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
_WINDOW = 0.05  # s, over which speeds are judged
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
    jitter: float = 0.005
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
        self._rate = np.zeros(7)  # of the targets, from one to the next
        self._utime: int | None = None  # of the last command of the stream
        self._mark: tuple[int, NDArray, NDArray] | None = None  # a stamp, target, and speed before it

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
        config, position = self._config, self._config.control_mode == "position"
        gap = 0.005 if self._utime is None else (utime - self._utime) / 1e6
        gap = min(max(gap, _TICK), config.expire_sec)
        allowed = min(gap, _LONGEST_PREDICTION)
        step = target - self._target
        if position:
            surprise = np.abs(step - self._rate * gap)
            forgiven = PANDA_LIMITS.acceleration * allowed**2 + np.abs(self._rate) * config.jitter + config.step
            reason = "joint_motion_generator_velocity_discontinuity"
        else:
            surprise = np.abs(step)
            forgiven = PANDA_LIMITS.acceleration * (allowed + config.jitter) + 20 * config.step
            reason = "joint_motion_generator_acceleration_discontinuity"
        if (surprise > forgiven).any():
            return self.enter_reflex(reason)
        if position and not PANDA_LIMITS.contains(target):
            return self.enter_reflex("joint_motion_generator_position_limits_violation")
        if not position and (np.abs(target) > PANDA_LIMITS.velocity).any():
            return self.enter_reflex("joint_motion_generator_velocity_limits_violation")
        if position:
            self._judge_speed(target, utime)
        self._rate = step / gap
        self._target, self._utime = target, utime

    def _judge_speed(self, q: NDArray, utime: int) -> None:
        """Velocity and acceleration of a stream of positions, over windows that even out the jitter."""
        if self._mark is None:
            self._mark = (utime, q, np.zeros(7))
            return
        since, q_then, v_then = self._mark
        window = (utime - since) / 1e6
        if window < _WINDOW:
            return
        uncertain = self._config.jitter / window
        v = (q - q_then) / window
        if (np.abs(v) > PANDA_LIMITS.velocity * (1 + uncertain)).any():
            return self.enter_reflex("joint_motion_generator_velocity_limits_violation")
        # Mean speeds of two windows are as far apart as the middles of the windows.
        most = PANDA_LIMITS.acceleration * (window + self._config.jitter) + 2 * uncertain * np.abs(v) + 0.02
        if (np.abs(v - v_then) > most).any():
            return self.enter_reflex("joint_motion_generator_acceleration_discontinuity")
        self._mark = (utime, q, v)


def _limited(dv: NDArray) -> NDArray:
    """A change of speed [7], rad/s, cut to what the joints can do in one tick."""
    most = PANDA_LIMITS.acceleration * _TICK
    return np.clip(dv, -most, most)
