"""Commands stopped at random moments: exit codes, whole files, no process left, and evaluations that go on."""

import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from riseg_drake.app.output_folder import read_json
from tests.faults.commands import Stoppable, stoppables
from tests.faults.tally import Tally

PATIENCE = 60.0
"""Within which a command that was told to stop must have ended, s, or twice its whole length."""
LONGEST = 10
"""Times its usual length, within which a command that nobody stops must have ended."""
LEAST_USE = 0.1
"""Of the processor in so long a time, s: less is not for want of it, but a wait for nothing."""
UNKNOWN = 360.0
"""Taken for the usual length, s, before that is known."""
LEFT_PATIENCE = 5.0
"""Within which its other processes must have, s."""
PAUSE = 1.0
"""Between SIGSTOP and SIGCONT, s."""
EARLIEST = 0.15
"""Of the moments, s: before, Python itself is still coming up and hears Ctrl-C in its own way."""
EXPECTED = {signal.SIGINT: 130, signal.SIGTERM: 143, signal.SIGKILL: -9, signal.SIGSTOP: 0}
"""Exit codes."""
TELLING = (signal.SIGINT, signal.SIGTERM)
"""Those that a command hears."""
SIGNALS = {"INT": signal.SIGINT, "TERM": signal.SIGTERM, "KILL": signal.SIGKILL, "STOP": signal.SIGSTOP}


@dataclass(frozen=True)
class Ended:
    """How a command ended."""

    code: int
    errors: str
    seconds: float
    was_stopped: bool
    beside: tuple["Ended", ...] = ()
    """The same of the commands beside it."""


def try_stops(
    names: list[str], signals: list[str], count: int, seed: int, tally: Tally, place: Path | None
) -> None:
    """Stop each command `count` times by each signal, at moments spread over its whole length."""
    place = place or Path(tempfile.mkdtemp(prefix="riseg_faults_"))
    rng = random.Random(seed)
    for name in names:
        command = stoppables(place)[name]
        right = place / f"right_{name}"
        length = undisturbed(command, right)
        print(f"{name}: {length:.1f} s undisturbed", flush=True)
        for each in signals:
            for number in range(count):
                output = place / f"stopped_{name}"
                moment, ended = _stop(command, output, SIGNALS[each], rng, length, number / count)
                complaints = _complaints(command, output, right, SIGNALS[each], ended)
                if command.goes_on and not complaints:
                    complaints = _complaints_of_going_on(command, output, right, length)
                tally.enter(f"{name}, SIG{each}", complaints, f"after {moment:.2f} s of {length:.1f}")
                if complaints:
                    shutil.move(output, place / f"wrong_{name}_{each}_{number}_{seed}")


def undisturbed(command: Stoppable, right: Path) -> float:
    """Run a command to its end into a new folder; returns how long it took, s."""
    if right.exists():
        shutil.rmtree(right)
    ended = run(command, right, length=UNKNOWN)
    assert ended.code == 0, ended.errors
    return ended.seconds


def _stop(
    command: Stoppable, output: Path, number: int, rng: random.Random, length: float, share: float
) -> tuple[float, Ended]:
    """Stop a command at a random moment; one that had ended before is tried again with an earlier one."""
    while True:
        moment = EARLIEST + (length - EARLIEST) * ((share + rng.random()) % 1)
        shutil.rmtree(output, ignore_errors=True)
        ended = run(command, output, moment, number, length)
        if ended.was_stopped:
            return moment, ended
        share, length = rng.random(), 0.9 * length


def run(
    command: Stoppable, output: Path, moment: float | None = None, number: int = 0, length: float = 0.0
) -> Ended:
    """Run a command to its end, or send it a signal at a moment, s; undisturbed it takes `length`, s."""
    beside = [started(words) for words in command.beside]
    process = start(f"{command.words} --output {output}")
    begun, was_stopped = time.monotonic(), False
    try:
        if moment is not None:
            try:
                process.wait(moment)
            except subprocess.TimeoutExpired:
                _send(process, number)
                was_stopped = True
        is_told = was_stopped and number != signal.SIGSTOP
        code, errors = _awaited(process, max(PATIENCE, (2 if is_told else LONGEST) * length))
        seconds = time.monotonic() - begun
        others = []
        for each in beside:
            _send(each, number if is_told else signal.SIGINT)
            others.append(Ended(*_awaited(each, PATIENCE), seconds, True))
    finally:
        for each in (process, *beside):
            end(each)
    return Ended(code, errors, seconds, was_stopped, tuple(others))


def _send(process: subprocess.Popen, number: int) -> None:
    """As a terminal does it, Ctrl-C goes to the whole group; what kills goes to the one process."""
    with suppress(ProcessLookupError):
        (os.killpg if number == signal.SIGINT else os.kill)(process.pid, number)
        if number == signal.SIGSTOP:
            time.sleep(PAUSE)
            os.kill(process.pid, signal.SIGCONT)


