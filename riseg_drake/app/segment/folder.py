"""The folder that `riseg segment` leaves behind.

    summary.json            how it went, what was left out, and the scores where there are true labels
    mask/                   L_t of every frame, 16 bit PNG, named as the colour image it belongs to
    untouched.png           of the last frame what has not moved yet, as clusters of depth: guessed, and no ids
    overlay.mp4             every frame with its objects tinted and numbered, the time and a bar of it
    overlay/                the same, without the time, as PNG, where that was asked for
    report.html             what was run, what was seen before and after each change, scores, doubts and times
    scores.csv              the ten figures of every frame with a true label
    export/, rerun.rrd      the same in the formats of other tools, where that was asked for

Whenever it is stopped, the masks that are there are whole, and the summary says how many they are.
"""

import errno
import os
import re
import struct
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from riseg_drake.app.exports import EXPORT
from riseg_drake.app.output_folder import OutputError, OutputFolder
from riseg_drake.app.report_page import REPORT
from riseg_drake.app.timelines import FILE
from riseg_drake.evaluation.scores import Scores
from riseg_drake.host.processes import undisturbed
from riseg_drake.pictures.masks import draw_masks
from riseg_drake.pictures.video import VideoWriter, with_time
from riseg_drake.recording.whole_file import GrowingText, write_png, write_text

MASKS = "mask"
OVERLAY = "overlay"
UNTOUCHED = "untouched.png"
VIDEO = "overlay.mp4"
SCORES = "scores.csv"
COMMAND = "segment"
LONGEST_NAME = 50
"""Characters of a mask's name: as many bytes as any file system takes, whatever they are."""
_UNFINISHED_VIDEO = ".overlay.unfinished.mp4"
PARTS = "|".join(
    map(re.escape, (MASKS, OVERLAY, UNTOUCHED, VIDEO, SCORES, REPORT, EXPORT, FILE, _UNFINISHED_VIDEO))
)
"""What a segmentation puts into its folder, beside the summary."""


class SegmentFolder:
    """Writes masks, video and scores as they come, into a folder of its own; see OutputFolder.

    The video has `rate` frames a second; with `overlay` its pictures are files, too. Use it in a `with` block.
    Raises OutputError if the folder holds anything else, where it cannot be written, or the disk is full.
    """

    def __init__(
        self,
        folder: Path,
        rate: float,
        about: Mapping[str, Any],
        *,
        overlay: bool = False,
        overwrite: bool = False,
    ):
        self.path = folder
        self._rate, self._overlay = rate, overlay
        self._video: VideoWriter | None = None
        self._scores: GrowingText | None = None
        self._names: set[str] = set()
        self._folder = OutputFolder(folder, COMMAND, PARTS, {**about, "state": "running"}, overwrite=overwrite)
        with self._folder.writing():
            (folder / MASKS).mkdir(exist_ok=True)
            if overlay:
                (folder / OVERLAY).mkdir(exist_ok=True)

    def write(
        self,
        name: str,
        color: NDArray[np.uint8],
        mask: NDArray[np.uint16],
        confidence: Mapping[int, float],
        scores: Scores | None,
        time: float,
        share: float,
    ) -> None:
        """Write what belongs to one frame, colour [H, W, 3] and mask [H, W]; `name` is its colour image's.

        The video shows the confidence of each id, too, the time of the frame since the first one, s, and which
        share of the recording has passed with it.

        Raises OutputError where the disk is full or the folder has gone.
        """
        file = self._file_name(name)
        with self._folder.writing():
            write_png(self.path / MASKS / file, mask.astype(np.uint16))
            if scores is not None:
                self._write_scores(file, scores)
            picture = draw_masks(color, mask, confidence=confidence)
            if self._overlay:
                write_png(self.path / OVERLAY / file, picture)
            self._show(with_time(picture, time, share))

    def write_untouched(self, clusters: NDArray[np.uint16]) -> None:
        """Write what the last frame shows that has not moved yet, [H, W]."""
        with self._folder.writing():
            write_png(self.path / UNTOUCHED, clusters)

    @property
    def summary(self) -> Mapping[str, Any]:
        """What is entered so far."""
        return self._folder.summary

    def write_report(self, page: str) -> None:
        """Write the report, as HTML."""
        with self._folder.writing(), undisturbed():
            write_text(self.path / REPORT, page)

    def note(self, **entries: Any) -> None:
        """Enter something in the summary."""
        self._folder.note(**entries)

    def finish(self) -> None:
        """Finish the video and the table of scores, once all frames are written.

        Raises OutputError where the video could not be written whole.
        """
        with undisturbed(), self._folder.writing():
            if self._scores is not None:
                self._scores.close()
                self._scores = None
            whole = self._finish_video()
        if not whole:
            why = f"it could not be written whole: {os.strerror(errno.ENOSPC)}?"
            raise OutputError(f"cannot write to {self.path / VIDEO}: {why}")

    def close(self) -> None:
        """Finish what can be, and let others write there."""
        try:
            with suppress(OutputError):  # what ended it has been said
                self.finish()
        finally:
            self._folder.close()

    def __enter__(self) -> "SegmentFolder":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _finish_video(self) -> bool:
        """Close the video; where not all of it could be written, there is none, and the answer is no."""
        if self._video is None:
            return True
        video, self._video = self._video, None
        with suppress(OSError):  # what is left of it is looked at
            video.close()
        unfinished = self.path / _UNFINISHED_VIDEO
        if not _is_whole_video(unfinished):
            unfinished.unlink(missing_ok=True)
            return False
        unfinished.replace(self.path / VIDEO)
        return True

    def _file_name(self, color_name: str) -> str:
        """The colour image's name; with a number behind it where an image is listed more than once."""
        stem = Path(color_name).name.removesuffix(Path(color_name).suffix)[:LONGEST_NAME]
        file, repeats = f"{stem}.png", 1
        while file in self._names:
            repeats += 1
            file = f"{stem}_{repeats}.png"
        self._names.add(file)
        return file

    def _write_scores(self, file: str, scores: Scores) -> None:
        figures = scores.as_dict()
        if self._scores is None:
            self._scores = GrowingText(self.path / SCORES)
            self._scores.append(",".join(["mask", *figures]))
        self._scores.append(",".join([file, *(repr(float(value)) for value in figures.values())]))

    def _show(self, picture: NDArray[np.uint8]) -> None:
        height, width = picture.shape[:2]
        if self._video is None:
            rate = min(max(self._rate, 1.0), 120.0)
            self._video = VideoWriter(self.path / _UNFINISHED_VIDEO, rate, (height, width))
        self._video.append(picture)


def _is_whole_video(path: Path) -> bool:
    """Whether an MP4 file is there with all its boxes, the index (moov) among them."""
    if not path.exists():
        return False
    found, start, size = set(), 0, path.stat().st_size
    with path.open("rb") as file:
        while start < size:
            file.seek(start)
            length, kind = struct.unpack(">I4s", file.read(8).ljust(8, b"\0"))
            if length == 1:  # the length follows in 64 bits
                (length,) = struct.unpack(">Q", file.read(8).ljust(8, b"\0"))
            if length < 8:
                return False
            found.add(kind)
            start += length
    return start == size and b"moov" in found
