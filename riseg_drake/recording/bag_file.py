"""The door to the library that reads bags: messages in the order in which they were recorded."""

import re
import struct
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from riseg_drake.host.files import MOST_SETTINGS, MOST_TEXT, FileError, is_file, read_bytes, read_text
from riseg_drake.recording.layout import RecordingError

EXTRA = "pip install 'riseg-drake[bags]'"
SUFFIXES = (".bag", ".db3", ".mcap")
"""Of files with recorded messages."""
METADATA = "metadata.yaml"
"""In the folder of a bag of ROS 2."""
_FIRST_LINE, _LINE_LENGTH = re.compile(rb"#ROSBAG V\d\.\d\n"), 13
_CUT = 4
"""Bytes that RealSense files have behind the messages of their images."""


class BagFile:
    """An open bag of ROS 1 or ROS 2. Use `opened_bag`."""

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
        if topic.startswith("/device_") and connection.msgtype == "sensor_msgs/msg/Image":
            raw = raw[:-_CUT]
        return self._reader.deserialize(raw, connection.msgtype)

    def header_time(self, raw: bytes, recorded: int) -> int:
        """The stamp of a message that begins with a header, ns; where that is 0, when it was recorded."""
        if self._reader.is2:
            seconds, nanoseconds = struct.unpack_from("<iI" if raw[1] & 1 else ">iI", raw, 4)
        else:
            seconds, nanoseconds = struct.unpack_from("<II", raw, 4)
        return seconds * 10**9 + nanoseconds or recorded


@contextmanager
def opened_bag(path: Path) -> Iterator[BagFile]:
    """A bag: a file of ROS 1 or ROS 2, or the folder of one of ROS 2.

    Raises RecordingError for one that cannot be read, also while it is read, and where the library is missing.
    """
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise RecordingError(f"{path} is a bag, which needs rosbags: {EXTRA}") from None
    _check_files(path)
    try:
        # Bags of ROS 2 may not say what their messages are made of; the common ones are the same since Humble.
        with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
            yield BagFile(path, reader)
    except RecordingError:
        raise
    except MemoryError:  # damaged sizes are asked for as they stand
        raise RecordingError(f"{path} cannot be read: a part of it is larger than memory, or says so") from None
    except Exception as error:  # the library lets through whatever a damaged file makes of it
        what = str(error).split("\n")[0] or type(error).__name__
        raise RecordingError(f"{path} is no bag that can be read ({what})") from None


def _check_files(path: Path) -> None:
    """Raise RecordingError for what the library would wait for, or take in whole, whatever it is."""
    try:
        if not path.is_dir():
            # The library reads the first line of a bag of ROS 1, whatever its length.
            if path.suffix == ".bag" and not _FIRST_LINE.match(read_bytes(path, MOST_TEXT, first=_LINE_LENGTH)):
                raise RecordingError(f"{path} is no bag that can be read (it does not begin as one of ROS 1)")
            return
        read_text(path / METADATA, MOST_SETTINGS)
    except FileError as error:
        raise RecordingError(str(error)) from None
    for file in sorted(path.iterdir()):
        if file.suffix in SUFFIXES and not is_file(file):
            raise RecordingError(f"{file} is not a file; a bag's messages are in files")


def bag_in(folder: Path) -> Path | None:
    """The bag that a folder is or holds, if it does: one with metadata.yaml, or with a single file of messages.

    Raises RecordingError where there are several.
    """
    if (folder / METADATA).is_file():
        return folder
    files = sorted(path for path in folder.iterdir() if path.suffix in SUFFIXES and path.is_file())
    if len(files) > 1:
        names = ", ".join(path.name for path in files[:5])
        raise RecordingError(f"{folder} holds several bags without a metadata.yaml ({names}); name one of them")
    return files[0] if files else None
