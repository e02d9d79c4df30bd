"""The door for output folders: new, empty, or marked as the command's own; and one command at a time.

The mark is `command` in summary.json. It is written before anything else, and stays while an earlier result is
cleared away, so that a folder can be told at any moment. The lock is the system's, on the folder itself: it
leaves nothing behind, and ends with the process however that ends.
"""

import fcntl
import json
import math
import os
import re
import shutil
import time
import weakref
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from riseg_drake.host.files import MOST_TEXT, FileError, read_text
from riseg_drake.host.processes import undisturbed
from riseg_drake.recording.whole_file import write_bytes, write_text

SUMMARY = "summary.json"
PATIENCE = 2.0
"""How long a lock is waited for, s: one whose holder was killed is free soon."""

_NOUNS = {
    "run": "run",
    "hardware": "session",
    "hand-eye": "check",
    "segment": "segmentation",
    "evaluate": "evaluation",
}
_STATES = {"done": "finished", "interrupted": "stopped", "failed": "failed", "running": "cut off"}


class OutputError(ValueError):
    """Why nothing can be written to an output folder, in one line."""


def write_told(file: Path, content: bytes, *, make_folder: bool = False) -> None:
    """A file in the place that a person named, where that is a link where it leads. Raises OutputError."""
    try:
        if make_folder:
            file.parent.mkdir(parents=True, exist_ok=True)
        write_bytes(Path(os.path.realpath(file)), content)
    except OSError as error:
        raise OutputError(f"cannot write {file}: {error.strerror}") from None


class OutputFolder:
    """A folder that belongs to this command alone until `close`, or until nobody holds this object any more."""

    def __init__(
        self,
        path: Path,
        command: str,
        parts: str,
        about: Mapping[str, Any],
        *,
        overwrite: bool = False,
        goes_on: Callable[[dict[str, Any]], str] | None = None,
    ):
        """Claim a folder, or raise OutputError and leave it as it is.

        Args:
            path: made where it is not there.
            command: the mark.
            parts: regular expression of the names that the command gives to what it puts there.
            about: what the summary says beside the mark.
            overwrite: whether an earlier result of the same command is removed. Nothing else ever is.
            goes_on: whether an earlier result may be worked on further: why not, from its summary, or "".
        """
        self.path = path
        self.summary: dict[str, Any] = {"command": command, **about}
        self._parts = re.compile(parts)
        if path.exists() and not path.is_dir():
            raise OutputError(f"{path} is a file; give a folder for the output")
        with self.writing():
            path.mkdir(parents=True, exist_ok=True)
            # Closing the folder unlocks it; at the latest when this object goes.
            self._unlock = weakref.finalize(self, os.close, _lock(path))
            try:
                self._claim(command, overwrite, goes_on)
            except BaseException:
                self.close()
                raise

    def note(self, **entries: Any) -> None:
        """Enter something in the summary. Raises OutputError where it cannot be written."""
        self.summary.update(entries)
        with self.writing(), undisturbed():
            write_text(self.path / SUMMARY, to_json(self.summary))

    @contextmanager
    def writing(self) -> Iterator[None]:
        """What cannot be written in a `with` raises OutputError."""
        try:
            yield
        except OSError as error:
            where = error.filename or self.path
            raise OutputError(f"cannot write to {where}: {error.strerror or error}") from None

    def close(self) -> None:
        """Let others write there."""
        self._unlock()

    def __enter__(self) -> "OutputFolder":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _claim(self, command: str, overwrite: bool, goes_on: Callable[[dict[str, Any]], str] | None) -> None:
        noun, unfinished = _NOUNS[command], f".{SUMMARY}.unfinished"
        there = sorted(entry.name for entry in self.path.iterdir() if entry.name != unfinished)
        if not there:
            self.note()
            return
        earlier = read_json(self.path / SUMMARY)
        if earlier.get("command") != command:
            raise OutputError(
                f"{self.path} is not empty and holds no earlier {noun}; give a new folder, or an empty one"
            )
        if goes_on is not None and not overwrite:
            if reason := goes_on(earlier):
                raise OutputError(
                    f"{self.path} holds another {noun}, {reason}; give a new folder with --output"
                )
            self.note()
            return
        own = [name for name in there if self._parts.fullmatch(name)]
        if not overwrite:
            state = _STATES.get(str(earlier.get("state")), "damaged")
            raise OutputError(
                f"{self.path} holds an earlier {noun} ({state}); give another folder, or --overwrite to remove "
                f"its {_listed([SUMMARY, *own])}"
            )
        # The new summary goes first: what a summary lists must be there at any moment.
        self.note()
        for name in own:
            _remove(self.path / name)


def read_json(path: Path) -> dict[str, Any]:
    """The content of a file; empty if it is not there, or nobody can read it."""
    try:
        content = json.loads(read_text(path, MOST_TEXT))
    except (FileError, ValueError, RecursionError):
        return {}
    return content if isinstance(content, dict) else {}


def to_json(content: Any) -> str:
    """JSON text; NaN and infinity, which JSON does not have, become null."""
    return json.dumps(_finite(content), indent=2) + "\n"


def _finite(content: Any) -> Any:
    if isinstance(content, Mapping):
        return {key: _finite(value) for key, value in content.items()}
    if isinstance(content, list | tuple):
        return [_finite(value) for value in content]
    if isinstance(content, float) and not math.isfinite(content):
        return None
    return content


def _lock(folder: Path) -> int:
    """Open and lock a folder; returns its descriptor. Raises OutputError where another process holds it."""
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    deadline = time.monotonic() + PATIENCE
    while True:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            break
        except BlockingIOError:
            if time.monotonic() > deadline:
                os.close(descriptor)
                raise OutputError(
                    f"another riseg is writing to {folder}; wait for it, or give another folder"
                ) from None
            time.sleep(0.05)
        except OSError:  # some network drives know no locks
            break
    return descriptor


def _remove(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


def _listed(names: list[str]) -> str:
    """The names, with a run of numbers drawn together: step_0 to step_5."""
    groups: dict[str, list[str]] = {}
    for name in names:
        groups.setdefault(re.sub(r"\d+$", "", name), []).append(name)
    words = []
    for group in groups.values():
        group.sort(key=lambda name: (len(name), name))
        words.append(group[0] if len(group) == 1 else f"{group[0]} to {group[-1]}")
    return ", ".join(words)
