"""Writes a recording frame by frame; what is on disk is a valid recording at any moment."""

import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from types import TracebackType

import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.recording import layout
from riseg_drake.recording.layout import RecordedFrame, RecordingError
from riseg_drake.recording.whole_file import GrowingText, write_png, write_text


class RecordingWriter:
    """Appends frames to a folder that holds no recording yet. Use it in a `with` block.

    Memory does not grow with the recording. A list names an image only once that image is whole, so a
    recording that was cut off is short, never damaged. Joints and times are written to the last bit;
    depth is rounded to whole units, `depth_scale` of them a metre. Raises RecordingError where a recording is
    there already.
    """

    def __init__(
        self,
        folder: Path,
        intrinsics: Intrinsics,
        depth_scale: float = layout.MILLIMETRES,
        joint_names: Sequence[str] | None = None,
    ):
        if (folder / layout.COLOR_LIST).exists():
            raise RecordingError(f"{folder} holds a recording already; give another folder or move it away")
        self.folder = folder
        self.frames = 0
        """How many frames were written."""
        self._intrinsics = intrinsics
        self._depth_scale = depth_scale
        self._headers = dict(layout.HEADERS)
        if joint_names:
            self._headers[layout.JOINT_LIST] = ",".join(["timestamp", *joint_names])
        self._lists: dict[str, GrowingText] = {}
        folder.mkdir(parents=True, exist_ok=True)
        camera = layout.camera_to_json(intrinsics, depth_scale)
        write_text(folder / layout.CAMERA_FILE, json.dumps(camera, indent=2) + "\n")

    def append(self, frame: RecordedFrame) -> None:
        """Write one frame. Raises RecordingError if its images have another size than the camera's."""
        if frame.color.shape[:2] != self._intrinsics.shape or frame.depth.shape != self._intrinsics.shape:
            raise RecordingError(
                f"{self.folder}: the camera has {self._intrinsics.shape} pixels [v, u], frame "
                f"{self.frames} has {frame.color.shape[:2]} in colour and {frame.depth.shape} in depth"
            )
        name = f"{self.frames:06d}.png"
        color = self._write_image(layout.COLOR_FOLDER, name, frame.color)
        depth = self._write_image(layout.DEPTH_FOLDER, name, depth_to_units(frame.depth, self._depth_scale))
        if frame.robot is not None:
            self._write_image(layout.ROBOT_FOLDER, name, frame.robot.astype(np.uint8) * 255)
        if frame.labels is not None:
            self._write_image(layout.LABEL_FOLDER, name, frame.labels.astype(np.uint16))
        if frame.X_WC is not None:
            self._append_line(layout.POSE_LIST, [frame.time, *layout.pose_to_numbers(frame.X_WC)])
        if frame.position is not None:
            self._append_line(layout.JOINT_LIST, [frame.time, *frame.position.tolist()], ",")
        self._append_line(layout.DEPTH_LIST, [frame.time, depth])
        self._append_line(layout.COLOR_LIST, [frame.time, color])
        self.frames += 1

    def close(self) -> None:
        """Close the lists."""
        for lines in self._lists.values():
            lines.close()
        self._lists.clear()

    def __enter__(self) -> "RecordingWriter":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def _write_image(self, folder: str, name: str, image: NDArray) -> str:
        (self.folder / folder).mkdir(exist_ok=True)
        write_png(self.folder / folder / name, image)
        return f"{folder}/{name}"

    def _append_line(self, name: str, cells: Iterable[float | str], separator: str = " ") -> None:
        if name not in self._lists:
            self._lists[name] = GrowingText(self.folder / name)
            self._lists[name].append(self._headers[name])
        # repr gives the shortest digits that read back as the same number.
        line = separator.join(cell if isinstance(cell, str) else repr(float(cell)) for cell in cells)
        self._lists[name].append(line)


def depth_to_units(depth: NDArray, units: float) -> NDArray[np.uint16]:
    """Depth [H, W] from metres to so many units a metre, of 16 bits; what does not fit becomes 0, invalid."""
    whole = np.rint(depth.astype(np.float64) * units)
    # 65535 is how some cameras spell "invalid", so it is not used for a distance.
    return np.where((whole > 0) & (whole < 65535), whole, 0).astype(np.uint16)


def depth_to_millimetres(depth: NDArray) -> NDArray[np.uint16]:
    """Depth [H, W] from metres to whole millimetres of 16 bits; what does not fit becomes 0, invalid."""
    return depth_to_units(depth, layout.MILLIMETRES)
