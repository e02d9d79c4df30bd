"""What the driver of a real arm does in each of the robot's milliseconds, on clocks that are given.

The robot's state, the wall time and what has come from the network go in; what the robot is to do and what is
told of it come out. The process around it only waits for the robot, hands messages on, and does what it is
asked to: so all of this is tested without a robot, and with one that is stepped.

The arm moves only along commands that are fresh, one after the other, and begin where it is. Where they end in
motion, or are none, it brakes within the robot's limits, holds, says why, and follows nothing until the
operator's word has come: a message that was stamped after the stop.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum

import numpy as np
from drake import lcmt_panda_command, lcmt_panda_status
from numpy.typing import NDArray

from riseg_drake.robot.command_limiter import CommandLimiter, CommandLimits
from riseg_drake.robot.command_playout import DELAY, CommandPlayout
from riseg_drake.robot.limits import RobotLimits
from riseg_drake.robot.supervisor import MOVE
from riseg_drake.stations.rate_limiter import TICK

EXPIRY = 0.1
"""A command is too old, or of a time to come, by more than this, s; drake-franka-driver's own default."""
WORD_AGE = 2.0
"""Oldest word of the operator that counts, s; it is repeated, with the stamp of when it was said."""
LARGEST_GAP = 0.1
"""Commands of joint angles are refused this far from where the arm is told to be, rad."""
HELD = lcmt_panda_status.kOther
"""`robot_mode` that is told while the robot would move, but waits for the operator's word."""
LIMITS = CommandLimits(
    velocity=0.95,
    acceleration=0.9,
    jerk=0.7,
    stop_acceleration=0.9,
    stop_jerk=0.7,
    position_margin=0.005,
)
"""Shares of the robot's limits: more than any sender here asks for, so that its motions come through as they
are, stops with 0.8 of the acceleration included, and less than what the robot stops at."""
_FOLLOWS_CLOCK = 1e-3  # share of the clocks' difference that is made up for in a tick: within a second
_CLOCK_WAS_SET = 0.5  # s


@dataclass(frozen=True)
class RobotReading:
    """What the robot tells in one of its cycles."""

    time: float
    """By the robot's clock, s."""
    mode: int
    """`robot_mode` of lcmt_panda_status, which is franka::RobotMode."""
    position: NDArray[np.float64]
    """Measured, rad [7]."""
    velocity: NDArray[np.float64]
    """Measured, rad/s [7]."""
    torque: NDArray[np.float64]
    """Measured, N m [7]."""
    torque_external: NDArray[np.float64]
    """What the robot takes for forces from outside, N m [7]."""
    position_desired: NDArray[np.float64]
    """What the robot makes of the last command, rad [7]."""
    velocity_desired: NDArray[np.float64]
    """The same, rad/s [7]."""
    acceleration_desired: NDArray[np.float64]
    """The same, rad/s^2 [7]."""
    torque_desired: NDArray[np.float64]
    """The same, N m [7]."""
    success_rate: float
    """Share of the last 100 commands that reached the robot in time, 0 to 1."""
    errors: tuple[str, ...] = ()
    """Names of what is wrong, as libfranka has them."""


class Drive(Enum):
    """What the arm's driver does; each as one would say it."""

    WAITING = "holds: no commands"
    FOLLOWING = "follows commands"
    EXPIRED = "holds: commands ended in motion"
    REFUSED = "holds: a command was refused"
    LOST = "the robot takes no commands"
    ENDING = "ends"


LATCHED = frozenset({Drive.EXPIRED, Drive.REFUSED, Drive.LOST})
"""From these only the operator's word leads on."""


@dataclass
class DriveOutput:
    """What one step asks for."""

    command: NDArray[np.float64] | None
    """For the robot, rad or rad/s [7] by mode; None while it takes none."""
    status: lcmt_panda_status
    recover: bool = False
    """Whether the robot is to be recovered and its control begun, at the operator's word."""
    said: list[str] = field(default_factory=list)
    """Lines for the terminal, about what is new."""
    finished: bool = False
    """Whether the arm is at rest for good."""


