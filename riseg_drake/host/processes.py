"""The door for signals and child processes: who is stopped by what, and who ends with whom.

Ctrl-C (SIGINT), `kill` (SIGTERM) and a terminal that is closed (SIGHUP) all stop a command in the same way: a
KeyboardInterrupt, after which it leaves whole files. Its exit code is 128 and the signal's number, as shells
have it.
"""

import ctypes
import os
import signal
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import resource_tracker
from types import FrameType

STOP_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_IMPORT = "<frozen importlib._bootstrap>"
_PR_SET_PDEATHSIG = 1


@dataclass
class Stop:
    """Whether this process was asked to stop."""

    signal: int = 0
    """The number of the first signal that asked for it; 0 while none did."""

    @property
    def exit_code(self) -> int:
        """As shells have it."""
        return 128 + (self.signal or signal.SIGINT)


@dataclass
class _Held:
    """Signals belong to the whole process, and so does whether they have to wait."""

    depth: int = 0
    came: bool = False


_held = _Held()


@contextmanager
def stopped_by_signals(*loaders: str) -> Iterator[Stop]:
    """For the time of a `with`, every stop signal raises KeyboardInterrupt; the Stop says which came.

    While a function of one of the files `loaders` imports its modules the process ends at once instead: nothing
    has been begun, or all is over, and what is raised in a module of C++ comes out as an ImportError, or not at
    all.
    """
    stop = Stop()

    def hear(number: int, frame: FrameType | None) -> None:
        stop.signal = stop.signal or number
        if _is_loading(frame, loaders):
            os.write(2, b"riseg: stopped\n")
            os._exit(stop.exit_code)
        if _held.depth:
            _held.came = True
        else:
            raise KeyboardInterrupt

    before = {}
    if threading.current_thread() is threading.main_thread():  # others may not touch signals
        # What is ignored stays so: that is how shells start programs in the background, and nohup.
        heard = [number for number in STOP_SIGNALS if signal.getsignal(number) is not signal.SIG_IGN]
        before = {number: signal.signal(number, hear) for number in heard}
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def ended_at_once() -> Iterator[None]:
    """Stop signals end the process, for the time of a `with` around what waits in C++ and would hear none.

    Nothing may have begun that would have to be ended well.
    """
    numbers = STOP_SIGNALS if threading.current_thread() is threading.main_thread() else ()
    before = {number: signal.getsignal(number) for number in numbers}
    for number, handler in before.items():
        if handler is not signal.SIG_IGN:
            signal.signal(number, signal.SIG_DFL)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def heed_no_more() -> None:
    """All is done but for Python's own end: a stop signal has nothing to stop, and changes no exit code."""
    for number in STOP_SIGNALS:
        signal.signal(number, signal.SIG_IGN)


@contextmanager
def undisturbed() -> Iterator[None]:
    """Stop signals wait until a `with` ends, and are not lost: KeyboardInterrupt is raised then."""
    if threading.current_thread() is not threading.main_thread():  # only there they interrupt anything
        yield
        return
    _held.depth += 1
    try:
        yield
    finally:
        _held.depth -= 1
        if _held.came and not _held.depth:
            _held.came = False
            raise KeyboardInterrupt


@contextmanager
def deaf_children() -> Iterator[None]:
    """Processes that are begun in a `with` hear neither Ctrl-C nor `kill`, from their first moment on.

    Before a child's Python has come up nothing that it does itself can help. It may unblock the signals later.
    """
    # At its own start this process of Python's unblocks both for good, so that has to be over.
    resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT, signal.SIGTERM])
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def end_with_parent(parent: int) -> None:
    """Make the system kill this process when its parent, of that process id, has ended however it did."""
    ctypes.CDLL(None, use_errno=True).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:  # it was quicker
        os._exit(1)


def _is_loading(frame: FrameType | None, loaders: Sequence[str]) -> bool:
    """Whether the outermost import that is under way was begun by a function of one of the files `loaders`."""
    outermost = None
    while frame is not None:
        importer = frame.f_back
        if frame.f_code.co_filename == _IMPORT and importer and importer.f_code.co_filename != _IMPORT:
            outermost = importer.f_code.co_filename
        frame = importer
    return outermost in loaders
