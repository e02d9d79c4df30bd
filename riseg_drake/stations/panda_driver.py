"""What the process of drake-franka-driver does with commands and with the robot, tick by tick, and how it ends.

The driver holds each command until the next, at the robot's 1 kHz; libfranka smooths what it is given and
limits its rates, and the robot follows. Read in the driver's source (RobotLocomotion/drake-franka-driver,
franka_driver.cc: a low pass of 30 Hz, `limit_rate`), in libfranka's, and in the Franka Control Interface
documentation.

Whatever goes wrong is an exception in `franka::Robot::control`, thrown before the callback that publishes the
status: so a controlling driver never tells of a reflex or of the stop button. It catches the exception, asks
the robot to recover and ends, with exit code 0; where the stop button is pressed the robot refuses that too,
and the process aborts. It never starts anew by itself.
"""

from dataclasses import dataclass, field

import numpy as np
from drake import lcmt_panda_command, lcmt_panda_status
from numpy.typing import NDArray

from riseg_drake.robot.limits import RobotLimits
from riseg_drake.stations.motion_judge import MotionJudge
from riseg_drake.stations.panda_robot import MOVE, REFLEX, USER_STOPPED, PandaRobot
from riseg_drake.stations.rate_limiter import TICK, low_pass_gain
from riseg_drake.stations.stream_judge import StreamJudge

ENDED, ABORTED, KILLED = 0, 134, 137
"""Exit codes of the driver's process as a shell shows them: by itself, SIGABRT, SIGKILL."""

_EXPECTED = {
    "velocity": lcmt_panda_status.CONTROL_MODE_VELOCITY,
    "position": lcmt_panda_status.CONTROL_MODE_POSITION,
}


@dataclass
class PandaDriverConfig:
    """How the driver was started, how strict the robot is, and how well it measures itself."""

    control_mode: str = field(default="velocity", metadata={"choices": ("status_only", "velocity", "position")})
    """The driver's --control_mode."""
    expire_sec: float = field(default=0.1, metadata={"least": 0.0, "most": 10.0})
    """Age by wall clock at which a command has expired, s."""
    low_pass_freq: float = field(default=30.0, metadata={"least": 1.0, "most": 1000.0})
    """Cut-off of the filter that every command passes, Hz."""
    startup: float = field(default=1.0, metadata={"least": 0.0, "most": 60.0})
    """From the driver's start to its first status, s: connecting, the download of the robot's model, three
    settings. Assumed; nobody has published a figure."""
    survives_stops: bool = False
    """Whether the driver lives on after a reflex and a user stop, tells of them (robot_mode 4 and 5) and goes
    on when the robot has recovered. The real one does not."""
    position_noise: float = field(default=1e-4, metadata={"least": 0.0, "most": 0.1})
    """Standard deviation of the measured joint angles, rad. In the printout of an idle robot in the Franka
    Control Interface documentation ("Getting started", echo_robot_state) q - q_d is 0.7e-4 rms, 1.6e-4 at
    most."""
    velocity_noise: float = field(default=7e-3, metadata={"least": 0.0, "most": 1.0})
    """Of the measured joint velocities, rad/s: dq in that printout is 7.3e-3 rms (it is the derivative of the
    noisy angles)."""
    jitter: float = field(default=0.003, metadata={"least": 0.0, "most": 0.1})
    """By how much a command's stamp may be off the time that it was planned for, s."""
    step: float = field(default=5e-4, metadata={"least": 0.0, "most": 1.0})
    """Discontinuity that is always forgiven, rad (in velocity mode 20 times this, rad/s)."""


@dataclass(frozen=True)
class DriverEnd:
    """How the driver's process ended."""

    code: int
    """Its exit code: ENDED, ABORTED or KILLED."""
    reason: str

    def __str__(self) -> str:
        return f"exit code {self.code}: {self.reason}"


