"""Commands from a process of their own, so that nothing else in the program can stall them.

Why a process: systems in one Simulator wait for each other, and Python threads for each other's lock, so a
segmentation of 0.2 s is a gap of 0.2 s in whatever streams beside it. Another process shares neither; what it
does in 5 ms is a few tenths of a millisecond of arithmetic, and the system wakes up a process that has slept
before one that computes. It hears the arm and the camera itself, and gets targets through a pipe with the time
that they are meant for; if the pipe breaks, or Ctrl-C comes, it brings the arm to rest.
"""

import multiprocessing
import select
import signal
import threading
import time
from collections import deque
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any

import numpy as np
from drake import lcmt_panda_command, lcmt_panda_status
from numpy.typing import NDArray

from riseg_drake.robot.command_stream import (
    VELOCITY,
    ArmStatus,
    CommandParameters,
    CommandStream,
    TipGeometry,
)
from riseg_drake.robot.description import PandaDescription
from riseg_drake.robot.kinematics import PandaKinematics
from riseg_drake.robot.paced_commands import PacedCommands
from riseg_drake.robot.supervisor import Cause, Mode, SafetyState
from riseg_drake.stations.lcm_channels import LcmConfig, open_lcm
from riseg_drake.stations.lcm_reception import array_time, status_of
from riseg_drake.stations.promptness import be_prompt

FINAL_COMMANDS = 20
"""How many commands at rest end the stream: zeros, in velocity mode."""
REPORT_EVERY = 4
"""A report every so many periods."""
PRIORITY = 20
"""Among real-time processes, where the system allows that."""
MOST_MESSAGES = 200
"""Read from the pipe in one period at most; the rest waits for the next."""


class CommandError(RuntimeError):
    """The arm cannot be commanded; says in one line why."""


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


class CommandProcess:
    """Starts the process, and speaks to it. Raises CommandError if it does not come up.

    Targets may be sent from any thread. As a context manager it brings the arm to rest at the end.
    """

    def __init__(self, lcm: LcmConfig, parameters: CommandParameters, panda: PandaDescription):
        parameters.check(panda.limits)
        spawn = multiprocessing.get_context("spawn")
        self._connection, theirs = spawn.Pipe()
        self._lock = threading.Lock()
        self._report: StreamReport | None = None
        self.words = 0
        """How often the operator has said that the arm may move again."""
        self.send_times: NDArray[np.float64] = np.zeros(0)
        """When commands were sent, by a steady clock, s; there once the process has ended."""
        self._process = spawn.Process(
            target=stream_commands, args=(theirs, lcm, parameters, panda), name="riseg commands", daemon=True
        )
        self._process.start()
        theirs.close()
        if not self._connection.poll(60) or self._receive() != "ready":
            raise CommandError("the process that sends commands did not start")

    def __enter__(self) -> "CommandProcess":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def send_target(self, time: float, position: NDArray) -> None:
        """Joint angles [7], rad, to be at about the wall time `time`, s; later than all sent before."""
        self._send("target", time, np.array(position))

    def expect_contact(self, start: float, end: float) -> None:
        """Targets of these times, s, are a push."""
        self._send("contact", start, end)

    def release(self, anew: bool = False) -> None:
        """The operator's word that a stopped arm may move again: on its path, or `anew` from where it is.

        Then all targets are forgotten, and those to come until `begin_path`.
        """
        self.words += 1
        if anew:
            self._send("abandon")
        self._send("release")

    def begin_path(self) -> None:
        """Targets from now on are of a path that begins where the arm is."""
        self._send("begin")

    def done_until(self) -> float:
        """Up to what time, s, targets have been gone through; as of the newest report."""
        report = self.report
        return -np.inf if report is None else report.done_until

    @property
    def report(self) -> StreamReport | None:
        """The newest report; None before the first. Raises CommandError if the process has died."""
        with self._lock:
            try:
                while self._connection.poll(0):
                    self._take(self._receive())
            except (EOFError, OSError):
                if not len(self.send_times):
                    raise CommandError(
                        "the process that sends commands died; the arm holds or stops by itself"
                    ) from None
        return self._report

    def close(self, patience: float = 3.0) -> None:
        """Bring the arm to rest and end the process, within `patience`, s, or by force."""
        with suppress(CommandError):
            self._send("end")
        deadline = time.monotonic() + patience
        with suppress(EOFError, OSError):
            while time.monotonic() < deadline:
                if self._connection.poll(0.05):
                    self._take(self._receive())
        self._process.join(max(deadline - time.monotonic(), 0.1))
        if self._process.is_alive():
            self._process.terminate()

    def _send(self, *message: Any) -> None:
        with self._lock:
            try:
                self._connection.send(message)
            except OSError:
                raise CommandError("the process that sends commands has ended") from None

    def _receive(self) -> Any:
        return self._connection.recv()

    def _take(self, message: Any) -> None:
        if isinstance(message, StreamReport):
            self._report = message
        elif isinstance(message, np.ndarray):
            self.send_times = message


