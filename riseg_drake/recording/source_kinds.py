"""What kind of recording a path is: the one place that decides."""

import os
from pathlib import Path

from riseg_drake.recording import layout
from riseg_drake.recording.bag_file import SUFFIXES, bag_in
from riseg_drake.recording.bag_reader import BagReader
from riseg_drake.recording.layout import RecordingError
from riseg_drake.recording.reader import RecordingReader
from riseg_drake.recording.source import RecordedSource, SourceOptions


def opened_source(path: Path, options: SourceOptions) -> RecordedSource:
    """A bag or a folder of images, ready to be read. Raises RecordingError for what is neither."""
    if os.path.isfile(path):
        if path.suffix not in SUFFIXES:
            raise RecordingError(
                f"{path} is not a folder with {layout.COLOR_LIST}, and no bag ({', '.join(SUFFIXES)})"
            )
        return BagReader(path, options)
    if os.path.isdir(path) and not os.path.lexists(path / layout.COLOR_LIST):
        bag = bag_in(path)
        if bag is not None:
            return BagReader(bag, options)
    return RecordingReader(path, options=options)