def _awaited(process: subprocess.Popen, limit: float) -> tuple[int, str]:
    """The exit code and what was said when a command has ended, with all that it has left.

    It hangs when it has used more than `limit`, s of the processor, or when it is late and uses none.
    """
    wait, used = limit, 0.0
    while True:
        try:
            _, errors = process.communicate(timeout=wait)
            code = process.returncode
            break
        except subprocess.TimeoutExpired:
            before, used, wait = used, _used(process.pid), PATIENCE
            if used > limit or used - before < LEAST_USE:
                code, errors = -999, f"still there after {used:.0f} s of its own time\n{_stacks(process)}"
                break
    left = _left(process.pid)
    return code, errors + (f"\nleft: {left}" if left else "")


def _used(session: int) -> float:
    """What the living processes of a session, and those that they have seen end, have used so far, s."""
    used = 0
    for pid, _ in processes(session):
        with suppress(OSError):
            fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
            used += sum(map(int, fields[11:15]))
    return used / os.sysconf("SC_CLK_TCK")


def _stacks(process: subprocess.Popen) -> str:
    """Where all threads of a command that hangs are, as Python's faulthandler says it; it ends of that."""
    said = []
    for pid, words in processes(process.pid):
        said.append(f"{pid}: {words}")
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGABRT)
    with suppress(subprocess.TimeoutExpired):
        said.append(process.communicate(timeout=LEFT_PATIENCE)[1])
    return "\n".join(said)


def started(words: str) -> subprocess.Popen:
    """A command that waits for Ctrl-C, once it says so."""
    with tempfile.NamedTemporaryFile() as said:
        process = start(words, said)
        while b"Ctrl-C" not in Path(said.name).read_bytes():
            assert process.poll() is None, process.communicate()[1]
            time.sleep(0.05)
    return process


def start(
    words: str, output: IO[bytes] | int = subprocess.DEVNULL, told: int = subprocess.DEVNULL
) -> subprocess.Popen:
    """A command in a session of its own; what it is `told` is its standard input."""
    return subprocess.Popen(
        [sys.executable, "-m", "riseg_drake", *words.split()],
        stdin=told,
        stdout=output,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        preexec_fn=_hear_signals,
        env={**os.environ, "PYTHONFAULTHANDLER": "1"},
    )


def _hear_signals() -> None:
    """A trial in the background of a shell ignores Ctrl-C, and so would what it starts."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)


def end(process: subprocess.Popen) -> None:
    """End a command with all its processes."""
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def _left(session: int) -> list[str]:
    """Processes of a session that are still there after a while, by their command lines."""
    deadline = time.monotonic() + LEFT_PATIENCE
    while True:
        left = [words for pid, words in processes(session) if pid != session]
        if not left or time.monotonic() > deadline:
            return left
        time.sleep(0.1)


def processes(session: int) -> list[tuple[int, str]]:
    """Living processes of a session."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            state, _, _, its_session = (folder / "stat").read_text().rpartition(")")[2].split()[:4]
            words = (folder / "cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace")
        except (OSError, ValueError):
            continue
        if int(its_session) == session and state not in "ZX":
            found.append((int(folder.name), words[:120]))
    return found


def _complaints(command: Stoppable, output: Path, right: Path, number: int, ended: Ended) -> list[str]:
    expected = EXPECTED[number]
    state = read_json(output / "summary.json").get("state")
    finished = ended.code == 0 and state == "done"  # it came too late
    complaints = (
        []
        if ended.code == expected or finished
        else [f"exit code {ended.code}, not {expected}: {ended.errors}"]
    )
    if finished:
        print(f"{command.name}: the signal came after its end")
    elif number in TELLING and not command.goes_on and state not in (None, "interrupted"):
        complaints.append(f"state {state}")
    complaints += _complaints_of_words(ended, lines=0 if finished or number not in TELLING else 1)
    for each in ended.beside:  # a driver has done all that it should
        code = EXPECTED.get(number, 0)
        if each.code not in (code, 0 if number != signal.SIGKILL else code):
            complaints.append(f"beside: exit code {each.code}, not {code}: {each.errors}")
        complaints += _complaints_of_words(each, lines=int(each.code > 0))
    return complaints + (command.complaints(output, right) if output.exists() else [])


def _complaints_of_words(ended: Ended, lines: int) -> list[str]:
    """One line at most is said by who is stopped, and nobody is left behind."""
    said = ended.errors.strip().splitlines()
    if (ended.code >= 0 and len(said) != lines) or "Traceback" in ended.errors or "left: " in ended.errors:
        return [f"{len(said)} lines of errors: {ended.errors[-600:]}"]
    return []


def _complaints_of_going_on(command: Stoppable, output: Path, right: Path, length: float) -> list[str]:
    ended = run(command, output, length=length)
    if ended.code:
        return [f"going on: exit code {ended.code}: {ended.errors}"]
    complaints = command.complaints(output, right)
    if read_json(output / "summary.json").get("state") != "done":
        complaints.append("going on: not done")
    return [f"going on: {complaint}" for complaint in complaints]