class ArmDrive:
    """See above; `step` once a cycle of the robot. `state` is what it does, `reason` why, in detail."""

    def __init__(self, is_velocity: bool, robot: RobotLimits):
        """`is_velocity`: commands are velocities, and not joint angles."""
        self.is_velocity = is_velocity
        self._robot = robot
        self._playout = CommandPlayout(is_velocity)
        self._limiter: CommandLimiter | None = None  # None: the robot takes no commands
        self._offset: float | None = None  # of wall time to the robot's clock, s
        self._robot_time = -np.inf
        self._since = -np.inf  # wall time of the last stop that needs a word, s
        self.state = Drive.LOST
        self.reason = ""
        self._is_ending = False

    def begin(self, reading: RobotReading) -> None:
        """The robot takes commands from now on; they begin where it is."""
        self._limiter = CommandLimiter(reading.position_desired, self._robot, TICK, LIMITS)
        self._playout.begin()
        self._robot_time = reading.time
        self.state, self.reason = Drive.WAITING, ""

    def end(self) -> None:
        """Come to rest for good."""
        self._is_ending = True

    def lose(self, wall: float, reason: str) -> list[str]:
        """The robot takes no commands any more since a wall time, s; returns what to tell about it."""
        self._limiter = None
        self._playout.begin()
        if self.state is Drive.LOST and reason == self.reason:
            return []
        return self._latch(Drive.LOST, wall, reason)

    def step(
        self,
        wall: float,
        reading: RobotReading,
        commands: Sequence[lcmt_panda_command] = (),
        words: Sequence[lcmt_panda_command] = (),
    ) -> DriveOutput:
        """One cycle of the robot.

        Args:
            wall: wall time at which the robot told its state, s.
            reading: that state.
            commands: what came since the last step, in order.
            words: the same of the operator's words.
        """
        self._keep_time(wall, reading.time)
        said: list[str] = []
        recover = False
        for word in words:
            said_at = 1e-6 * word.utime
            if self.state in LATCHED and max(self._since, wall - WORD_AGE) < said_at < wall + EXPIRY:
                said += self._go_on()
                recover = self._limiter is None
        for command in commands:
            said += self._hear(command, wall)
        wanted = None if self._limiter is None else self._advance(wall, reading, said)
        at_rest = self._limiter is None or self._limiter.at_rest
        return DriveOutput(wanted, self._status(reading), recover, said, self._is_ending and at_rest)

    @property
    def at_rest(self) -> bool:
        """Whether what the robot is told stands still."""
        return self._limiter is None or self._limiter.at_rest

    def _keep_time(self, wall: float, robot_time: float) -> None:
        """The robot's clock goes evenly, and this process is woken when it may be."""
        error = 0.0 if self._offset is None else wall - robot_time - self._offset
        if self._offset is None or abs(error) > _CLOCK_WAS_SET:
            self._offset = wall - robot_time
        else:
            self._offset += _FOLLOWS_CLOCK * error

    def _is_fresh(self, message: lcmt_panda_command, wall: float) -> bool:
        return abs(wall - 1e-6 * message.utime) <= EXPIRY

    def _go_on(self) -> list[str]:
        self._playout.begin()
        if self._limiter is None:
            return ["the operator says that the arm may move: recovering the robot"]
        self.state, self.reason = Drive.WAITING, ""
        return ["the operator says that the arm may move"]

    def _latch(self, state: Drive, wall: float, reason: str) -> list[str]:
        self.state, self.reason, self._since = state, reason, wall
        self._playout.begin()
        return [f"{state.value}: {reason}; waits for the operator's word"]

    def _hear(self, command: lcmt_panda_command, wall: float) -> list[str]:
        """Take in a command, or refuse it; whatever comes late or twice is no news."""
        if self._limiter is None or self.state in LATCHED or self._is_ending:
            return []
        if not self._is_fresh(command, wall):
            return []
        flaw = _flaw(command, self.is_velocity)
        if flaw:
            return self._latch(Drive.REFUSED, wall, flaw)
        values = np.array(command.joint_velocity if self.is_velocity else command.joint_position, np.float64)
        off = 0.0 if self.is_velocity else float(np.abs(values - self._limiter.position).max())
        if off > LARGEST_GAP:
            return self._latch(Drive.REFUSED, wall, f"it is {off:.2f} rad from where the arm is")
        self._playout.add(1e-6 * command.utime, values, self._limiter.position)
        self.state = Drive.FOLLOWING
        return []

    def _advance(self, wall: float, reading: RobotReading, said: list[str]) -> NDArray[np.float64]:
        """The next command to the robot, rad or rad/s [7]."""
        assert self._limiter is not None
        assert self._offset is not None
        limiter = self._limiter
        if reading.time - self._robot_time > 1.5 * TICK:  # the robot has gone on by itself meanwhile
            limiter.go_on_from(reading.position_desired, reading.velocity_desired, reading.acceleration_desired)
        self._robot_time = reading.time
        if self.state is Drive.FOLLOWING and wall - self._playout.newest > EXPIRY:
            if self._playout.moves():
                said += self._latch(Drive.EXPIRED, wall, f"none for {EXPIRY:g} s")
            else:
                self._playout.begin()
                self.state = Drive.WAITING
        before = limiter.position
        follows = self.state is Drive.FOLLOWING and not self._is_ending
        target = self._playout.at(reading.time + self._offset - DELAY) if follows else None
        if target is not None and not np.abs(target.position - before).max() <= LARGEST_GAP:
            said += self._latch(Drive.REFUSED, wall, "the arm cannot follow so fast")
            target = None
        if target is None:
            limiter.stop()
        else:
            limiter.follow(target)
        # The mean over the tick: then the robot's own sum of velocities is where this trajectory is.
        return (limiter.position - before) / TICK if self.is_velocity else limiter.position

    def _status(self, reading: RobotReading) -> lcmt_panda_status:
        assert self._offset is not None
        message = lcmt_panda_status()
        message.utime = int(1e6 * (reading.time + self._offset))
        message.robot_utime = int(1e6 * reading.time)
        message.num_joints = 7
        message.joint_position = reading.position.tolist()
        message.joint_velocity = reading.velocity.tolist()
        message.joint_torque = reading.torque.tolist()
        message.joint_torque_external = reading.torque_external.tolist()
        message.joint_position_desired = reading.position_desired.tolist()
        message.joint_velocity_desired = reading.velocity_desired.tolist()
        message.joint_acceleration_desired = reading.acceleration_desired.tolist()
        message.joint_torque_desired = reading.torque_desired.tolist()
        message.control_command_success_rate = reading.success_rate
        is_held = reading.mode == MOVE and self.state in LATCHED
        message.robot_mode = HELD if is_held else reading.mode
        return message


def _flaw(command: lcmt_panda_command, is_velocity: bool) -> str:
    """Why a command cannot be followed, in a few words; empty where it can."""
    wanted, kind = (
        (lcmt_panda_status.CONTROL_MODE_VELOCITY, "velocity")
        if is_velocity
        else (lcmt_panda_status.CONTROL_MODE_POSITION, "position")
    )
    if command.control_mode_expected != wanted:
        return f"control_mode_expected is {command.control_mode_expected}; {wanted} with --mode {kind}"
    numbers = {
        "position": command.num_joint_position,
        "velocity": command.num_joint_velocity,
        "torque": command.num_joint_torque,
    }
    for name, number in numbers.items():
        expected = 7 if name == kind else 0
        if number != expected:
            return f"joint_{name} has {number} values; {expected} with --mode {kind}"
    values = command.joint_velocity if is_velocity else command.joint_position
    return "" if np.isfinite(values).all() else f"joint_{kind} has values that are no numbers"
