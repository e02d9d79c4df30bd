"""The door for files that somebody else made: regular ones, of a size that can be, and where they should lie.

Everything is read through here, so that a pipe hangs no command, a device fills no memory, and a link in a
recording does not lead to somebody's other files.
"""

import difflib
import os
import stat
from collections.abc import Sequence
from pathlib import Path

MOST_TEXT = 64 * 2**20
"""Bytes of a text: a list of more than a million stamps."""
MOST_SETTINGS = 2**20
"""Bytes of a file that a person writes, such as a scenario or a camera.json."""


class FileError(ValueError):
    """Why a file is not read, in one line that names it."""


class MissingFileError(FileError):
    """There is no such file."""


def near_name(path: Path, suffixes: Sequence[str] = ()) -> str:
    """A hint, such as "; did you mean X?", at a name near to the first part of a path that is missing.

    With `suffixes`, only what ends so counts. Empty where nothing is near, or the path is there.
    """
    try:
        while not path.parent.exists() and path.parent != path:
            path = path.parent
        names = [entry.name for entry in path.parent.iterdir() if not suffixes or entry.suffix in suffixes]
    except (OSError, ValueError):
        return ""
    near = [] if path.name in names else difflib.get_close_matches(path.name, names, n=1)
    return f"; did you mean {path.parent / near[0]}?" if near else ""


class LeadsOutError(FileError):
    """A path or a link leads out of the folder that it belongs to."""


def read_bytes(path: Path, most: int, inside: Path | None = None, *, first: int | None = None) -> bytes:
    """The content of a regular file of at most so many bytes, or only its `first` ones.

    With `inside`, the file must lie in that folder once all links are followed. Raises FileError, and above all
    MissingFileError and LeadsOutError.
    """
    check_inside(path, inside)
    try:
        # Without O_NONBLOCK opening a pipe waits for somebody who writes to it.
        descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
        try:
            mode = os.fstat(descriptor).st_mode
            if not stat.S_ISREG(mode):
                raise FileError(f"{path} is {_kind(mode)}, not a file")
            with open(descriptor, "rb", closefd=False) as file:
                content = file.read(most + 1 if first is None else first)
        finally:
            os.close(descriptor)
    except FileNotFoundError:
        raise MissingFileError(f"{path} is missing") from None
    except (OSError, ValueError) as error:
        if isinstance(error, FileError):
            raise
        raise FileError(f"{path} cannot be read ({_reason(error)})") from None
    if len(content) > most:
        raise FileError(f"{path} is larger than {most / 2**20:g} MB, the most that is read")
    return content


def read_text(path: Path, most: int = MOST_TEXT, inside: Path | None = None) -> str:
    """The same for a text in UTF-8, without the mark that some editors begin a file with. Raises FileError."""
    try:
        return read_bytes(path, most, inside).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise FileError(f"{path} is not a readable text file") from None


def is_file(path: Path) -> bool:
    """Whether a regular file is there; links are followed, and a path that cannot be is no file."""
    try:
        return stat.S_ISREG(os.stat(path).st_mode)
    except (OSError, ValueError):
        return False


def check_inside(path: Path, folder: Path | None) -> None:
    """Raise LeadsOutError unless a path lies in the folder once all links are followed; None allows all.

    FileError where that cannot be known.
    """
    if folder is None:
        return
    try:
        inside = Path(os.path.realpath(path)).is_relative_to(os.path.realpath(folder))
    except (OSError, ValueError) as error:
        raise FileError(f"{path} cannot be read ({_reason(error)})") from None
    if not inside:
        raise LeadsOutError(f"{path} leads out of {folder}")


def _kind(mode: int) -> str:
    for test, kind in (
        (stat.S_ISDIR, "a folder"),
        (stat.S_ISFIFO, "a pipe"),
        (stat.S_ISSOCK, "a socket"),
    ):
        if test(mode):
            return kind
    return "a device"


def _reason(error: Exception) -> str:
    return (error.strerror if isinstance(error, OSError) else None) or str(error)
