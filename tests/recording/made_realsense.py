"""RealSense files for tests, recorded by librealsense itself from frames that a software device gives it."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import pyrealsense2 as rs

from riseg_drake.geometry.camera import Intrinsics

MOST_PLAYED = 10
"""Times a file is played."""
EPOCH = 1.7e9
"""s; the first frame's time."""


@dataclass
class RealSenseKind:
    """A camera with two imagers, and how it is recorded."""

    color: Intrinsics
    depth: Intrinsics
    X_CD: np.ndarray = field(default_factory=lambda: np.eye(4))
    unit: float = 0.001
    """Of depth, m."""
    format: str = "rgb8"
    model: str = "none"
    distortion: tuple[float, ...] = (0.0,) * 5
    """Of the colour camera."""
    compressed: bool = True
    rate: float = 10.0
    serial: str = "0123456789"


def realsense_intrinsics(k: Intrinsics, model: str = "none", distortion: Iterable[float] = (0.0,) * 5):
    """Intrinsics as librealsense has them."""
    made = rs.intrinsics()
    made.width, made.height, made.fx, made.fy, made.ppx, made.ppy = k.width, k.height, k.fx, k.fy, k.cx, k.cy
    made.model, made.coeffs = getattr(rs.distortion, model), list(distortion)
    return made


class SoftwareCamera:
    """A device of librealsense without hardware, whose frames are those it is given."""

    def __init__(self, kind: RealSenseKind):
        self._kind, self._number = kind, 0
        self.device = rs.software_device()
        for what, said in (
            (rs.camera_info.name, "Intel RealSense D435"),
            (rs.camera_info.serial_number, kind.serial),
        ):
            self.device.register_info(what, said)
        self._sensors = [self.device.add_sensor(name) for name in ("Stereo Module", "RGB Camera")]
        self._bytes = {"rgb8": 3, "bgr8": 3, "rgba8": 4, "yuyv": 2, "uyvy": 2}[kind.format]
        depth = _stream(rs.stream.depth, 1, 2, rs.format.z16, realsense_intrinsics(kind.depth))
        color = _stream(
            rs.stream.color,
            2,
            self._bytes,
            getattr(rs.format, kind.format),
            realsense_intrinsics(kind.color, kind.model, kind.distortion),
        )
        self.profiles = [
            sensor.add_video_stream(stream)
            for sensor, stream in zip(self._sensors, (depth, color), strict=True)
        ]
        self._sensors[0].add_read_only_option(rs.option.depth_units, kind.unit)
        offset = rs.extrinsics()
        offset.rotation, offset.translation = kind.X_CD[:3, :3].T.ravel().tolist(), kind.X_CD[:3, 3].tolist()
        self.profiles[0].register_extrinsics_to(self.profiles[1], offset)

    def give(self, color: np.ndarray, depth: np.ndarray) -> None:
        """The next frame: colour [H, W, channels] bytes, and depth [H, W] in units."""
        time = 1000 * (EPOCH + self._number / self._kind.rate)
        self._number += 1
        for sensor, profile, pixels, size in zip(
            self._sensors, self.profiles, (depth, color), (2, self._bytes), strict=True
        ):
            frame = rs.software_video_frame()
            frame.pixels, frame.bpp, frame.stride = np.ascontiguousarray(pixels), size, size * pixels.shape[1]
            frame.timestamp, frame.domain = time, rs.timestamp_domain.global_time
            frame.frame_number, frame.profile = self._number, profile.as_video_stream_profile()
            if size == 2 and pixels.ndim == 2:
                frame.depth_units = self._kind.unit
            sensor.on_video_frame(frame)


def record(path: Path, kind: RealSenseKind, frames: Iterable[tuple[np.ndarray, np.ndarray]]) -> Path:
    """A file of (colour, depth) frames; the suffix must be that which this version of librealsense writes.

    In a process of its own: librealsense's threads let go of Python's images when they please, and wait for
    Python's lock then with locks of their own.
    """
    process = get_context("spawn").Process(target=_record, args=(path, kind, list(frames)), daemon=True)
    process.start()
    process.join(60)
    assert process.exitcode == 0, f"librealsense did not record: {process.exitcode}"
    return path


def _record(path: Path, kind: RealSenseKind, frames: list[tuple[np.ndarray, np.ndarray]]) -> None:
    camera = SoftwareCamera(kind)
    recorder = rs.recorder(str(path), camera.device, kind.compressed)
    queue, sensors = rs.frame_queue(8), recorder.query_sensors()
    for sensor, profile in zip(sensors, camera.profiles, strict=True):
        sensor.open(profile)
        sensor.start(queue)
    for color, depth in frames:
        camera.give(color, depth)
        for _ in range(2):
            queue.wait_for_frame(5000)
    for sensor in sensors:
        sensor.stop()
        sensor.close()


def aligned_by_librealsense(path: Path, count: int) -> list[tuple[np.ndarray, np.ndarray]]:
    """(colour [H, W, 3], aligned depth [H, W] in units) of a short file that librealsense plays and aligns.

    At the end of a file librealsense drops some images, others each time: it is played until all have come.
    """
    devices: list[Any] = []  # images are theirs
    depths: dict[int, Any] = {}
    colors: dict[int, Any] = {}
    for _ in range(MOST_PLAYED):
        devices.append(rs.context().load_device(str(path)))
        for frame in _played(devices[-1]):
            (depths if frame.is_depth_frame() else colors)[frame.get_frame_number() - 1] = frame
        if len(depths.keys() & colors.keys()) == count:
            break
    # All that is played is here before anything of Python is called: see `record`.
    joined, pair = rs.frame_queue(1), []
    join = rs.processing_block(lambda frame, source: source.frame_ready(source.allocate_composite_frame(pair)))
    join.start(joined)
    align, aligned = rs.align(rs.stream.color), []
    for number in range(count):
        pair[:] = [depths[number], colors[number]]
        join.invoke(pair[0])
        both = align.process(joined.wait_for_frame(1000).as_frameset())
        frames = (both.get_color_frame(), both.get_depth_frame())
        aligned.append(tuple(np.asanyarray(frame.get_data()).copy() for frame in frames))
    return aligned


def _played(device: Any) -> list[Any]:
    device.set_real_time(False)
    queue, sensors = rs.frame_queue(200, keep_frames=True), device.query_sensors()
    for sensor in sensors:
        sensor.open(sensor.get_stream_profiles())
    for sensor in sensors:
        sensor.start(queue)
    played = []
    while (frame := queue.try_wait_for_frame(500))[0]:
        played.append(frame[1])
    for sensor in sensors:
        sensor.stop()
        sensor.close()
    return played


def _stream(kind, uid: int, size: int, format, intrinsics):
    stream = rs.video_stream()
    stream.type, stream.index, stream.uid, stream.fps, stream.bpp, stream.fmt = kind, 0, uid, 30, size, format
    stream.width, stream.height, stream.intrinsics = intrinsics.width, intrinsics.height, intrinsics
    return stream
