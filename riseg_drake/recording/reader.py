"""Reads a recording frame by frame, in the order of its colour images."""

import json
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.rgbd import sanitize_depth
from riseg_drake.recording import layout
from riseg_drake.recording.layout import RecordedFrame, RecordingError

STAMP_LIMIT = 0.02
"""How far the stamps of what belongs together may lie apart, s; the TUM tools' own value."""


class RecordingReader:
    """Streams the frames of a folder; only the lists of stamps are held in memory.

    Depth image, pose and joints are those with the nearest stamp, at most `stamp_limit` seconds from
    the colour image's; colour images without a depth image are left out. Raises RecordingError.
    """

    def __init__(self, folder: Path, stamp_limit: float = STAMP_LIMIT):
        if not folder.is_dir():
            raise RecordingError(f"{folder} is not a folder; a recording is one that holds {layout.COLOR_LIST}")
        self.folder = folder
        self.intrinsics, self._depth_scale = _read_camera(folder / layout.CAMERA_FILE)
        color = _read_file_list(folder / layout.COLOR_LIST)
        depth = _read_file_list(folder / layout.DEPTH_LIST)
        depth_times = np.array([time for time, _ in depth])
        self._images: list[tuple[float, str, str]] = []
        for time, name in color:
            nearest = _nearest(depth_times, time, stamp_limit)
            if nearest is not None:
                self._images.append((time, name, depth[nearest][1]))
        self._poses = _read_numbers(folder / layout.POSE_LIST, columns=8)
        self._joints = _read_numbers(folder / layout.JOINT_LIST, columns=8, separator=",")
        self._stamp_limit = stamp_limit

    def __len__(self) -> int:
        """How many frames have colour and depth."""
        return len(self._images)

    def __iter__(self) -> Iterator[RecordedFrame]:
        for time, color_name, depth_name in self._images:
            pose = self._at(self._poses, time)
            robot = self._read_beside(layout.ROBOT_FOLDER, color_name)
            yield RecordedFrame(
                time=time,
                color=self._read_color(color_name),
                depth=self._read_depth(depth_name),
                X_WC=None if pose is None else layout.pose_from_numbers(pose),
                position=self._at(self._joints, time),
                robot=None if robot is None else robot > 0,
                labels=self._read_beside(layout.LABEL_FOLDER, color_name),
            )

    def _at(self, table: NDArray[np.float64] | None, time: float) -> NDArray[np.float64] | None:
        """The numbers whose stamp is the nearest to a time, None where there are none near enough."""
        if table is None:
            return None
        nearest = _nearest(table[:, 0], time, self._stamp_limit)
        return None if nearest is None else table[nearest, 1:]

    def _read_color(self, name: str) -> NDArray[np.uint8]:
        image = self._read_image(name)
        if image.dtype != np.uint8 or image.ndim != 3:
            raise RecordingError(f"{self.folder / name}: colour images have 3 channels of 8 bits")
        return cv2.cvtColor(image[..., :3], cv2.COLOR_BGR2RGB).astype(np.uint8, copy=False)

    def _read_depth(self, name: str) -> NDArray[np.float32]:
        image = self._read_image(name)
        if image.dtype != np.uint16 or image.ndim != 2:
            raise RecordingError(f"{self.folder / name}: depth images have one channel of 16 bits")
        # A product, as depth sensors and Drake make it: a quotient can differ in the last bit.
        metres_per_unit = np.float32(1 / self._depth_scale)
        depth = np.where(image == 65535, 0, image).astype(np.float32) * metres_per_unit
        return sanitize_depth(depth)

    def _read_beside(self, folder: str, color_name: str) -> NDArray[np.uint16] | None:
        """The mask in another folder that has the name of a colour image, if it is there."""
        name = f"{folder}/{Path(color_name).name}"
        if not (self.folder / name).exists():
            return None
        image = self._read_image(name)
        if image.ndim != 2:
            raise RecordingError(f"{self.folder / name}: masks have one channel of 8 or 16 bits")
        return image.astype(np.uint16)

    def _read_image(self, name: str) -> NDArray:
        path = self.folder / name
        try:
            image = cv2.imdecode(np.fromfile(path, np.uint8), cv2.IMREAD_UNCHANGED)
        except (OSError, cv2.error):
            image = None
        if image is None:
            raise RecordingError(f"{path} is not a readable PNG image")
        if image.shape[:2] != self.intrinsics.shape:
            raise RecordingError(
                f"{path} has {image.shape[1]}x{image.shape[0]} pixels, but {layout.CAMERA_FILE} says "
                f"{self.intrinsics.width}x{self.intrinsics.height}"
            )
        return image


def _nearest(times: NDArray[np.float64], time: float, limit: float) -> int | None:
    if len(times) == 0:
        return None
    nearest = int(np.argmin(np.abs(times - time)))
    return nearest if abs(times[nearest] - time) <= limit else None


def _read_camera(path: Path) -> tuple[layout.Intrinsics, float]:
    try:
        return layout.camera_from_json(json.loads(_read_text(path)))
    except json.JSONDecodeError as error:
        raise RecordingError(f"{path}: line {error.lineno} is not JSON ({error.msg})") from None
    except RecordingError as error:
        raise error if str(path) in str(error) else RecordingError(f"{path}: {error}") from None


def _read_file_list(path: Path) -> list[tuple[float, str]]:
    """(timestamp, file) of every line."""
    entries = []
    for number, cells in _lines(path, separator=None):
        if len(cells) != 2:
            raise RecordingError(f"{path}: line {number} must be: timestamp file")
        entries.append((_number(cells[0], path, number), cells[1]))
    return entries


def _read_numbers(path: Path, columns: int, separator: str | None = None) -> NDArray[np.float64] | None:
    """All lines as one table [n, columns], the stamp first; None if the file is not there."""
    if not path.exists():
        return None
    rows = []
    for number, cells in _lines(path, separator):
        if len(cells) != columns:
            raise RecordingError(f"{path}: line {number} must hold {columns} numbers, it holds {len(cells)}")
        rows.append([_number(cell, path, number) for cell in cells])
    return np.array(rows, float).reshape(-1, columns)


def _lines(path: Path, separator: str | None) -> Iterator[tuple[int, list[str]]]:
    """The cells of every line that is neither empty, nor a comment, nor the heading of a table."""
    for number, line in enumerate(_read_text(path).splitlines(), start=1):
        if line.strip() and not line.startswith(("#", "timestamp")):
            yield number, line.split(separator)


def _number(cell: str, path: Path, line: int) -> float:
    try:
        value = float(cell)
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise RecordingError(f"{path}: line {line} holds {cell!r} where a number should be")
    return value


def _read_text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise RecordingError(f"{path} is missing") from None
    except (OSError, UnicodeDecodeError):
        raise RecordingError(f"{path} is not a readable text file") from None
