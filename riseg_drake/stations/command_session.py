"""What the process that sends commands does in each round, on clocks that are given: messages in, commands out.

Whatever comes in, and whatever goes wrong in here, the arm goes on within its limits or comes to rest within
them: messages pass a door, and after any exception only the stop is followed that is kept ready for that.
"""

from collections import deque
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from drake import lcmt_panda_command, lcmt_panda_status
from numpy.typing import NDArray

from riseg_drake.robot.command_stream import VELOCITY, ArmStatus, CommandStream
from riseg_drake.robot.paced_commands import PacedCommands, StampedCommand
from riseg_drake.robot.supervisor import MOVE, Cause, Mode, SafetyState
from riseg_drake.stations.arm_messages import PictureDoor, StatusDoor

FINAL_COMMANDS = 20
"""How many commands at rest end the stream: zeros, in velocity mode."""
MOST_HEARD = 64
"""Messages of one channel that are looked at in one round, the newest: a flood of 10 kHz is 50 in 5 ms."""

FLOODED_FOR = 1.0
"""After a message that was left out more of the kind are looked for, s."""

DEAF = 0.02
"""Nobody has listened for a while where two rounds are so far apart, s: LCM keeps one message of a channel."""
LONGEST_DEAF = 0.3
"""Where nobody has listened for longer, a driver may have been started anew, s: that takes 0.5 s and more, of
which the largest `status_gap` leaves as much."""

RECOVERS_WITHIN = 5.0
"""A robot that takes no commands has so long to recover after the operator's word, s; then it counts."""
HAS_RECOVERED = 0.1
"""... and has, once it takes commands for so long, s."""


@dataclass(frozen=True)
class StreamReport:
    """How the stream is doing."""

    state: SafetyState
    position: NDArray[np.float64] | None
    """The last command, rad [7]; None while none is sent."""
    status: ArmStatus | None
    behind: float
    """How much motion is still to be played out, s."""
    done_until: float
    """Targets up to this time have been gone through, s; minus infinity before the first."""
    at_rest: bool
    off_path: float = 0.0
    """How far the arm is from its path, rad."""
    words: int = 0
    """How many words of the operator this report knows of."""
    refused: str = ""
    """Why targets were not taken, if they were not."""
    failed: str = ""
    """What went wrong in the process, if anything did: the arm is brought to rest."""
    left_out: dict[str, int] = field(default_factory=dict)
    """How many messages were not let in, by channel and kind."""


