"""Mutated inputs for every reader, in a process that may hang, grow or die; who waits for it counts that."""

import json
import os
import select
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path

from tests.faults.tally import Tally

LONGEST = 10.0
"""For one input, s of the process's own time; a busy machine is not the reader's fault."""
ASLEEP = 30.0
"""A process that waits for something all this while, s, hangs, too."""
MOST_MEMORY = 1500
"""MB, of the whole process."""
GROWTH = 4
"""Times the memory with the right input."""
TOLD_EVERY = 500
MOST_INPUTS = 500
"""Of one process: what it keeps of each is not the memory of the last."""


def try_inputs(names: list[str] | None, count: int, seed: int, tally: Tally) -> None:
    """Give each reader its share of `count` mutated inputs."""
    from tests.faults.readers import NEEDS, READERS, SHARES  # brings Drake

    for name in [name for name, module in NEEDS.items() if find_spec(module) is None]:
        print(f"{name}: left out, since {NEEDS[name]} is not installed")
        READERS.pop(name)
    shares = {name: SHARES.get(name, 1) for name in names or READERS}
    for name, share in shares.items():
        number = round(count * share / sum(shares.values()))
        with tempfile.TemporaryDirectory(prefix="riseg_faults_") as place:
            _try_reader(name, number, seed, tally, Path(place))


def _try_reader(name: str, number: int, seed: int, tally: Tally, place: Path) -> None:
    done, right, most, slowest = 0, 0, 0, 0.0
    while done < number:
        for case in _cases(name, seed, done, min(done + MOST_INPUTS, number), place):
            if case["case"] < 0:  # the right input
                right = right or case["memory_mb"]
                assert case["code"] == 0, f"{name}: the right input is refused: {case['error']}"
                continue
            done = case["case"] + 1
            most = max(most, case["memory_mb"])
            complaints = case["complaints"]
            slowest = max(slowest, case["seconds"])
            if case["seconds"] > LONGEST:
                complaints.append(f"{case['seconds']:.1f} s")
            if case["memory_mb"] > min(MOST_MEMORY, GROWTH * right):
                complaints.append(f"{case['memory_mb']} MB, {right} with the right input")
            tally.enter(name, complaints, f"seed {seed}, input {case['case']}: {case['what']}")
            if done % TOLD_EVERY == 0:
                print(f"{name}: {done} of {number}", flush=True)
    print(f"{name}: at most {most} MB ({right} with the right input) and {slowest:.1f} s", flush=True)


def _cases(name: str, seed: int, first: int, end: int, place: Path) -> Iterator[dict]:
    """What a process says of its inputs, until it hangs or dies; then it is ended, and that is said, too."""
    errors = place / "errors.txt"
    with errors.open("w") as said:
        process = subprocess.Popen(
            [sys.executable, "-m", "tests.faults.reading", name, *map(str, (seed, first, end)), str(place)],
            stdout=subprocess.PIPE,
            stderr=said,
            start_new_session=True,
        )
    assert process.stdout is not None
    now, what, begun, watch = first, "", False, _Watch(process.pid)
    rest = b""
    try:
        while True:
            if not select.select([process.stdout], [], [], 1.0)[0]:
                if begun and watch.hangs():
                    yield _broken(now, what, "it hangs")
                    return
                continue
            read = os.read(process.stdout.fileno(), 1 << 16)
            if not read:
                code = process.wait()
                if begun:
                    yield _broken(now, what, f"the process ended with {code}")
                elif code:
                    raise RuntimeError(f"{name}: before an input was read: {errors.read_text()[-700:]}")
                return
            *lines, rest = (rest + read).split(b"\n")
            for line in lines:
                entry = json.loads(line)
                if "begins" in entry:
                    now, what, begun, watch = entry["begins"], entry["what"], True, _Watch(process.pid)
                    continue
                begun = False
                yield entry
    finally:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()


class _Watch:
    """Looks at what a process does from now on."""

    def __init__(self, pid: int):
        self._stat = Path(f"/proc/{pid}/stat")
        self._start = self._last = self._look()[1]
        self._awake = time.monotonic()

    def hangs(self) -> bool:
        """Whether it has used too much time, or none for too long."""
        state, used = self._look()
        if state in "RD" or used > self._last:
            self._last, self._awake = used, time.monotonic()
        return used - self._start > LONGEST or time.monotonic() - self._awake > ASLEEP

    def _look(self) -> tuple[str, float]:
        """The state's letter, and the process's own time so far, s."""
        try:
            fields = self._stat.read_text().rpartition(")")[2].split()
        except OSError:  # it has ended
            return "R", 0.0
        return fields[0], (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _broken(case: int, what: str, complaint: str) -> dict:
    return {
        "case": case,
        "what": what,
        "complaints": [complaint],
        "memory_mb": 0,
        "seconds": 0.0,
        "code": None,
        "error": "",
    }
