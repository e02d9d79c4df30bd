"""Reads a recording frame by frame, in the order of its colour images."""

import os
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.rgbd import sanitize_depth
from riseg_drake.host.depth_files import DEPTH_TYPES, decode_depth
from riseg_drake.host.files import (
    FileError,
    LeadsOutError,
    check_inside,
    is_file,
    read_bytes,
)
from riseg_drake.host.images import MOST_BYTES, DamagedImageError, ImageKind, decode, image_kind, png_kind
from riseg_drake.recording import layout
from riseg_drake.recording.bop_scene import SCENE_CAMERA, read_bop_scene
from riseg_drake.recording.camera_file import read_camera
from riseg_drake.recording.image_lists import ImageLists, image_lists
from riseg_drake.recording.layout import LeftOut, RecordedFrame, RecordingError
from riseg_drake.recording.source import STAMP_LIMIT, RecordedSource, SourceOptions
from riseg_drake.recording.stamped_lists import (
    FEW,
    ListedFile,
    StampedTable,
    nearest_time,
    pose_between,
    read_table,
    row_between,
)

UNIT_LENGTH_TOLERANCE = 0.01
"""How far the length of a quaternion may be from 1: files round their numbers."""
INVALID = 65535
"""How some cameras spell "no depth", beside 0."""