class CommandSession:
    """A CommandStream with its ears and its orders. Knows no clock, process or network."""

    def __init__(self, stream: CommandStream, now: float, status_channel: str, image_channel: str):
        """`now` is the time by a steady clock, s."""
        self._stream = stream
        self._paced = PacedCommands(stream, now)
        self._status_door = StatusDoor(status_channel)
        self._picture_door = PictureDoor(image_channel)
        self._statuses: deque[bytes] = deque(maxlen=MOST_HEARD)
        self._pictures: deque[bytes] = deque(maxlen=MOST_HEARD)
        self._status: ArmStatus | None = None
        self._image_time: float | None = None
        self._now, self._flooded_until = now, -np.inf
        self._deaf = self._was_deaf = 0.0  # s, since the last status, and between the one before and that
        self._final = 0
        self._refused = ""
        self._word_waits = False
        self._unready = -np.inf  # when the arm last took no commands, s
        self.word_said: float | None = None
        """When a word of the operator came that a robot must recover for first, by the clock of stamps, s."""
        self.failed = ""
        """What went wrong, in one line; empty while nothing has."""

    @property
    def is_over(self) -> bool:
        """Whether the arm is at rest for good, and was told so."""
        return self._final >= FINAL_COMMANDS

    @property
    def is_flooded(self) -> bool:
        """Whether messages of the arm were left out a moment ago."""
        return self._flooded_until > self._now

    def set_out(self, now: float) -> None:
        """Rounds begin at a time, s: what came while the process got ready is old, what followed it unknown."""
        self._statuses.clear()
        self._pictures.clear()
        self._now, self._paced = now, PacedCommands(self._stream, now)

    def hear_status(self, data: bytes) -> None:
        """A message has come from the arm's driver; it is looked at in the next round."""
        self._statuses.append(data)

    def hear_picture(self, data: bytes) -> None:
        """A message has come from the camera's driver."""
        self._pictures.append(data)

    def obey(self, word: str, *values: Any) -> None:
        """Do what the planning program says; anything that makes no sense is a failure. Never raises."""
        try:
            match word:
                case "target":
                    self._take_target(*values)
                case "contact":
                    self._stream.expect_contact(*values)
                case "release":
                    self._word_waits = True
                case "abandon":
                    self._stream.abandon_path()
                case "begin":
                    self._stream.begin_path()
                case "end":
                    self._stream.end(Cause.FINISHED)
                case _:
                    self.fail(ValueError(f"{word!r} is not known to the process that sends commands"))
        except Exception as error:
            self.fail(error)

    def end(self, cause: Cause) -> None:
        """Come to rest for good."""
        self._stream.end(cause)

    def fail(self, error: BaseException) -> None:
        """Come to rest for good, because something went wrong."""
        self.failed = self.failed or f"{type(error).__name__}: {' '.join(str(error).split())}"
        self._stream.end(Cause.FAULT)

    def next(self, steady: float, wall: float) -> StampedCommand | None:
        """One round: the command due now, by a steady clock and that of stamps, s; None while there is none."""
        command = None
        if not self.failed:
            try:
                self._listen(steady, steady - wall)
                self._hand_on_word(steady, wall)
                command = self._paced.next(steady, wall, self._status, self._image_time)
            except Exception as error:  # whatever it is: an arm in motion must come to rest
                self.fail(error)
        if self.failed:
            command = self._paced.brake(steady, wall)
        if self._stream.state.mode is Mode.ENDED and self._stream.at_rest:
            self._final = self._final + 1 if command is not None else FINAL_COMMANDS
        return command

    def was_sent(self, command: StampedCommand) -> None:
        """Take note of it: it is what the driver holds until the next."""
        self._paced.was_sent(command)

    def wait(self, steady: float) -> float:
        """How long there is nothing to do, s."""
        return self._paced.wait(steady)

    def report(self) -> StreamReport:
        """How things stand."""
        stream, doors = self._stream, (self._status_door.refused, self._picture_door.refused)
        return StreamReport(
            state=stream.state,
            position=stream.position,
            status=self._status,
            behind=stream.behind,
            done_until=stream.done_until,
            at_rest=stream.at_rest,
            off_path=stream.off_path if stream.state.mode is Mode.STOPPED else 0.0,
            words=stream.words,
            refused=self._refused,
            failed=self.failed,
            left_out={f"{door.channel}: {kind}": n for door in doors for kind, n in door.counts.items()},
        )

    def _take_target(self, time: float, position: NDArray) -> None:
        if position.shape != (7,) or not (np.isfinite(time) and np.isfinite(position).all()):
            raise RuntimeError(f"a target that is no posture: {position} at {time}")
        try:
            self._stream.add_target(time, position)
        except ValueError as error:
            self._refused = str(error)

    def _listen(self, now: float, shift: float) -> None:
        """Let in what has come; `shift` brings a stamp to the clock of `now`, s."""
        pause, self._now = now - self._now, now
        self._deaf += pause if pause > DEAF else 0.0
        gap = 0.0
        while self._statuses:
            status = self._status_door.admit(self._statuses.popleft(), now, shift)
            if status is None:
                self._flooded_until = now + FLOODED_FOR
            else:
                gap = max(gap, self._gap_before(status))
                # What is stamped a little ahead is no younger than what comes now.
                self._status = replace(status, time=min(status.time, now), gap=gap)
        while self._pictures:
            sent = self._picture_door.admit(self._pictures.popleft(), now, shift)
            self._image_time = self._image_time if sent is None else min(sent, now)
        if self._status is not None:
            contradicted = self._status_door.contradicts_itself(now)
            if contradicted is not self._status.contradicted:
                self._status = replace(self._status, contradicted=contradicted)

    def _hand_on_word(self, now: float, wall: float) -> None:
        """The operator's word holds once the arm takes commands; after a stop of its own it recovers first."""
        if self._status is not None and self._status.robot_mode != MOVE:
            self._unready = now
        if not self._word_waits:
            return
        is_ready = now - self._unready > HAS_RECOVERED
        if self.word_said is None and not is_ready:
            self.word_said = wall
        if is_ready or (self.word_said is not None and wall - self.word_said > RECOVERS_WITHIN):
            self._word_waits, self.word_said = False, None
            self._stream.release()

    def _gap_before(self, status: ArmStatus) -> float:
        """How long the arm said nothing before a status, s, as far as somebody listened.

        While this process was kept from running others will have come; but in more than LONGEST_DEAF a driver
        that has ended can have been started again.
        """
        deaf = self._deaf + self._was_deaf
        self._deaf, self._was_deaf = 0.0, self._deaf
        if self._status is None:
            return 0.0
        gap = status.time - self._status.time
        return gap - deaf if deaf <= LONGEST_DEAF else gap


def word_message(said: float) -> lcmt_panda_command:
    """The operator's word for the arm's driver, stamped with when it was said, s; it commands nothing."""
    message = lcmt_panda_command()
    message.utime = int(said * 1e6)
    return message


def command_message(command: NDArray, mode: str, stamp: float) -> lcmt_panda_command:
    """What the driver accepts: `command` [7] in the fields of its mode, stamped, s, and nothing else."""
    message = lcmt_panda_command()
    message.utime = int(stamp * 1e6)
    if mode == VELOCITY:
        message.control_mode_expected = lcmt_panda_status.CONTROL_MODE_VELOCITY
        message.num_joint_velocity, message.joint_velocity = 7, [float(v) for v in command]
    else:
        message.control_mode_expected = lcmt_panda_status.CONTROL_MODE_POSITION
        message.num_joint_position, message.joint_position = 7, [float(q) for q in command]
    return message
