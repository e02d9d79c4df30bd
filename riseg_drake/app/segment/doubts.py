"""A recording is looked at before it is worked on: plausibility at the door of `riseg segment`."""

from pathlib import Path

from riseg_drake.app.segment.recorded_view import FIXED, RecordedView
from riseg_drake.geometry.rgbd import Frame
from riseg_drake.plausibility.check import doubts, looked_at
from riseg_drake.plausibility.limits import PlausibilityLimits
from riseg_drake.plausibility.lists import doubts_about_names, doubts_about_rate
from riseg_drake.recording import layout
from riseg_drake.recording.bag_reader import BagReader
from riseg_drake.recording.reader import RecordingReader
from riseg_drake.recording.source import RecordedSource

_USED = {layout.COLOR_FOLDER, layout.DEPTH_FOLDER, layout.ROBOT_FOLDER, layout.LABEL_FOLDER}
_IMAGES = {".png", ".jpg", ".jpeg", ".tif", ".tiff", ".npy", ".bmp"}
_MOST = 1000
"""Files of a folder that are looked at, to find an image among them."""


def recording_doubts(reader: RecordedSource, view: RecordedView) -> list[str]:
    """What of a recording cannot be, or can hardly be, a line each."""
    limits = PlausibilityLimits()
    count = len(reader)
    # The frames of a bag come one after the other: those that are looked at are read in one pass.
    kept = reader.frames_at(looked_at(count)) if isinstance(reader, BagReader) else {}

    def read(number: int) -> Frame | None:
        recorded = reader.frame(number) if isinstance(reader, RecordingReader) else kept.get(number)
        return None if recorded is None else view.frame(recorded)

    poses = None if view.camera_poses == FIXED else view.camera_poses
    rate = doubts_about_rate(reader.rate, count, limits)
    if not isinstance(reader, RecordingReader):
        return [*rate, *doubts(read, count, reader.depth_scale, poses, limits)]

    beside = {
        folder: reader.images_beside(folder)
        for folder in (layout.ROBOT_FOLDER, layout.LABEL_FOLDER)
        if reader.holds_images(folder)
    }
    names = doubts_about_names(count, beside, _unused(reader), Path(reader.names[0][0]).name)
    return [
        *rate,
        *names,
        *doubts(read, count, reader.depth_scale, poses, limits),
    ]


def frames_with(reader: RecordedSource) -> dict[str, int]:
    """How many frames have depth, and a pose, joint angles, a robot mask and a label, where there are such."""
    count = len(reader)
    having = {"depth": count}
    having |= {name: count for name, kept in (("pose", reader.camera_poses), ("joints", reader.joints)) if kept}
    if not isinstance(reader, RecordingReader):
        return having
    having |= {
        name: reader.images_beside(folder)
        for name, folder in (("robot mask", layout.ROBOT_FOLDER), ("label", layout.LABEL_FOLDER))
        if reader.holds_images(folder)
    }
    return having


def _unused(reader: RecordingReader) -> dict[str, str]:
    """Folders with images that nobody asks for, and one of these each."""
    unused = {}
    used = _USED | {Path(name).parts[0] for names in reader.names for name in names}
    for folder in sorted(path for path in reader.folder.iterdir() if path.is_dir()):
        if folder.name in used or folder.is_symlink():
            continue
        files = (file for _, file in zip(range(_MOST), folder.iterdir(), strict=False))
        image = next((file.name for file in files if file.suffix.lower() in _IMAGES), None)
        if image is not None:
            unused[folder.name] = image
    return unused