class PandaDriver:
    """The driver's process, and the robot behind it; `tick` once a millisecond, `receive` in between.

    It runs from the beginning, with the robot at q [7], rad. `end` is None while the process lives; `judge`
    sees every tick of a controlled robot. `config` is how it was started.
    """

    def __init__(self, config: PandaDriverConfig, q: NDArray, limits: RobotLimits):
        self.config = config
        self._gain = low_pass_gain(config.low_pass_freq)
        self.robot = PandaRobot(limits, q)
        self.judge = MotionJudge(self.robot.limiter)
        is_velocity = config.control_mode == "velocity"
        self._stream_judge = StreamJudge(limits, is_velocity, config.jitter, config.step)
        self._command: lcmt_panda_command | None = None
        self._connects_at: int | None = None
        self.end: DriverEnd | None = None
        self._begin()

    @property
    def is_connected(self) -> bool:
        """Whether the process publishes the robot's state and hears commands."""
        return self.end is None and self._connects_at is None

    @property
    def _controls(self) -> bool:
        return self.config.control_mode != "status_only"

    def receive(self, command: lcmt_panda_command) -> None:
        """A command has come; of several in one tick the last one counts, and none that a dead driver gets."""
        if self.is_connected:
            self._command, self._is_new = command, True

    def start(self, now: int) -> bool:
        """Start the process again at a wall time, us; False where it lives."""
        if self.end is None:
            return False
        self.end, self._connects_at = None, now + int(1e6 * self.config.startup)
        return True

    def kill(self) -> None:
        """The process is killed; a robot that it controlled misses its commands, and stops by a reflex."""
        if self.end is None:
            if self.robot.mode == MOVE:
                self.robot.enter_reflex("communication_constraints_violation")
            self._end(KILLED, "killed")

    def miss(self) -> None:
        """Time was left out in which commands may have come: the next one is not judged by those before."""
        self._stream_judge.miss()

    def tick(self, now: int) -> None:
        """One millisecond of driver and robot; `now` is wall time, us."""
        if self._connects_at is not None and now >= self._connects_at:
            self._connects_at = None
            self._begin()
        if self.is_connected and self.robot.mode == MOVE:
            self._poll(now)
        if self.is_connected and self.robot.mode == MOVE:
            self._follow()
        else:
            self.robot.stand()
        if self.is_connected and self._controls and self.robot.mode != MOVE:
            self._lose_control()

    def _begin(self) -> None:
        """What comes once the driver is connected."""
        if self._controls and not self.robot.begin_control():
            self._lose_control()
        self._command, self._is_new = None, False
        self._hold(self.robot.q_d)

    def _lose_control(self) -> None:
        """The robot takes no commands: recover it and end, or abort; or wait, if the driver is of that kind."""
        robot = self.robot
        if self.config.survives_stops:
            self._command = None
            if robot.begin_control():
                self._hold(robot.q_d)
        elif robot.mode == USER_STOPPED:
            self._end(ABORTED, "the stop button is pressed, and the robot refuses to recover")
        else:
            reason = f"reflex {robot.reflex_reason}" if robot.mode == REFLEX else "the robot is not idle"
            robot.recover()
            self._end(ENDED, f"{reason}; the robot was told to recover")

    def _end(self, code: int, reason: str) -> None:
        self.robot.end_control()
        self._connects_at = None
        self.end = DriverEnd(code, reason)

    def _hold(self, q: NDArray) -> None:
        """No stream is coming in: stay at q [7], or at zero speed."""
        self._target = q.copy() if self.config.control_mode != "velocity" else np.zeros(7)
        self._stream_judge.begin()

    def _follow(self) -> None:
        """One tick of what libfranka makes of the target."""
        robot, a_before = self.robot, self.robot.a_d
        if self.config.control_mode == "position":
            smooth = self._gain * (self._target - robot.q_d) / TICK
        else:
            smooth = robot.v_d + self._gain * (self._target - robot.v_d)
        q = robot.q_d
        robot.follow(robot.limiter.limit(smooth, q, robot.v_d, robot.a_d))
        self.judge.take(q, robot.v_d, robot.a_d, (robot.a_d - a_before) / TICK)

    def _poll(self, now: int) -> None:
        """What the driver does with its newest command, in the driver's order."""
        command = self._command
        if command is None:
            return
        mode = self.config.control_mode
        present = {
            "position": command.num_joint_position,
            "velocity": command.num_joint_velocity,
            "torque": command.num_joint_torque,
        }
        if command.control_mode_expected != _EXPECTED[mode]:
            return self._end(
                ENDED,
                f"control_mode_expected is {command.control_mode_expected}, but the driver runs with "
                f"--control_mode={mode}, which is {_EXPECTED[mode]}",
            )
        for other in sorted(present.keys() - {mode}):
            if present[other]:
                return self._end(ENDED, f"joint_{other} must be empty with --control_mode={mode}")
        if abs(now - command.utime) > 1e6 * self.config.expire_sec:
            self._command = None
            self._hold(self._target)
            return
        if present[mode] != 7:
            return self._end(ENDED, f"joint_{mode} has {present[mode]} values, not 7")
        if self._is_new:
            self._is_new = False
            self._take(np.array(getattr(command, f"joint_{mode}"), np.float64), command.utime)

    def _take(self, target: NDArray, utime: int) -> None:
        """Follow a new command, unless it breaks with those before it."""
        if not np.isfinite(target).all():
            return self._end(ENDED, "commanding value is infinite or NaN")
        longest_gap = self.config.expire_sec
        reason = self._stream_judge.judge(target, utime, self._target, longest_gap, self.robot.q_d)
        if reason:
            return self.robot.enter_reflex(f"joint_motion_generator_{reason}")
        self._target = target
