"""The folder that `riseg segment` leaves behind.

    summary.json            how it went, what was left out, and the scores where there are true labels
    mask/                   L_t of every frame, 16 bit PNG, named as the colour image it belongs to
    overlay.mp4             every frame with its objects tinted and numbered
    scores.csv              the ten figures of every frame with a true label

Whenever it is stopped, the masks that are there are whole, and the summary says how many they are.
"""

import json
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TextIO

import cv2
import numpy as np
from numpy.typing import NDArray

from riseg_drake.app.output import SUMMARY, OutputError, to_json
from riseg_drake.evaluation.scores import Scores
from riseg_drake.pictures.masks import draw_masks
from riseg_drake.recording.whole_file import write_png, write_text

MASKS = "mask"
VIDEO = "overlay.mp4"
SCORES = "scores.csv"
COMMAND = "segment"
_UNFINISHED_VIDEO = ".overlay.unfinished.mp4"  # OpenCV goes by the ending


class SegmentFolder:
    """Writes masks, video and scores as they come. What an earlier segmentation left is removed first.

    The video has `rate` frames a second. Use it in a `with` block. Raises OutputError if the folder holds
    anything else.
    """

    def __init__(self, folder: Path, rate: float, about: Mapping[str, Any]):
        self.path = folder
        self._rate = rate
        self._summary: dict[str, Any] = {"command": COMMAND, **about, "state": "running"}
        self._video: cv2.VideoWriter | None = None
        self._scores: TextIO | None = None
        self._names: set[str] = set()
        try:
            _check_free(folder)
            folder.mkdir(parents=True, exist_ok=True)
            # The summary goes first: what it lists must be there at any moment.
            for name in (SUMMARY, VIDEO, SCORES, _UNFINISHED_VIDEO):
                (folder / name).unlink(missing_ok=True)
            shutil.rmtree(folder / MASKS, ignore_errors=True)
            (folder / MASKS).mkdir()
            self.note()
        except OSError as error:
            raise OutputError(f"cannot write to {folder}: {error.strerror}") from None

    def write(
        self, name: str, color: NDArray[np.uint8], mask: NDArray[np.uint16], scores: Scores | None
    ) -> None:
        """Write what belongs to one frame, colour [H, W, 3] and mask [H, W]; `name` is its colour image's.

        Raises OutputError where the disk is full or the folder has gone.
        """
        file = self._file_name(name)
        try:
            write_png(self.path / MASKS / file, mask.astype(np.uint16))
            if scores is not None:
                self._write_scores(file, scores)
        except OSError as error:
            raise OutputError(f"cannot write to {self.path}: {error.strerror}") from None
        self._show(draw_masks(color, mask))

    def note(self, **entries: Any) -> None:
        """Enter something in the summary."""
        self._summary.update(entries)
        write_text(self.path / SUMMARY, to_json(self._summary))

    def close(self) -> None:
        """Finish the video and the table of scores."""
        if self._video is not None:
            self._video.release()
            self._video = None
            (self.path / _UNFINISHED_VIDEO).replace(self.path / VIDEO)
        if self._scores is not None:
            self._scores.close()
            self._scores = None

    def __enter__(self) -> "SegmentFolder":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _file_name(self, color_name: str) -> str:
        """The colour image's name; with a number behind it where an image is listed more than once."""
        stem = Path(color_name).name.removesuffix(Path(color_name).suffix)
        file, repeats = f"{stem}.png", 1
        while file in self._names:
            repeats += 1
            file = f"{stem}_{repeats}.png"
        self._names.add(file)
        return file

    def _write_scores(self, file: str, scores: Scores) -> None:
        figures = scores.as_dict()
        if self._scores is None:
            self._scores = (self.path / SCORES).open("w", encoding="utf-8")
            self._scores.write(",".join(["mask", *figures]) + "\n")
        self._scores.write(",".join([file, *(repr(float(value)) for value in figures.values())]) + "\n")
        self._scores.flush()

    def _show(self, picture: NDArray[np.uint8]) -> None:
        height, width = picture.shape[:2]
        if self._video is None:
            code = cv2.VideoWriter.fourcc(*"mp4v")
            rate = min(max(self._rate, 1.0), 120.0)
            file = str(self.path / _UNFINISHED_VIDEO)
            # The codec wants even sizes.
            self._video = cv2.VideoWriter(file, code, rate, (width + width % 2, height + height % 2))
        bgr = cv2.cvtColor(picture, cv2.COLOR_RGB2BGR)
        self._video.write(cv2.copyMakeBorder(bgr, 0, height % 2, 0, width % 2, cv2.BORDER_REPLICATE))


def _check_free(folder: Path) -> None:
    """Raise OutputError unless the folder is new, empty, or of an earlier segmentation."""
    if folder.exists() and not folder.is_dir():
        raise OutputError(f"{folder} is a file; give a folder for the output")
    own = {SUMMARY, MASKS, VIDEO, SCORES, _UNFINISHED_VIDEO, f".{SUMMARY}.unfinished"}
    if not folder.exists() or {entry.name for entry in folder.iterdir()} <= own - {SUMMARY}:
        return
    try:
        summary = json.loads((folder / SUMMARY).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        summary = None
    if not isinstance(summary, dict) or summary.get("command") != COMMAND:
        raise OutputError(
            f"{folder} is not empty and holds no earlier segmentation; give a new folder, or an empty one"
        )
