"""Reads a recording frame by frame, in the order of its colour images."""

import json
import os
import re
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.geometry.rgbd import sanitize_depth
from riseg_drake.host.files import (
    MOST_SETTINGS,
    FileError,
    LeadsOutError,
    MissingFileError,
    check_inside,
    is_file,
    read_bytes,
    read_text,
)
from riseg_drake.host.images import MOST_BYTES, DamagedImageError, ImageKind, decode, image_kind, png_kind
from riseg_drake.recording import layout
from riseg_drake.recording.layout import LeftOut, RecordedFrame, RecordingError
from riseg_drake.recording.stamped_lists import (
    FEW,
    ListedFile,
    StampedTable,
    nearest_time,
    read_file_list,
    read_table,
)

STAMP_LIMIT = 0.02
"""How far the stamps of what belongs together may lie apart, s; the TUM tools' own value."""
UNIT_LENGTH_TOLERANCE = 0.01
"""How far the length of a quaternion may be from 1: files round their numbers."""
LIKELY_DEPTH = (0.1, 10.0)
"""m; a median depth outside most often means a wrong depth_scale."""
INVALID = 65535
"""How some cameras spell "no depth", beside 0."""


class RecordingReader:
    """Streams the frames of a folder; only the lists of stamps are held in memory.

    To each colour image belong the depth image with the nearest stamp, and the pose and the joints of its
    moment (between two rows, where there are two), at most `stamp_limit` seconds away. What lacks one of
    them, or cannot be read, is left out and noted in `left_out`. Raises RecordingError for what is no
    recording: at once where lists and the images' headers tell, while reading where only the images do.
    Paths and links that lead out of the folder are refused, unless they are to be followed (`follow`).
    """

    def __init__(self, folder: Path, stamp_limit: float = STAMP_LIMIT, *, follow: bool = False):
        if not os.path.isdir(folder):  # of a name that cannot be, too
            raise RecordingError(f"{folder} is not a folder; a recording is one that holds {layout.COLOR_LIST}")
        self.folder = folder
        self._inside = None if follow else folder
        self.left_out: list[LeftOut] = []
        """What was passed over so far, in the order in which it was found."""
        self.warnings: list[str] = []
        """What is possible, but odd."""
        self.intrinsics, self._depth_scale = _read_camera(folder / layout.CAMERA_FILE, self._inside)
        camera_file = folder / layout.CAMERA_FILE
        self.warnings += [f"{camera_file}: {odd}" for odd in layout.unlikely_camera(self.intrinsics)]
        self._stamp_limit = stamp_limit
        self._color_list = folder / layout.COLOR_LIST
        self.poses = self._table(layout.POSE_LIST, columns=8)
        """The camera's poses, None without groundtruth.txt."""
        if self.poses is not None:
            _check_rigid(self.poses)
        self.joints = self._table(layout.JOINT_LIST, columns=None, separator=",")
        """The joint angles, None without joints.csv."""
        self._frames = self._associated(stamp_limit)
        self._check_headers()

    def __len__(self) -> int:
        """How many frames there are to read; those that turn out to be damaged are among them."""
        return len(self._frames)

    @property
    def rate(self) -> float:
        """Frames a second, by the median; 1 for a single frame."""
        times = [color.time for color, _ in self._frames]
        return float(1 / np.median(np.diff(times))) if len(times) > 1 else 1.0

    def holds_images(self, folder: str) -> bool:
        """Whether `robot` or `label` is there and holds something. Raises RecordingError if it is no folder."""
        path = self.folder / folder
        if not os.path.lexists(path):
            return False
        if not path.is_dir():
            raise RecordingError(f"{path} is no folder of images; make it one or take it away")
        self._check_leads_nowhere(path)
        return any(path.iterdir())

    def __iter__(self) -> Iterator[RecordedFrame]:
        first_damage = ""
        frames = 0
        for color, depth in self._frames:
            try:
                frame = self._read(color, depth)
            except DamagedImageError as damage:
                first_damage = first_damage or f"line {color.line}: no frame can be read: {damage}"
                self.leave_out(color, str(damage))
                continue
            if frames == 0:
                self._look_at_scale(frame.depth)
            frames += 1
            yield frame
        if frames == 0:
            raise RecordingError(f"{self._color_list}: {first_damage}")

    def _read(self, color: ListedFile, depth: ListedFile) -> RecordedFrame:
        robot = self._read_beside(layout.ROBOT_FOLDER, color.name)
        return RecordedFrame(
            time=color.time,
            color=self._read_color(color.name),
            depth=self._read_depth(depth.name),
            X_WC=self._pose_at(color.time),
            position=self._position_at(color.time),
            robot=None if robot is None else robot > 0,
            labels=self._read_beside(layout.LABEL_FOLDER, color.name),
            name=color.name,
            line=color.line,
        )

    def _table(self, name: str, columns: int | None, separator: str | None = None) -> StampedTable | None:
        read = read_table(self.folder / name, columns, separator, self._inside)
        if read is None:
            return None
        self.left_out += read[1]
        return read[0]

    def _associated(self, limit: float) -> list[tuple[ListedFile, ListedFile]]:
        """Colour and depth images that belong together, where all else that there is belongs to them, too."""
        color, repeated = read_file_list(self._color_list, self._inside)
        depth, unordered = read_file_list(self.folder / layout.DEPTH_LIST, self._inside)
        self.left_out += repeated + unordered
        stamps = {layout.DEPTH_LIST: np.array([entry.time for entry in depth])}
        for table in (self.poses, self.joints):
            if table is not None:
                stamps[table.path.name] = table.times
        frames, lonely = [], dict.fromkeys(stamps, 0)
        for entry in color:
            apart = {name: abs(t[nearest_time(t, entry.time)] - entry.time) for name, t in stamps.items()}
            missing = [name for name, seconds in apart.items() if seconds > limit]
            for name in missing:
                lonely[name] += 1
            if missing:
                seconds = apart[missing[0]]
                self.leave_out(entry, f"{missing[0]} has nothing nearer than {seconds:.3g} s in time")
            else:
                frames.append((entry, depth[nearest_time(stamps[layout.DEPTH_LIST], entry.time)]))
        if not frames:
            name = max(lonely, key=lambda n: lonely[n])
            raise RecordingError(
                f"{self._color_list}: line {color[0].line}: neither this stamp nor any other has a partner "
                f"in {name} within {limit:g} s; compare the stamps, or allow more with --stamp-limit"
            )
        return frames

    def _check_headers(self) -> None:
        """Look at the first bytes of every image: wrong kinds and sizes shall not be found out at the end."""
        present, absent = [], []
        for color, depth in self._frames:
            try:
                for entry, file, channels, bits in (
                    (color, layout.COLOR_LIST, (3, 4), 8),
                    (depth, layout.DEPTH_LIST, (1,), 16),
                ):
                    self._check_header(entry, file, channels, bits)
            except DamagedImageError as missing:
                absent.append((color, str(missing)))
                continue
            present.append((color, depth))
        if len(absent) > FEW * len(self._frames):
            color, why = absent[0]
            raise RecordingError(f"{self._color_list}: line {color.line}: {why}")
        for color, why in absent:
            self.leave_out(color, why)
        self._frames = present
        for folder in (layout.ROBOT_FOLDER, layout.LABEL_FOLDER):
            if self.holds_images(folder):
                for color, _ in present:
                    path = self._beside(folder, color.name)
                    if is_file(path):
                        self._check_kind(path, str(path), (1,), (8, 16))

    def _check_header(self, entry: ListedFile, file: str, channels: tuple[int, ...], bits: int) -> None:
        path = self.folder / entry.name
        where = f"{self.folder / file}: line {entry.line}: {path}"
        self._check_leads_nowhere(path, f"{self.folder / file}: line {entry.line}: ")
        if not is_file(path):
            raise DamagedImageError(f"{path} is missing")
        self._check_kind(path, where, channels, (bits,))

    def _check_kind(self, path: Path, where: str, channels: tuple[int, ...], bits: tuple[int, ...]) -> None:
        try:
            kind = png_kind(path, self._inside)
        except LeadsOutError as error:
            raise layout.refusal(error) from None
        except FileError:
            kind = None
        if kind is None:
            return  # damaged, or no PNG: its turn comes when it is read
        if kind.channels not in channels or kind.bits not in bits:
            right = f"{' or '.join(map(str, channels[:1]))} channel{'s' if channels[0] > 1 else ''} of "
            raise RecordingError(f"{where} has {kind}; it must have {right}{' or '.join(map(str, bits))} bits")
        self._check_size((kind.height, kind.width), where)

    def _check_leads_nowhere(self, path: Path, where: str = "") -> None:
        """Raise RecordingError for what lies outside of the recording."""
        try:
            check_inside(path, self._inside)
        except LeadsOutError as error:
            raise layout.refusal(error, where) from None
        except FileError:
            return  # then it cannot be read either, and is missing

    def _check_size(self, shape: tuple[int, ...], where: str) -> None:
        if shape != self.intrinsics.shape:
            raise RecordingError(
                f"{where} has {shape[1]}x{shape[0]} pixels, but {layout.CAMERA_FILE} says "
                f"{self.intrinsics.width}x{self.intrinsics.height}"
            )

    def _pose_at(self, time: float) -> NDArray[np.float64] | None:
        """X_WC [4, 4] at a moment that has one."""
        if self.poses is None:
            return None
        i, j, share = self.poses.bracket(time, self._stamp_limit) or (0, 0, 0.0)
        X_WC = layout.pose_from_numbers(self.poses.values[i])
        if share > 0:
            p, q = self.poses.values[[i, j], :3], self.poses.values[[i, j], 3:]
            X_WC[:3, :3] = Slerp([0, 1], Rotation.from_quat(q))(share).as_matrix()
            X_WC[:3, 3] = (1 - share) * p[0] + share * p[1]
        return X_WC

    def _position_at(self, time: float) -> NDArray[np.float64] | None:
        """Joint angles theta_t at a moment that has them, rad."""
        if self.joints is None:
            return None
        i, j, share = self.joints.bracket(time, self._stamp_limit) or (0, 0, 0.0)
        q = self.joints.values[i]
        return q + share * (self.joints.values[j] - q) if share > 0 else q

    def leave_out(self, color: ListedFile | RecordedFrame, why: str) -> None:
        """Note that a frame was passed over."""
        self.left_out.append(LeftOut(str(self._color_list), color.line, why))

    def _look_at_scale(self, depth: NDArray[np.float32]) -> None:
        """Warn of a depth that is unlikely on the whole."""
        if not (depth > 0).any():
            return
        median = float(np.median(depth[depth > 0]))
        if not LIKELY_DEPTH[0] <= median <= LIKELY_DEPTH[1]:
            self.warnings.append(
                f"{self.folder / layout.CAMERA_FILE}: the median depth is {median:.3g} m, which is unlikely; "
                f'is "depth_scale" (units per metre) right?'
            )

    def _read_color(self, name: str) -> NDArray[np.uint8]:
        image = self._read_image(self.folder / name, jpeg=True)
        if image.dtype != np.uint8 or image.ndim != 3 or image.shape[2] not in (3, 4):
            raise RecordingError(f"{self.folder / name}: colour images have 3 channels of 8 bits")
        return cv2.cvtColor(image[..., :3], cv2.COLOR_BGR2RGB).astype(np.uint8, copy=False)

    def _read_depth(self, name: str) -> NDArray[np.float32]:
        image = self._read_image(self.folder / name)
        if image.dtype != np.uint16 or image.ndim != 2:
            raise RecordingError(f"{self.folder / name}: depth images have one channel of 16 bits")
        # A product, as depth sensors and Drake make it: a quotient can differ in the last bit.
        metres_per_unit = np.float32(1 / self._depth_scale)
        depth = np.where(image == INVALID, 0, image).astype(np.float32) * metres_per_unit
        return sanitize_depth(depth)

    def _read_image(self, path: Path, *, jpeg: bool = False) -> NDArray:
        """The image of a file, once its header has promised the camera's size."""
        try:
            content = read_bytes(path, MOST_BYTES, self._inside)
        except FileError as error:
            raise DamagedImageError(str(error)) from None
        kind: ImageKind | None = image_kind(content)
        if kind is not None:
            self._check_size((kind.height, kind.width), str(path))
        return decode(content, str(path), jpeg=jpeg)

    def _beside(self, folder: str, color_name: str) -> Path:
        """The PNG image in another folder that has the name of a colour image, a JPEG's but for its ending."""
        name = Path(color_name).name
        return self.folder / folder / re.sub(r"\.jpe?g$", ".png", name, flags=re.IGNORECASE)

    def _read_beside(self, folder: str, color_name: str) -> NDArray[np.uint16] | None:
        path = self._beside(folder, color_name)
        if not is_file(path):
            return None
        image = self._read_image(path)
        if image.ndim != 2 or image.dtype not in (np.uint8, np.uint16):
            raise RecordingError(f"{path}: masks have one channel of 8 or 16 bits")
        return image.astype(np.uint16)


