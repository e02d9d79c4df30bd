"""What the machine may lack: room on the disk, leave to write, shared memory, an output, a folder of its own.

Each case is a process in a name space of its own (`unshare`), where disks can be mounted without harm.
"""

import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from tests.faults.commands import Stoppable, stoppables
from tests.faults.stops import UNKNOWN, run, undisturbed
from tests.faults.tally import Tally

ROOM = (0.15, 0.5, 0.9)
"""Sizes of disks that are full before the command is done, as shares of what it leaves."""
PAGE_KB = 4
"""A file takes whole ones of them."""
BEGUN = "summary.json"


def try_machine(names: list[str], tally: Tally) -> None:
    """Try every case with every command."""
    with tempfile.TemporaryDirectory(prefix="riseg_faults_") as folder:
        place = Path(folder)
        commands = {name: command for name, command in stoppables(place).items() if name in names}
        for name, command in commands.items():
            seconds = undisturbed(command, place / f"right_{name}")
            (place / f"seconds_{name}").write_text(str(seconds))
        if subprocess.run(["unshare", "-rm", "true"], check=False).returncode:
            print("disks cannot be mounted here (unshare -rm), so full and read-only ones are left out")
            cases = {name: case for name, case in CASES.items() if name not in MOUNTING}
        else:
            cases = CASES
        for case in cases:
            for name, command in commands.items():
                if command.beside and case not in WITH_DRIVERS:
                    continue
                tally.enter(f"{case}", _in_a_name_space(case, name, place), name)


def riseg(command: Stoppable, output: Path, *more: str, **options: object) -> subprocess.CompletedProcess:
    """Run a command to its end."""
    options = {"stdout": subprocess.DEVNULL, **options}
    words = [sys.executable, "-m", "riseg_drake", *command.words.split(), "--output", str(output), *more]
    return subprocess.run(words, stderr=subprocess.PIPE, text=True, check=False, **options)  # type: ignore[call-overload,no-any-return]


def _in_a_name_space(case: str, name: str, place: Path) -> list[str]:
    around = ["unshare", "-rm"] if case in MOUNTING else []
    words = [*around, sys.executable, "-m", "tests.faults.machine", case, name, str(place)]
    done = subprocess.run(words, stdout=subprocess.PIPE, text=True, check=False)
    return (
        json.loads(done.stdout.splitlines()[-1]) if done.returncode == 0 else [f"ended with {done.returncode}"]
    )


def _refusal(done: subprocess.CompletedProcess, *words: str) -> list[str]:
    """Exit code 2, and one line with one of the words."""
    complaints = [] if done.returncode == 2 else [f"exit code {done.returncode}"]
    if done.stderr.count("\n") != 1 or not any(word in done.stderr for word in words):
        complaints.append(f"said {done.stderr[-600:]!r}")
    return complaints


def _mount(place: Path, options: str) -> Path:
    place.mkdir(exist_ok=True)
    subprocess.run(["mount", "-t", "tmpfs", "-o", options, "none", str(place)], check=True)
    return place


