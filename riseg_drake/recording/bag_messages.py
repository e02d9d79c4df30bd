"""The messages of a bag, with their fields, stamps and transforms, whatever wrote it."""

import struct
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

MILLIMETRE = np.float32(1 / 1000.0)
"""m, as the reader of folders has it."""


@dataclass(frozen=True)
class BagTransform:
    """Where one frame is in another."""

    parent: str
    child: str
    time: float
    """s"""
    pose: list[float]
    """The child's pose in the parent, [tx, ty, tz, qx, qy, qz, qw]."""
    static: bool


class BagMessages:
    """An open bag of ROS 1 or ROS 2, messages in the order in which they were recorded. Use `opened_bag`."""

    def __init__(self, path: Path, reader: Any):
        self.path = path
        self._reader = reader
        self.types = {c.topic: str(c.msgtype).rsplit("/", 1)[-1] for c in reader.connections if c.msgcount}
        """The short name of the messages' type, by topic."""

    def messages(self, topics: Iterable[str]) -> Iterator[tuple[str, int, bytes]]:
        """(topic, ns at which it was recorded, message as bytes), in rising time."""
        wanted = set(topics)
        connections = [c for c in self._reader.connections if c.topic in wanted]
        if connections:
            for connection, time, raw in self._reader.messages(connections):
                yield connection.topic, time, raw

    def first(self, topic: str) -> Any:
        """The first message of a topic that has some."""
        messages = self.messages([topic])
        _, _, raw = next(messages)
        messages.close()  # type: ignore[attr-defined]
        return self.message(topic, raw)

    def message(self, topic: str, raw: bytes) -> Any:
        """A message with its fields."""
        connection = next(c for c in self._reader.connections if c.topic == topic)
        return self._reader.deserialize(raw, connection.msgtype)

    def stamp(self, topic: str, raw: bytes, recorded: int) -> int:
        """The time of a message that begins with a header, ns; where that is 0, when it was recorded."""
        if self._reader.is2:
            seconds, nanoseconds = struct.unpack_from("<iI" if raw[1] & 1 else ">iI", raw, 4)
        else:
            seconds, nanoseconds = struct.unpack_from("<II", raw, 4)
        return seconds * 10**9 + nanoseconds or recorded

    def transforms(self) -> Iterator[BagTransform]:
        """All that are recorded."""
        topics = [topic for topic, kind in self.types.items() if kind in ("TFMessage", "tfMessage")]
        for topic, _, raw in self.messages(topics):
            for each in self.message(topic, raw).transforms:
                yield BagTransform(
                    str(each.header.frame_id).lstrip("/"),
                    str(each.child_frame_id).lstrip("/"),
                    each.header.stamp.sec + each.header.stamp.nanosec / 10**9,
                    pose_numbers(each.transform.translation, each.transform.rotation),
                    topic.endswith("tf_static"),
                )

    def depth_unit(self, topic: str) -> np.float32:
        """What 1 stands for in a depth image of whole numbers, m (REP 118)."""
        return MILLIMETRE


def pose_numbers(p: Any, q: Any) -> list[float]:
    """[tx, ty, tz, qx, qy, qz, qw] of a message's place and quaternion."""
    return [float(v) for v in (p.x, p.y, p.z, q.x, q.y, q.z, q.w)]
