"""The door to the library that reads bags."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from riseg_drake.host.files import MOST_SETTINGS, MOST_TEXT, FileError, is_file, read_bytes, read_text
from riseg_drake.recording.bag_messages import BagMessages
from riseg_drake.recording.layout import RecordingError
from riseg_drake.recording.realsense_file import RealSenseFile, is_realsense

EXTRA = "pip install 'riseg-drake[bags]'"
SUFFIXES = (".bag", ".db3", ".mcap")
"""Of files with recorded messages."""
METADATA = "metadata.yaml"
"""In the folder of a bag of ROS 2."""
_FIRST_LINE, _LINE_LENGTH = re.compile(rb"#ROSBAG V\d\.\d\n"), 13


@contextmanager
def opened_bag(path: Path) -> Iterator[BagMessages]:
    """A bag: a file of ROS 1, of ROS 2 or of a RealSense camera, or the folder of one of ROS 2.

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
            topics = [connection.topic for connection in reader.connections]
            yield (RealSenseFile if is_realsense(topics) else BagMessages)(path, reader)
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