def _read_camera(path: Path, inside: Path | None) -> tuple[Intrinsics, float]:
    try:
        content = json.loads(read_text(path, MOST_SETTINGS, inside))
    except MissingFileError:
        raise RecordingError(
            f"{path} is missing; it holds width, height, fx, fy, cx, cy, depth_scale"
        ) from None
    except json.JSONDecodeError as error:
        raise RecordingError(f"{path}: line {error.lineno} is not JSON ({error.msg})") from None
    except FileError as error:
        raise layout.refusal(error) from None
    except (ValueError, RecursionError):
        raise RecordingError(f"{path} is no JSON that can be read") from None
    try:
        return layout.camera_from_json(content)
    except RecordingError as error:
        raise RecordingError(f"{path}: {error}") from None


def _check_rigid(poses: StampedTable) -> None:
    """Raise RecordingError where the numbers of a pose are no rotation."""
    length = np.linalg.norm(poses.values[:, 3:], axis=1)
    wrong = np.flatnonzero(np.abs(length - 1) > UNIT_LENGTH_TOLERANCE)
    if len(wrong):
        raise RecordingError(
            f"{poses.path}: line {poses.lines[wrong[0]]}: the quaternion (last four numbers) has the length "
            f"{length[wrong[0]]:.3g}; that of a rotation has 1"
        )
