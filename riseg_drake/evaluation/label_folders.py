"""Two folders of label images with equal names, scored image by image."""

import os
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from riseg_drake.evaluation.scores import Scores, score
from riseg_drake.host.images import DamagedImageError, read_image

_MOST = 0.5
"""Share of an image that no object fills."""
_RIM, _WIDTH = 255, 15
"""The value of rims that do not count in VOC and DAVIS, and pixels that these are less wide than."""


class LabelFolderError(ValueError):
    """What is wrong with a folder of label images, in one line for the person who gave it."""


@dataclass(frozen=True)
class LabelConventions:
    """What values mean in label images that other tools wrote; 0 is background everywhere."""

    ignore: int | None = None
    """Pixels with this true value count neither way, as the rims of VOC and DAVIS have it (255)."""
    background: int | None = None
    """A true value that is background, too: the table of UOIS and OCID is 1."""
    predicted_background: int | None = None
    """The same of the prediction."""

    def apply(self, prediction: NDArray, ground_truth: NDArray) -> tuple[NDArray, NDArray]:
        """Both images [H, W] with 0 for all that is no object or does not count."""
        ignored = ground_truth == (-1 if self.ignore is None else self.ignore)
        none = -1 if self.background is None else self.background
        predicted_none = -1 if self.predicted_background is None else self.predicted_background
        return (
            np.where(ignored | (prediction == predicted_none), 0, prediction).astype(prediction.dtype),
            np.where(ignored | (ground_truth == none), 0, ground_truth).astype(ground_truth.dtype),
        )


class LabelHabits:
    """Notices values of label images that can hardly be object ids."""

    def __init__(self) -> None:
        self._images = 0
        self._around: Counter[tuple[str, int]] = Counter()
        self._rims = 0

    def look(self, prediction: NDArray, ground_truth: NDArray) -> None:
        """Take note of one pair of images [H, W], after conventions were applied."""
        self._images += 1
        for side, labels in (("predicted", prediction), ("true", ground_truth)):
            values, counts = np.unique(labels, return_counts=True)
            if values[counts.argmax()] and counts.max() > _MOST * labels.size:
                self._around[side, int(values[counts.argmax()])] += 1
        rim = ground_truth == _RIM
        self._rims += bool(rim.any()) and not cv2.erode(rim.astype(np.uint8), np.ones((_WIDTH, _WIDTH))).any()

    def doubts(self) -> list[str]:
        """A line for each habit that all images have, with the option that it asks for."""
        options = {"predicted": "--predicted-background", "true": "--background"}
        lines = [
            f"{value} fills most of every {side} image; if it is the table, give {options[side]} {value}"
            for (side, value), number in sorted(self._around.items())
            if number == self._images
        ]
        if self._images and self._rims == self._images:
            lines.append(f"{_RIM} is a rim in every true image; if it is to be ignored, give --ignore {_RIM}")
        return lines


def score_folders(
    predicted: Path,
    true: Path,
    conventions: LabelConventions | None = None,
    habits: LabelHabits | None = None,
) -> Iterator[tuple[str, Scores]]:
    """Score every label PNG of one folder against the one of equal name in the other, in order of name.

    Names may differ by an ending that all of one folder have, as 000_mask.png and 000.png do.

    Raises LabelFolderError if a folder is missing or empty, names or sizes are unequal, or a file is no
    label image; about names it does so before the first image is read.
    """
    names, true_names = _label_names(predicted), _label_names(true)
    partners = _by_ending(names, true_names) or _by_ending(true_names, names, swap=True)
    if partners is None:
        _check_equal_names(names, predicted, true_names, true)
        partners = {name: name for name in names}
    conventions = conventions or LabelConventions()
    for name, true_name in partners.items():
        prediction = read_labels(predicted / name)
        ground_truth = read_labels(true / true_name)
        if prediction.shape != ground_truth.shape:
            raise LabelFolderError(
                f"{name}: {_size(prediction)} pixels in {predicted}, but {_size(ground_truth)} in {true}"
            )
        pair = conventions.apply(prediction, ground_truth)
        if habits is not None:
            habits.look(*pair)
        yield name, score(*pair)


def read_labels(path: Path) -> NDArray[np.uint16]:
    """A label image [H, W] from a PNG of one channel or with a palette, whose values are object ids.

    Raises LabelFolderError for anything else.
    """
    try:
        image = read_image(path, indices=True)
    except DamagedImageError as error:
        raise LabelFolderError(str(error)) from None
    if image.ndim != 2 or image.dtype not in (np.uint8, np.uint16):
        raise LabelFolderError(
            f"{path} is a colour image; a label image has one channel of 8 or 16 bits, or a palette"
        )
    return image.astype(np.uint16)


def _label_names(folder: Path) -> list[str]:
    if not os.path.isdir(folder):
        raise LabelFolderError(f"{folder} is not a folder; give two folders of label PNGs with equal names")
    names = sorted(path.name for path in folder.iterdir() if path.suffix.lower() == ".png")
    if not names:
        raise LabelFolderError(f"{folder} holds no PNG image")
    return names


def _by_ending(longer: list[str], shorter: list[str], *, swap: bool = False) -> dict[str, str] | None:
    """Which name belongs to which, where all names of one list have the same ending more; from `longer` to
    `shorter`, or the other way about. None where it is not so."""
    stems, others = ([Path(name).stem for name in names] for names in (longer, shorter))
    for other in others:
        ending = stems[0].removeprefix(other)
        if ending and stems[0].startswith(other) and {stem + ending for stem in others} == set(stems):
            by_stem = {Path(name).stem: name for name in longer}
            pairs = [(by_stem[Path(name).stem + ending], name) for name in shorter]
            return dict((b, a) if swap else (a, b) for a, b in pairs)
    return None


def _check_equal_names(predicted: list[str], folder: Path, true: list[str], true_folder: Path) -> None:
    for names, others, other_folder in ((true, predicted, folder), (predicted, true, true_folder)):
        missing = sorted(set(names) - set(others))
        if missing:
            more = f" and {len(missing) - 1} more" if len(missing) > 1 else ""
            raise LabelFolderError(f"{other_folder} lacks {missing[0]}{more}; the names must be equal")


def _size(image: NDArray) -> str:
    return f"{image.shape[1]}x{image.shape[0]}"
