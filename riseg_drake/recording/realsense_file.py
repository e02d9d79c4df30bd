"""Files that RealSense's own tools record: ROS bags by their form, with ways of their own in what they mean.

Measured on files that librealsense 2.56.5 (.bag) and 2.59.1 (.db3) wrote. Its lens models `Brown Conrady`, and
`Inverse` and `Modified Brown Conrady` project like OpenCV's (0.02 px apart at most with the distortion of a
wide lens), `Kannala Brandt4` like OpenCV's fisheye.
"""

import re
from collections.abc import Iterator
from decimal import Decimal, InvalidOperation
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.se3 import inverse
from riseg_drake.recording.bag_messages import MILLIMETRE, BagMessages, BagTransform, pose_numbers
from riseg_drake.recording.layout import RecordingError, pose_from_numbers, pose_to_numbers

_CUT = 4
"""Bytes behind the messages of images in a .bag."""
_STREAM = re.compile(r"(/device_\d+/sensor_\d+)/([A-Za-z]+)_(\d+)/")
"""A sensor, and a stream of it: Depth_0, Color_0, Infrared_1."""
_PACKED = re.compile(r"(\w+); zstd; (\d+)x(\d+) step=(\d+)")
"""What a .db3 says of an image that PNG does not know, such as YUYV."""
_SAME = 1e-6
"""Rotations and metres below which two streams are one camera: depth that was recorded aligned to colour."""


def is_realsense(topics: list[str]) -> bool:
    """Whether the topics of a bag are those of a RealSense file."""
    return any(_STREAM.match(topic) for topic in topics)


class RealSenseFile(BagMessages):
    """A RealSense .bag or .db3 as a bag of ROS would be: frames, stamps, CameraInfo and static transforms.

    Raises RecordingError for a lens that OpenCV has no model of.
    """

    def __init__(self, path: Path, reader: Any):
        super().__init__(path, reader)
        self._stamps = self._absolute_stamps()
        self._poses: dict[str, NDArray] = {
            t.child: pose_from_numbers(np.array(t.pose)) for t in self.transforms()
        }
        self._units = {sensor: self._unit(sensor) for sensor in self._sensors()}
        self._models = {
            topic.rsplit("/", 1)[0]: self.first(topic).data
            for topic, kind in self.types.items()
            if kind == "String" and topic.endswith("/camera_info")
        }

    def message(self, topic: str, raw: bytes) -> Any:
        """A message as ROS would have it."""
        stream = _STREAM.match(topic)
        image = stream is not None and self.types.get(topic) in ("Image", "CompressedImage")
        if image and self.types[topic] == "Image" and not self._reader.is2:
            raw = raw[:-_CUT]
        message = super().message(topic, raw)
        if stream is None:
            return message
        if image:
            message = _unpacked(message)
            message.header.frame_id = self._frame(stream[2])
        elif self.types.get(topic) == "CameraInfo":
            self._check_lens(topic, message)
            message.header.frame_id = self._frame(stream[2])
        return message

    def stamp(self, topic: str, raw: bytes, recorded: int) -> int:
        """When an image was taken, ns; a .db3 counts from its start, and has the time in its metadata."""
        return self._stamps.get((_stream_of(topic), recorded)) or super().stamp(topic, raw, recorded)

    def transforms(self) -> Iterator[BagTransform]:
        """The cameras of the streams in that of a stream that all refer to."""
        yield from super().transforms()
        for topic, kind in self.types.items():
            stream = _STREAM.match(topic)
            if kind == "Transform" and stream is not None:
                # A .bag has what carries points of the reference into the stream's camera.
                message = self.first(topic)
                X_SR = pose_from_numbers(np.array(pose_numbers(message.translation, message.rotation)))
                pose = list(pose_to_numbers(inverse(X_SR)))
                yield BagTransform(f"ref_{topic.rsplit('/', 1)[1]}", stream[2], 0.0, pose, True)

    def depth_unit(self, topic: str) -> np.float32:
        """What 1 stands for in a depth image, m: 0.001 on most cameras, 0.0001 on a D405."""
        stream = _STREAM.match(topic)
        return MILLIMETRE if stream is None else self._units.get(stream[1], MILLIMETRE)

    def _sensors(self) -> set[str]:
        return {stream[1] for topic in self.types if (stream := _STREAM.match(topic))}

    def _unit(self, sensor: str) -> np.float32:
        topic = f"{sensor}/option/Depth_Units/value"
        unit = np.float32(self.first(topic).data) if topic in self.types else MILLIMETRE
        return unit if unit > 0 else MILLIMETRE

    def _frame(self, stream: str) -> str:
        """The frame of a stream's images: that of an earlier stream with the same pose, or its own."""
        X = self._poses.get(stream)
        same = [s for s, other in self._poses.items() if X is not None and np.abs(other - X).max() < _SAME]
        return same[0] if same else stream

    def _check_lens(self, topic: str, message: Any) -> None:
        said = self._models.get(_stream_of(topic).rstrip("/"), str(message.distortion_model))
        if "ftheta" in said.lower() and any(getattr(message, "d", getattr(message, "D", ()))):
            raise RecordingError(
                f"{self.path}: {_stream_of(topic)} has a lens of the model Ftheta, which OpenCV does not know; "
                "Brown Conrady and Kannala Brandt4 are read"
            )

    def _absolute_stamps(self) -> dict[tuple[str, int], int]:
        """By stream, and by when an image was recorded: the time, ns, that metadata of a .db3 have."""
        topics = [t for t, kind in self.types.items() if t.endswith("/image/metadata") and kind == "String"]
        stamps = {}
        for topic, recorded, raw in self.messages(topics):
            found = re.search(r"(?:^|;)timestamp=([^;]+)", str(self.message(topic, raw).data))
            try:
                milliseconds = Decimal(found[1]) if found else Decimal(0)
            except InvalidOperation:
                continue
            if milliseconds.is_finite() and milliseconds > 0:
                stamps[_stream_of(topic), recorded] = round(milliseconds * 10**6)
        return stamps


def _stream_of(topic: str) -> str:
    stream = _STREAM.match(topic)
    return stream[0] if stream else topic


def _unpacked(message: Any) -> Any:
    """An image of a .db3 that was packed as it is in memory, without that; any other as it is."""
    packed = _PACKED.match(str(getattr(message, "format", "")))
    if packed is None:
        return message
    try:
        from compression import zstd  # of Python 3.14
    except ImportError:
        from backports import zstd  # which rosbags brings
    data = np.frombuffer(zstd.decompress(message.data.tobytes()), np.uint8)
    width, height, step = int(packed[2]), int(packed[3]), int(packed[4])
    fields = {"encoding": packed[1], "width": width, "height": height, "step": step, "is_bigendian": 0}
    return SimpleNamespace(header=message.header, data=data, **fields)
