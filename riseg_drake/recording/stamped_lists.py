"""The lists of a recording: lines that begin with a time stamp, and what belongs to a moment between them."""

import os
from array import array
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

from riseg_drake.host.files import FileError, read_text
from riseg_drake.recording.layout import LeftOut, RecordingError, pose_from_numbers, refusal

FEW = 1 / 20
"""Share of a list that may be out of order, or whose files may be missing, and is left out; where it is
more, the list is not what it says."""

_COUNTED = (1.1e15, 4e18)
"""Microseconds since 1970 as of 2004, and nanoseconds as of 2096; no number of seconds, metres or radians."""

_GAP = 5.0
"""Between two rows of a table further apart than so many stamp limits nothing is interpolated."""


@dataclass(frozen=True)
class ListedFile:
    """One line of rgb.txt or depth.txt."""

    line: int
    time: float
    """s"""
    name: str
    """As the line has it, relative to the recording."""


def read_file_list(path: Path, inside: Path | None = None) -> tuple[list[ListedFile], list[LeftOut]]:
    """The lines of a list of images in rising time, and those left out because they are not newer.

    The file must lie in the folder `inside`, where one is given. Raises RecordingError, with file and line,
    for what is no such list.
    """
    entries = []
    for line, cells in _lines(_text(path, inside), pieces=2):  # names may hold spaces
        if len(cells) != 2:
            raise RecordingError(f"{path}: line {line} must be: timestamp file")
        entries.append(ListedFile(line, _number(cells[0], path, line), cells[1]))
    if not entries:
        raise RecordingError(f"{path}: it names no image; its lines must be: timestamp file")
    times = np.array([entry.time for entry in entries])
    newer, left_out = _in_order(times, [entry.line for entry in entries], path)
    return [entries[k] for k in newer], left_out


@dataclass(frozen=True)
class StampedTable:
    """Rows of numbers in rising time; of poses or joint angles."""

    path: Path
    names: list[str]
    """What the heading calls the columns, without the stamp; empty if there is no heading."""
    times: NDArray[np.float64]
    """[N], s, rising."""
    values: NDArray[np.float64]
    """[N, K]"""
    lines: NDArray[np.intp]
    """[N], where in the file each row stands, from 1."""

    def bracket(self, time: float, limit: float) -> tuple[int, int, float] | None:
        """Rows i <= j and a share s such that (1 - s) row_i + s row_j belongs to a time.

        Between two rows near each other s is what lies between; elsewhere the nearest row counts alone.
        None where no row is within `limit` s.
        """
        j = int(np.searchsorted(self.times, time))
        i = max(0, j - 1)
        j = min(j, len(self.times) - 1)
        nearest = i if abs(time - self.times[i]) < abs(time - self.times[j]) else j
        if abs(self.times[nearest] - time) > limit:
            return None
        gap = self.times[j] - self.times[i]
        if self.times[nearest] == time or not self.times[i] < time < self.times[j] or gap > _GAP * limit:
            return nearest, nearest, 0.0
        return i, j, float((time - self.times[i]) / gap)


def read_table(
    path: Path, columns: int | None, separator: str | None = None, inside: Path | None = None
) -> tuple[StampedTable, list[LeftOut]] | None:
    """A table of numbers, the stamp first, and the rows left out; None if the file is not there.

    `columns` counts the stamp, None takes any number that is the same in all rows; the file must lie in the
    folder `inside`, where one is given. Raises RecordingError.
    """
    if not os.path.lexists(path):
        return None
    text = _text(path, inside)
    numbers, lines, names = array("d"), array("q"), _heading(text, separator)
    lost: list[LeftOut] = []
    for line, cells in _lines(text, separator):
        columns = columns or max(2, len(cells))
        if len(cells) != columns:
            raise RecordingError(f"{path}: line {line} must hold {columns} numbers, it holds {len(cells)}")
        if _lost(cells):
            lost.append(LeftOut(str(path), line, "it holds nan: nobody knew it at that moment"))
            continue
        numbers.extend(_number(cell, path, line) for cell in cells)
        lines.append(line)
    if lost and not lines:
        raise RecordingError(
            f"{path}: line {lost[0].line} holds 'nan' where a number should be, as all others do"
        )
    if not lines:
        raise RecordingError(f"{path}: it holds no numbers; fill it or take it away")
    rows = np.frombuffer(numbers).reshape(len(lines), -1)
    line_numbers = np.frombuffer(lines, np.int64).astype(np.intp)
    newer, left_out = _in_order(rows[:, 0], line_numbers.tolist(), path)
    table = StampedTable(path, names, rows[newer, 0], rows[newer, 1:], line_numbers[newer])
    return table, lost + left_out


