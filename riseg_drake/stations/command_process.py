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
import sys
import threading
import time
from collections import deque
from contextlib import suppress
from multiprocessing.connection import Connection
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.lcm import DrakeLcm

from riseg_drake.host.processes import deaf_children
from riseg_drake.robot.command_stream import CommandParameters, CommandStream
from riseg_drake.robot.description import PandaDescription
from riseg_drake.robot.kinematics import PandaKinematics
from riseg_drake.robot.supervisor import Cause
from riseg_drake.robot.tip_geometry import TipGeometry
from riseg_drake.stations.command_session import CommandSession, StreamReport, command_message, word_message
from riseg_drake.stations.even_clock import EvenClock
from riseg_drake.stations.lcm_channels import LcmConfig, open_lcm
from riseg_drake.stations.promptness import be_prompt

READY = "ready"
"""The first word of the process."""
LONGEST_START = 60.0
"""It must be said within this time, s."""
REPORT_EVERY = 4
"""A report every so many periods."""
PRIORITY = 20
"""Among real-time processes, where the system allows that."""
MOST_MESSAGES = 200
"""Read from the pipe in one period at most; the rest waits for the next."""
MOST_FAILURES = 400
"""Rounds in which nothing could be sent or heard; then there is no way to bring the arm to rest."""
LISTEN_EVERY = 1e-3
"""Time between two looks for messages while most of them are left out, s."""


class CommandError(RuntimeError):
    """The arm cannot be commanded; says in one line why."""


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
        with deaf_children():  # until it knows what to do about a signal: it ends because this process does
            self._process.start()
        theirs.close()
        self._await_start()

    def __enter__(self) -> "CommandProcess":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def send_target(self, time: float, position: NDArray) -> None:
        """Joint angles [7], rad, for a time, s, by any even clock; later than all sent before."""
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
        """The newest report; None before the first. Raises CommandError if the process has failed or died."""
        with self._lock:
            try:
                while self._connection.poll(0):
                    self._take(self._receive())
            except (EOFError, OSError):
                if not len(self.send_times):
                    raise CommandError(
                        "the process that sends commands died; the arm holds or stops by itself"
                    ) from None
            report = self._report
        if report is not None and report.failed:
            raise CommandError(f"{Cause.FAULT.value}, and brought the arm to rest: {report.failed}")
        return report

    @property
    def left_out(self) -> dict[str, int]:
        """How many messages were not let in so far, by channel and kind."""
        return {} if self._report is None else self._report.left_out

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

    def _await_start(self) -> None:
        """Raises CommandError, with the reason, if the process does not get ready."""
        try:
            came = self._connection.poll(LONGEST_START)
            said = self._receive() if came else f"it said nothing in {LONGEST_START:g} s"
        except (EOFError, OSError):
            self._process.join(1.0)
            said = f"it ended with exit code {self._process.exitcode}"
        if said != READY:
            self._process.kill()
            raise CommandError(f"the process that sends commands did not start: {said}")

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


def stream_commands(
    connection: Connection, lcm: LcmConfig, parameters: CommandParameters, panda: PandaDescription
) -> None:
    """What the process does, until it is told to end, interrupted, or left alone; the arm is at rest then.

    Whatever goes wrong on the way, the arm is brought to rest first, and the process ends with exit code 1.
    """
    interrupted = threading.Event()
    for end in (signal.SIGINT, signal.SIGTERM):
        signal.signal(end, lambda *_: interrupted.set())
    signal.pthread_sigmask(signal.SIG_UNBLOCK, (signal.SIGINT, signal.SIGTERM))
    try:
        clock = EvenClock()
        session, network = _begin(lcm, parameters, panda, clock())
    except Exception as error:
        with suppress(OSError):
            connection.send(f"{type(error).__name__}: {' '.join(str(error).split())}")
        sys.exit(1)
    be_prompt(PRIORITY)
    with suppress(OSError):  # who has gone meanwhile is missed in the first round
        connection.send(READY)
    _listen(network, session)
    session.set_out(clock())
    sent: deque[float] = deque(maxlen=1_000_000)
    rounds, failures = 0, 0
    while not session.is_over and failures < MOST_FAILURES:
        if interrupted.is_set():
            session.end(Cause.INTERRUPT)
        _obey(connection, session)
        _listen(network, session)
        try:
            now = clock()
            command = session.next(now, now - clock.shift())
            if command is not None and command.is_in_time(clock()):
                message = command_message(command.values, parameters.mode, command.stamp)
                network.Publish(lcm.command_channel, message.encode())
                session.was_sent(command)
                sent.append(time.monotonic())
            if session.word_said is not None and rounds % REPORT_EVERY == 0:
                network.Publish(lcm.recovery_channel, word_message(session.word_said).encode())
        except Exception as error:  # of the network; a session sees to its own
            session.fail(error)
            failures += 1
        rounds += 1
        if rounds % REPORT_EVERY == 0:
            _tell(connection, session.report())
        _wait(session, network, clock)
    with suppress(OSError):
        connection.send(session.report())
        connection.send(np.array(sent))
        connection.close()
    if session.failed:
        sys.exit(1)


def _begin(
    config: LcmConfig, parameters: CommandParameters, panda: PandaDescription, now: float
) -> tuple[CommandSession, DrakeLcm]:
    """A session that hears the drivers."""
    kinematics = PandaKinematics(panda)
    tip = TipGeometry(lambda q: kinematics.X_WE(q)[:3, 3], kinematics.tip_jacobian)
    network = open_lcm(config)
    stream = CommandStream(parameters, tip, panda.limits)
    session = CommandSession(stream, now, config.status_channel, config.image_channel)
    network.Subscribe(config.status_channel, session.hear_status)
    network.Subscribe(config.image_channel, session.hear_picture)
    return session, network


def _obey(connection: Connection, session: CommandSession) -> None:
    """Do what the pipe says."""
    try:
        for _ in range(MOST_MESSAGES):
            if not connection.poll(0):
                break
            session.obey(*connection.recv())
    except (EOFError, OSError):
        session.end(Cause.CLIENT_GONE)
    except Exception as error:  # what cannot be unpacked
        session.fail(error)


def _listen(network: DrakeLcm, session: CommandSession) -> None:
    try:
        network.HandleSubscriptions(0)
    except Exception as error:
        session.fail(error)


def _wait(session: CommandSession, network: DrakeLcm, clock: EvenClock) -> None:
    """Until the next command is due.

    LCM keeps one message of each channel until it is asked: among many that are left out the good ones come
    through if it is asked more often.
    """
    while session.is_flooded and session.wait(clock()) > LISTEN_EVERY:
        time.sleep(LISTEN_EVERY)
        _listen(network, session)
    time.sleep(session.wait(clock()))


def _tell(connection: Connection, report: StreamReport) -> None:
    """Send a report if nobody has to be waited for."""
    with suppress(OSError, ValueError):
        if select.select([], [connection], [], 0)[1]:
            connection.send(report)
