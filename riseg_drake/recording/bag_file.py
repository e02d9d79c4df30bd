"""The door to the library that reads bags."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from riseg_drake.recording.bag_messages import BagMessages
from riseg_drake.recording.layout import RecordingError
from riseg_drake.recording.realsense_file import RealSenseFile, is_realsense

EXTRA = "pip install 'riseg-drake[bags]'"
SUFFIXES = (".bag", ".db3", ".mcap")
"""Of files with recorded messages."""


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
    try:
        # Bags of ROS 2 may not say what their messages are made of; the common ones are the same since Humble.
        with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
            topics = [connection.topic for connection in reader.connections]
            yield (RealSenseFile if is_realsense(topics) else BagMessages)(path, reader)
    except (RecordingError, MemoryError):
        raise
    except Exception as error:  # the library lets through whatever a damaged file makes of it
        what = str(error).split("\n")[0] or type(error).__name__
        raise RecordingError(f"{path} is no bag that can be read ({what})") from None


def bag_in(folder: Path) -> Path | None:
    """The bag that a folder is or holds, if it does: one with metadata.yaml, or with a single file of messages.

    Raises RecordingError where there are several.
    """
    if (folder / "metadata.yaml").is_file():
        return folder
    files = sorted(path for path in folder.iterdir() if path.suffix in SUFFIXES and path.is_file())
    if len(files) > 1:
        names = ", ".join(path.name for path in files[:5])
        raise RecordingError(f"{folder} holds several bags without a metadata.yaml ({names}); name one of them")
    return files[0] if files else None