def pose_between(poses: StampedTable, time: float, limit: float) -> NDArray[np.float64] | None:
    """The pose [4, 4] that belongs to a moment, s, out of rows tx ty tz qx qy qz qw; None if no row is near."""
    bracket = poses.bracket(time, limit)
    if bracket is None:
        return None
    i, j, share = bracket
    X = pose_from_numbers(poses.values[i])
    if share > 0:
        p, q = poses.values[[i, j], :3], poses.values[[i, j], 3:]
        X[:3, :3] = Slerp([0, 1], Rotation.from_quat(q))(share).as_matrix()
        X[:3, 3] = (1 - share) * p[0] + share * p[1]
    return X


def row_between(table: StampedTable, time: float, limit: float) -> NDArray[np.float64] | None:
    """The row [K] that belongs to a moment, s, such as joint angles; None if no row is near."""
    bracket = table.bracket(time, limit)
    if bracket is None:
        return None
    i, j, share = bracket
    q = table.values[i]
    return q + share * (table.values[j] - q) if share > 0 else q


def nearest_time(times: NDArray, time: float) -> int:
    """Which of N > 0 rising times [N] is the nearest."""
    j = int(np.searchsorted(times, time))
    return min((k for k in (j - 1, j) if 0 <= k < len(times)), key=lambda k: abs(times[k] - time))


def _in_order(
    times: NDArray[np.float64], lines: list[int], path: Path
) -> tuple[NDArray[np.intp], list[LeftOut]]:
    """Which stamps [N] are newer than all before, and what is to be said of the others."""
    newest = np.maximum.accumulate(times)
    newer = np.concatenate([[True], times[1:] > newest[:-1]])
    back = np.flatnonzero(np.concatenate([[False], times[1:] < newest[:-1]]))
    if len(back) > FEW * len(times):
        k = back[0]
        before, after = float(newest[k - 1]), float(times[k])
        raise RecordingError(
            f"{path}: line {lines[k]}: time runs backwards from {before!r} to {after!r} s; stamps must rise"
        )
    if len(times) > 2 and np.count_nonzero(newer) == 1:
        raise RecordingError(f"{path}: line {lines[1]}: all stamps are equal; stamps must rise")
    left_out = [
        LeftOut(
            str(path),
            lines[k],
            "its time runs backwards" if times[k] < newest[k - 1] else "its stamp was there before",
        )
        for k in np.flatnonzero(~newer)
    ]
    return np.flatnonzero(newer), left_out


def _heading(text: str, separator: str | None) -> list[str]:
    for line in text.splitlines():
        if line.startswith("timestamp"):
            return [cell.strip() for cell in line.split(separator)][1:]
        if line.strip() and not line.startswith("#"):
            break
    return []


def _lines(text: str, separator: str | None = None, pieces: int = 0) -> Iterator[tuple[int, list[str]]]:
    """The cells (at most so many) of every line that is neither empty, nor a comment, nor a table's heading."""
    # Not splitlines(): it knows line ends that text editors, and so people, do not count.
    for number, line in enumerate(text.split("\n"), start=1):
        if line.strip() and not line.startswith(("#", "timestamp")):
            yield number, line.strip().split(separator, pieces - 1)


def _lost(cells: list[str]) -> bool:
    """Whether a row says that there was nothing to measure, as trackers do that have lost their way."""
    return any(cell.strip().lower().lstrip("+-") == "nan" for cell in cells[1:])


def _number(cell: str, path: Path, line: int) -> float:
    try:
        value = float(cell)
    except ValueError:
        value = np.nan
    if _COUNTED[0] < value < _COUNTED[1]:
        unit, times = ("microseconds", "1e6") if value < 1e17 else ("nanoseconds", "1e9")
        raise RecordingError(
            f"{path}: line {line} holds {cell}, which looks like {unit} since 1970; stamps are seconds: "
            f"divide by {times}"
        )
    # What is no number of seconds, metres or radians would overflow later on.
    if not abs(value) < 1e15:
        raise RecordingError(f"{path}: line {line} holds {cell!r} where a number should be")
    return value


def _text(path: Path, inside: Path | None) -> str:
    try:
        return read_text(path, inside=inside)
    except FileError as error:
        raise refusal(error) from None