def _full_disk(command: Stoppable, place: Path) -> list[str]:
    complaints = []
    files = [path for path in (place / f"right_{command.name}").rglob("*") if path.is_file()]
    whole = sum(PAGE_KB * -(-path.stat().st_size // (1024 * PAGE_KB)) for path in files)
    for share in ROOM:
        size = round(share * whole / PAGE_KB) * PAGE_KB
        output = _mount(place / f"disk_{size}", f"size={size}k") / "out"
        complaints += _refusal(riseg(command, output), "No space left")
        complaints += command.complaints(output, place / f"right_{command.name}")
    return complaints


def _read_only(command: Stoppable, place: Path) -> list[str]:
    return _refusal(riseg(command, _mount(place / "read_only", "ro") / "out"), "Read-only file system")


def _no_shared_memory(command: Stoppable, place: Path) -> list[str]:
    _mount(Path("/dev/shm"), "ro")
    done = riseg(command, place / "out")
    return [] if done.returncode == 0 and not done.stderr else _refusal(done, "/dev/shm")


def _output_is_full(command: Stoppable, place: Path) -> list[str]:
    with open("/dev/full", "w") as full:
        return _refusal(riseg(command, place / "out", stdout=full), "the output: No space left")


def _output_is_a_file(command: Stoppable, place: Path) -> list[str]:
    (place / "file").write_text("mine")
    complaints = _refusal(riseg(command, place / "file"), "is a file")
    complaints += _refusal(riseg(command, place / "file" / "out"), "Not a directory")
    return complaints + ["the file has changed"] * ((place / "file").read_text() != "mine")


def _somebody_elses_folder(command: Stoppable, place: Path) -> list[str]:
    output = place / "theirs"
    (output / "recording").mkdir(parents=True, exist_ok=True)
    (output / BEGUN).write_text('{"step": 1}')
    complaints = _refusal(riseg(command, output, "--overwrite"), "is not empty and holds no earlier")
    there = {entry.name for entry in output.iterdir()}
    return complaints + ["the folder has changed"] * (there != {"recording", BEGUN})


def _no_home(command: Stoppable, place: Path) -> list[str]:
    before = {entry.name for entry in place.iterdir()}
    environment = {key: value for key, value in os.environ.items() if key != "HOME"}
    done = riseg(command, place / "out", env=environment, cwd=Path.cwd())
    complaints = [] if done.returncode == 0 else [f"exit code {done.returncode}: {done.stderr[-600:]}"]
    return complaints + ["stray files"] * ({entry.name for entry in place.iterdir()} - before > {"out"})


def _two_at_once(command: Stoppable, place: Path) -> list[str]:
    output = place / "out"
    words = [sys.executable, "-m", "riseg_drake", *command.words.split(), "--output", str(output)]
    first = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    while first.poll() is None and not (output / BEGUN).exists():
        time.sleep(0.05)
    first.send_signal(19)  # SIGSTOP: however short it is, it is still at work when the second comes
    complaints = _refusal(riseg(command, output, "--overwrite"), "another riseg is writing")
    first.send_signal(18)
    _, errors = first.communicate()
    if first.returncode:
        complaints.append(f"the first: exit code {first.returncode}: {errors[-600:]}")
    return complaints + command.complaints(output, place / f"right_{command.name}")


def _clock_is_set(command: Stoppable, place: Path) -> list[str]:
    """By a second, forwards and back, for all processes at once: amid what they do, and once more later."""
    (place / "clock").mkdir(exist_ok=True)
    (place / "clock" / "sitecustomize.py").write_text(CLOCK)
    seconds = float((place / f"seconds_{command.name}").read_text())
    complaints = []
    for step in (1.0, -1.0):
        moments = [time.monotonic() + share * seconds for share in (0.4, 0.7)]
        os.environ |= {"PYTHONPATH": f"{place / 'clock'}:{Path.cwd()}"}
        os.environ |= {"CLOCK_STEP": str(step), "CLOCK_SET_AT": " ".join(map(str, moments))}
        shutil.rmtree(place / "out", ignore_errors=True)
        ended = run(command, place / "out", length=UNKNOWN)
        complaints += [f"by {step:g} s: exit code {ended.code}: {ended.errors}"] * bool(ended.code)
        complaints += command.complaints(place / "out", place / f"right_{command.name}")
    return complaints


CLOCK = """\
import os, time
wall, step = time.time, float(os.environ["CLOCK_STEP"])
moments = [float(moment) for moment in os.environ["CLOCK_SET_AT"].split()]
time.time = lambda: wall() + step * sum(time.monotonic() > moment for moment in moments)
"""
"""Python looks for this module at its start; the machine's own clock is nobody's to set."""


CASES: dict[str, Callable[[Stoppable, Path], list[str]]] = {
    "disk full": _full_disk,
    "read-only place": _read_only,
    "no shared memory": _no_shared_memory,
    "output full": _output_is_full,
    "output is a file": _output_is_a_file,
    "somebody else's folder": _somebody_elses_folder,
    "no HOME": _no_home,
    "two at once": _two_at_once,
    "clock set": _clock_is_set,
}
WITH_DRIVERS = {"clock set"}
"""Cases for commands that have others beside them, too."""
MOUNTING = {"disk full", "read-only place", "no shared memory"}


def main() -> None:
    """One case, in its name space; prints what was wrong."""
    case, name, place = sys.argv[1], sys.argv[2], Path(sys.argv[3])
    command = stoppables(place)[name]
    shutil.rmtree(place / "out", ignore_errors=True)
    print(json.dumps(CASES[case](command, place)))
    shutil.rmtree(place / "out", ignore_errors=True)


if __name__ == "__main__":
    main()