class _News:
    """The newest of what the drivers publish; decoded when asked for."""

    def __init__(self, config: LcmConfig):
        self.lcm = open_lcm(config)
        self._status_data: bytes | None = None
        self._status: ArmStatus | None = None
        self.image_time: float | None = None
        self.lcm.Subscribe(config.status_channel, self._take_status)
        self.lcm.Subscribe(config.image_channel, self._take_images)

    def _take_status(self, data: bytes) -> None:
        self._status_data = data

    def _take_images(self, data: bytes) -> None:
        self.image_time = array_time(data)

    def read(self) -> ArmStatus | None:
        """Take in what has come; returns the arm's newest status."""
        self.lcm.HandleSubscriptions(0)
        if self._status_data is not None:
            status = status_of(lcmt_panda_status.decode(self._status_data))
            self._status_data = None
            if self._status is None or status.time > self._status.time:  # on the way some overtake others
                self._status = status
        return self._status


def stream_commands(
    connection: Connection, lcm: LcmConfig, parameters: CommandParameters, panda: PandaDescription
) -> None:
    """What the process does, until it is told to end, interrupted, or left alone; the arm is at rest then."""
    interrupted = threading.Event()
    signal.signal(signal.SIGINT, lambda *_: interrupted.set())
    signal.signal(signal.SIGTERM, lambda *_: interrupted.set())
    kinematics = PandaKinematics(panda)
    tip = TipGeometry(lambda q: kinematics.X_WE(q)[:3, 3], kinematics.tip_jacobian)
    stream = CommandStream(parameters, tip, panda.limits)
    news = _News(lcm)
    be_prompt(PRIORITY)
    connection.send("ready")
    sent: deque[float] = deque(maxlen=1_000_000)
    refused, rounds, final = "", 0, 0
    paced = PacedCommands(stream, time.monotonic())
    while final < FINAL_COMMANDS:
        refused = _obey(connection, stream) or refused
        if interrupted.is_set():
            stream.end(Cause.INTERRUPT)
        status = news.read()
        command = paced.next(time.monotonic(), time.time(), status, news.image_time)
        if command is not None and command.is_in_time(time.monotonic()):
            message = command_message(command.values, parameters.mode, command.stamp)
            news.lcm.Publish(lcm.command_channel, message.encode())
            paced.was_sent(command)
            sent.append(time.monotonic())
        if stream.state.mode is Mode.ENDED and stream.at_rest:
            final = final + 1 if command is not None else FINAL_COMMANDS
        rounds += 1
        if rounds % REPORT_EVERY == 0:
            _tell(connection, _report(stream, status, refused))
        time.sleep(paced.wait(time.monotonic()))
    with suppress(OSError):
        connection.send(_report(stream, news.read(), refused))
        connection.send(np.array(sent))
        connection.close()


def _obey(connection: Connection, stream: CommandStream) -> str:
    """Do what the pipe says; returns why a target was refused, or an empty text."""
    refused = ""
    try:
        for _ in range(MOST_MESSAGES):
            if not connection.poll(0):
                break
            word, *values = connection.recv()
            match word:
                case "target":
                    stream.add_target(*values)
                case "contact":
                    stream.expect_contact(*values)
                case "release":
                    stream.release()
                case "abandon":
                    stream.abandon_path()
                case "begin":
                    stream.begin_path()
                case "end":
                    stream.end(Cause.FINISHED)
    except ValueError as error:
        refused = str(error)
    except (EOFError, OSError):
        stream.end(Cause.CLIENT_GONE)
    return refused


def _report(stream: CommandStream, status: ArmStatus | None, refused: str) -> StreamReport:
    return StreamReport(
        state=stream.state,
        position=stream.position,
        status=status,
        behind=stream.behind,
        done_until=stream.done_until,
        at_rest=stream.at_rest,
        off_path=stream.off_path if stream.state.mode is Mode.STOPPED else 0.0,
        words=stream.words,
        refused=refused,
    )


def _tell(connection: Connection, report: StreamReport) -> None:
    """Send a report if nobody has to be waited for."""
    with suppress(OSError, ValueError):
        if select.select([], [connection], [], 0)[1]:
            connection.send(report)
