"""A way in: a right input, what is done to it, and how it is read."""

import contextlib
import io
import os
import random
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from riseg_drake.app.cli import _mistakes
from tests.faults.mutations import chunked_png, misplaced, mutated, resized_jpeg, resized_png


@dataclass(frozen=True)
class Reader:
    """A way in."""

    prepare: Callable[[Path], None]
    """Write a right input into an empty folder."""
    mutate: Callable[[Path, random.Random], str]
    """Do something to it; says what."""
    read: Callable[[Path], int]
    """Exit code, as the command line has it; one line is on the error stream where it is 2."""


def as_command(read: Callable[[Path], object]) -> Callable[[Path], int]:
    """Read as the command line does: what it would say in one line is said."""

    def reading(place: Path) -> int:
        try:
            read(place)
        except _mistakes() as error:
            with contextlib.redirect_stderr(io.StringIO()):
                return 2 if str(error) else 1
        return 0

    return reading


def _change(path: Path, rng: random.Random) -> str:
    """Something is done to one file."""
    if os.path.lexists(path) and (path.is_symlink() or not path.is_file() or path.stat().st_size > 2**24):
        return f"{path.name} left as it is"  # it was misplaced before
    if rng.random() < 0.06:
        misplaced(path, rng)
        return f"{path.name} misplaced"
    content = path.read_bytes() if path.exists() else b""
    special = [mutated]
    if content[:4] == b"\x89PNG":
        special += [resized_png, chunked_png]
    elif content[:2] == b"\xff\xd8":
        special.append(resized_jpeg)
    how = rng.choice(special)
    path.unlink(missing_ok=True)
    path.write_bytes(how(content, rng))
    return f"{path.name} {how.__name__}"


def some(files: Callable[[Path], list[Path]]) -> Callable[[Path, random.Random], str]:
    """One to three of some files are changed."""

    def mutate(place: Path, rng: random.Random) -> str:
        there = sorted(files(place))
        return ", ".join(_change(rng.choice(there), rng) for _ in range(rng.choice((1, 1, 1, 2, 3))))

    return mutate


def all_files(place: Path) -> list[Path]:
    return [path for path in place.rglob("*") if not path.is_dir()]