class RecordingReader(RecordedSource):
    """Streams the frames of a folder; only the lists of stamps are held in memory.

    To each colour image belong the depth image with the nearest stamp, and the pose and the joints of its
    moment (between two rows, where there are two), at most `stamp_limit` seconds away. What lacks one of
    them, or cannot be read, is left out and noted in `left_out`. Raises RecordingError for what is no
    recording: at once where lists and the images' headers tell, while reading where only the images do.
    Paths and links that lead out of the folder are refused, unless they are to be followed (`follow`).
    """

    def __init__(
        self,
        folder: Path,
        stamp_limit: float = STAMP_LIMIT,
        *,
        follow: bool = False,
        options: SourceOptions | None = None,
    ):
        self._options = options or SourceOptions(stamp_limit, follow)
        if not os.path.isdir(folder):  # of a name that cannot be, too
            raise RecordingError(f"{folder} is not a folder; a recording is one that holds {layout.COLOR_LIST}")
        self.folder = self.path = folder
        self._inside = None if self._options.follow else folder
        self.left_out: list[LeftOut] = []
        """What was passed over so far, in the order in which it was found."""
        self.warnings: list[str] = []
        """What is possible, but odd."""
        self._stamp_limit = self._options.stamp_limit
        self.poses: StampedTable | None
        """The camera's poses, None without any."""
        self.joints: StampedTable | None
        """The joint angles, None without joints.csv."""
        if os.path.lexists(folder / SCENE_CAMERA) and not os.path.lexists(folder / layout.CAMERA_FILE):
            self._read_scene()
        else:
            self._read_layout()
        self.intrinsics = self._registration.intrinsics
        self.left_out += self._lists.left_out
        self._color_list = self._lists.color_file
        self.warnings += [f"{self._camera_file}: {odd}" for odd in layout.unlikely_camera(self.intrinsics)]
        self._frames = self._associated(self._lists, self._stamp_limit)
        self._check_headers()

    def _read_layout(self) -> None:
        """Camera, poses, joints and images as the project's own layout has them."""
        self._camera_file = self.folder / layout.CAMERA_FILE
        self._registration, self.depth_scale, odd = read_camera(self._camera_file, self._inside)
        self.warnings += [f"{self._camera_file}: {line}" for line in odd]
        self.poses = self._table(layout.POSE_LIST, columns=8)
        if self.poses is not None:
            _check_rigid(self.poses)
        self.camera_poses = None if self.poses is None else layout.POSE_LIST
        self.joints = self._table(layout.JOINT_LIST, columns=None, separator=",")
        self._lists = image_lists(self.folder, self._options, self._inside)

    def _read_scene(self) -> None:
        """The same of a scene of the BOP data sets."""
        self._camera_file = self.folder / SCENE_CAMERA
        rate = self._options.rate
        if rate is None:
            raise RecordingError(f"{self.folder} is a BOP scene; --rate HZ says how many images a second")
        self.joints = self._table(layout.JOINT_LIST, columns=None, separator=",")
        self._lists = image_lists(self.folder, self._options, self._inside)
        first = self.folder / self._lists.color[0].name
        scene = read_bop_scene(self.folder, first, rate, self._inside)
        self._registration, self.depth_scale, self.poses = scene.registration, scene.depth_scale, scene.poses
        self.camera_poses = None if self.poses is None else SCENE_CAMERA

    def __len__(self) -> int:
        """How many frames there are to read; those that turn out to be damaged are among them."""
        return len(self._frames)

    def times(self) -> list[float]:
        """Of all frames, s."""
        return [color.time for color, _ in self._frames]

    def holds_images(self, folder: str) -> bool:
        """Whether `robot` or `label` is there and holds something. Raises RecordingError if it is no folder."""
        path = self.folder / folder
        if not os.path.lexists(path):
            return False
        if not path.is_dir():
            raise RecordingError(f"{path} is no folder of images; make it one or take it away")
        self._check_leads_nowhere(path)
        return any(path.iterdir())

    @property
    def names(self) -> list[tuple[str, str]]:
        """Of each frame the colour and the depth image, as the lists have them."""
        return [(color.name, depth.name) for color, depth in self._frames]

    def images_beside(self, folder: str) -> int:
        """How many frames have an image of their own in `robot` or `label`."""
        return sum(is_file(self._beside(folder, color)) for color, _ in self.names)

    def frame(self, number: int) -> RecordedFrame | None:
        """One of the frames, from 0; None where it is damaged, which is noted when its turn comes."""
        try:
            return self._read(*self._frames[number])
        except DamagedImageError:
            return None

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
                self._look_at_scale(frame.depth, self._camera_file)
            frames += 1
            yield frame
        if frames == 0:
            raise RecordingError(f"{self._color_list}: {first_damage}")

    def _read(self, color: ListedFile, depth: ListedFile) -> RecordedFrame:
        robot = self._read_beside(layout.ROBOT_FOLDER, color.name)
        return RecordedFrame(
            time=color.time,
            color=self._registration.registered_color(self._read_color(color.name)),
            depth=self._registration.registered_depth(self._read_depth(depth.name)),
            X_WC=None if self.poses is None else pose_between(self.poses, color.time, self._stamp_limit),
            position=None if self.joints is None else row_between(self.joints, color.time, self._stamp_limit),
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

    def _associated(self, lists: ImageLists, limit: float) -> list[tuple[ListedFile, ListedFile]]:
        """Colour and depth images that belong together, where all else that there is belongs to them, too."""
        color, depth = lists.color, lists.depth
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
        for name, count in lonely.items():
            if 2 * count > len(color):
                odd = f"{count} of {len(color)} stamps have no partner in {name}: another clock, or unit?"
                self.warnings.append(odd)
        return frames

    def _check_headers(self) -> None:
        """Look at the first bytes of every image: wrong kinds and sizes shall not be found out at the end."""
        present, absent = [], []
        for color, depth in self._frames:
            try:
                self._check_header(color, self._lists.color_file, (3, 4), 8)
                self._check_header(depth, self._lists.depth_file, (1,), 16, self._registration.depth_shape)
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

    def _check_header(
        self,
        entry: ListedFile,
        file: Path,
        channels: tuple[int, ...],
        bits: int,
        shape: tuple[int, int] | None = None,
    ) -> None:
        path = self.folder / entry.name
        at = f"{file}: {self._lists.unit} {entry.line}: "
        where = f"{at}{path}"
        self._check_leads_nowhere(path, at)
        if not is_file(path):
            raise DamagedImageError(f"{path} is missing")
        self._check_kind(path, where, channels, (bits,), shape)

    def _check_kind(
        self,
        path: Path,
        where: str,
        channels: tuple[int, ...],
        bits: tuple[int, ...],
        shape: tuple[int, int] | None = None,
    ) -> None:
        try:
            kind = png_kind(path, self._inside)
        except LeadsOutError as error:
            raise layout.refusal(error) from None
        except FileError:
            kind = None
        if kind is None:
            return  # damaged, or no PNG: its turn comes when it is read
        found = 1 if kind.palette and 3 not in channels else kind.channels  # a palette's numbers are ids
        if found not in channels or kind.bits not in bits:
            right = f"{' or '.join(map(str, channels[:1]))} channel{'s' if channels[0] > 1 else ''} of "
            raise RecordingError(f"{where} has {kind}; it must have {right}{' or '.join(map(str, bits))} bits")
        self._check_size((kind.height, kind.width), where, shape)

    def _check_leads_nowhere(self, path: Path, where: str = "") -> None:
        """Raise RecordingError for what lies outside of the recording."""
        try:
            check_inside(path, self._inside)
        except LeadsOutError as error:
            raise layout.refusal(error, where) from None
        except FileError:
            return  # then it cannot be read either, and is missing

    def _check_size(self, shape: tuple[int, ...], where: str, right: tuple[int, int] | None = None) -> None:
        height, width = right or self.intrinsics.shape
        if shape != (height, width):
            raise RecordingError(
                f"{where} has {shape[1]}x{shape[0]} pixels, but {self._camera_file.name} says {width}x{height}"
            )

    def leave_out(self, color: ListedFile | RecordedFrame, why: str) -> None:
        """Note that a frame was passed over."""
        self.left_out.append(LeftOut(str(self._color_list), color.line, why, self._lists.unit))

    def _read_color(self, name: str) -> NDArray[np.uint8]:
        image = self._read_image(self.folder / name, jpeg=True)
        if image.dtype != np.uint8 or image.ndim != 3 or image.shape[2] not in (3, 4):
            raise RecordingError(f"{self.folder / name}: colour images have 3 channels of 8 bits")
        return cv2.cvtColor(image[..., :3], cv2.COLOR_BGR2RGB).astype(np.uint8, copy=False)

    def _read_depth(self, name: str) -> NDArray[np.float32]:
        path = self.folder / name
        try:
            image = decode_depth(read_bytes(path, MOST_BYTES, self._inside), str(path))
        except FileError as error:
            raise DamagedImageError(str(error)) from None
        if image.ndim != 2 or image.dtype not in DEPTH_TYPES:
            raise RecordingError(f"{path}: depth images have one channel of 16 bits, or of floats")
        self._check_size(image.shape, str(path), self._registration.depth_shape)
        # A product, as depth sensors and Drake make it: a quotient can differ in the last bit.
        metres_per_unit = np.float32(1 / self.depth_scale)
        if image.dtype == np.uint16:
            image = np.where(image == INVALID, 0, image)
        return sanitize_depth(image.astype(np.float32) * metres_per_unit)

    def _read_image(self, path: Path, *, jpeg: bool = False, indices: bool = False) -> NDArray:
        """The image of a file, once its header has promised the camera's size."""
        try:
            content = read_bytes(path, MOST_BYTES, self._inside)
        except FileError as error:
            raise DamagedImageError(str(error)) from None
        kind: ImageKind | None = image_kind(content)
        if kind is not None:
            self._check_size((kind.height, kind.width), str(path))
        return decode(content, str(path), jpeg=jpeg, indices=indices)

    def _beside(self, folder: str, color_name: str) -> Path:
        """The image in another folder that has the name of a colour image, or its stem, as of a JPEG."""
        path = self.folder / folder / Path(color_name).name
        return path if is_file(path) else path.with_suffix(".png")

    def _read_beside(self, folder: str, color_name: str) -> NDArray[np.uint16] | None:
        path = self._beside(folder, color_name)
        if not is_file(path):
            return None
        image = self._read_image(path, indices=True)
        if image.ndim != 2 or image.dtype not in (np.uint8, np.uint16):
            raise RecordingError(f"{path}: masks have one channel of 8 or 16 bits")
        return self._registration.registered_mask(image.astype(np.uint16))


def _check_rigid(poses: StampedTable) -> None:
    """Raise RecordingError where the numbers of a pose are no rotation."""
    length = np.linalg.norm(poses.values[:, 3:], axis=1)
    wrong = np.flatnonzero(np.abs(length - 1) > UNIT_LENGTH_TOLERANCE)
    if len(wrong):
        raise RecordingError(
            f"{poses.path}: line {poses.lines[wrong[0]]}: the quaternion (last four numbers) has the length "
            f"{length[wrong[0]]:.3g}; that of a rotation has 1"
        )
