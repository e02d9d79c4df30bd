"""Arm and camera for a long time: does memory grow, and do commands stay even?"""

import shutil
import subprocess
import time
from pathlib import Path
from typing import IO

from riseg_drake.app.output_folder import read_json
from tests.faults.commands import Stoppable, stoppables
from tests.faults.stops import PATIENCE, end, processes, start, started
from tests.faults.tally import Tally

EVERY = 5.0
"""Between two looks at the memory, s."""
GROWTH = 1.03
"""Of the memory in the last third of the time, over that in the second: what is more is a leak."""
LONGEST_GAP = 60.0
"""Between two commands, ms; an arm's driver gives up after 100."""
PAGE_MB = 4096 / 1e6


def try_endurance(minutes: float, kinds: list[str], tally: Tally, place: Path) -> None:
    """`idle`: the operator never answers to the first push. `busy`: one session after another, one emulator."""
    command = stoppables(place)["hardware"]
    for kind in kinds:
        emulator = started(command.beside[0])
        try:
            trial = _idle if kind == "idle" else _busy
            memory, complaints = trial(command, place / kind, minutes, emulator)
        finally:
            end(emulator)
        for what, megabytes in memory.items():
            third = max(1, len(megabytes) // 3)
            before, after = max(megabytes[third:-third], default=0.0), max(megabytes[-third:])
            print(f"{kind}: {what}: {before:.0f} MB, {after:.0f} MB in the last third", flush=True)
            if before and after > GROWTH * before:
                complaints.append(f"{what} grows from {before:.0f} to {after:.0f} MB")
        tally.enter(f"hardware, {kind} for {minutes:g} minutes", complaints)


def _idle(
    command: Stoppable, output: Path, minutes: float, emulator: subprocess.Popen
) -> tuple[dict[str, list[float]], list[str]]:
    output.parent.mkdir(exist_ok=True)
    memory: dict[str, list[float]] = {"hardware": [], "emulate": []}
    with (output.parent / "said").open("w+b") as said:
        words = f"{command.words.replace('--yes', '')} --output {output}"
        session = start(words, said, told=subprocess.PIPE)
        try:
            # The emulated arm stands where it looks from.
            _asked(session, said, "y to do it")
            until = time.monotonic() + 60 * minutes
            while time.monotonic() < until and session.poll() is None:
                time.sleep(EVERY)
                memory["hardware"].append(_megabytes(session.pid))
                memory["emulate"].append(_megabytes(emulator.pid))
            _answer(session, said, "y to do it", "q")
            session.wait(PATIENCE)
            _, errors = session.communicate()
        finally:
            end(session)
    return memory, _complaints(session.returncode, errors, output)


def _asked(session: subprocess.Popen, said: IO[bytes], question: str) -> None:
    """Wait until a command has asked something."""
    deadline = time.monotonic() + PATIENCE
    while question.encode() not in Path(said.name).read_bytes().replace(b"\n", b" "):
        if session.poll() is not None or time.monotonic() > deadline:
            raise TimeoutError(f"it did not ask {question!r}")
        time.sleep(0.1)


def _answer(session: subprocess.Popen, said: IO[bytes], question: str, answer: str) -> None:
    _asked(session, said, question)
    time.sleep(1.0)  # what comes before it listens is not meant for this question
    assert session.stdin is not None
    session.stdin.write(f"{answer}\n")
    session.stdin.flush()


def _busy(
    command: Stoppable, output: Path, minutes: float, emulator: subprocess.Popen
) -> tuple[dict[str, list[float]], list[str]]:
    memory: dict[str, list[float]] = {"hardware": [], "emulate": []}
    complaints = []
    until = time.monotonic() + 60 * minutes
    while time.monotonic() < until:
        shutil.rmtree(output, ignore_errors=True)
        session = start(f"{command.words} --output {output}")
        most = 0.0
        try:
            while session.poll() is None:
                time.sleep(1.0)
                most = max(most, _megabytes(session.pid))
            _, errors = session.communicate(timeout=PATIENCE)
        finally:
            end(session)
        memory["hardware"].append(most)
        memory["emulate"].append(_megabytes(emulator.pid))
        complaints += _complaints(session.returncode, errors, output)
    return memory, complaints


def _complaints(code: int, errors: str, output: Path) -> list[str]:
    summary = read_json(output / "summary.json")
    gaps = summary.get("command_gap_ms", {})
    print(f"{summary.get('end')}; gaps between commands, ms: {gaps}", flush=True)
    complaints = [] if code == 0 and not errors else [f"exit code {code}: {errors[-600:]}"]
    if not gaps or gaps["longest"] > LONGEST_GAP:
        complaints.append(f"gaps {gaps}")
    return complaints


def _megabytes(session: int) -> float:
    """What the living processes of a session hold."""
    pages = 0
    for pid, _ in processes(session):
        try:
            pages += int(Path(f"/proc/{pid}/statm").read_text().split()[1])
        except (OSError, IndexError):
            continue
    return PAGE_MB * pages
