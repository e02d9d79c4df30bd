"""Two folders of label images with equal names, scored image by image."""

import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from riseg_drake.evaluation.scores import Scores, score
from riseg_drake.host.images import DamagedImageError, read_image


class LabelFolderError(ValueError):
    """What is wrong with a folder of label images, in one line for the person who gave it."""


def score_folders(predicted: Path, true: Path) -> Iterator[tuple[str, Scores]]:
    """Score every label PNG of one folder against the one of equal name in the other, in order of name.

    Raises LabelFolderError if a folder is missing or empty, names or sizes are unequal, or a file is no
    label image; about names it does so before the first image is read.
    """
    names = _label_names(predicted)
    _check_equal_names(names, predicted, _label_names(true), true)
    for name in names:
        prediction = read_labels(predicted / name)
        ground_truth = read_labels(true / name)
        if prediction.shape != ground_truth.shape:
            raise LabelFolderError(
                f"{name}: {_size(prediction)} pixels in {predicted}, but {_size(ground_truth)} in {true}"
            )
        yield name, score(prediction, ground_truth)


def read_labels(path: Path) -> NDArray[np.uint16]:
    """A label image [H, W] from a PNG of one channel, 8 or 16 bits, whose values are object ids.

    Raises LabelFolderError for anything else.
    """
    try:
        image = read_image(path)
    except DamagedImageError as error:
        raise LabelFolderError(str(error)) from None
    if image.ndim != 2 or image.dtype not in (np.uint8, np.uint16):
        raise LabelFolderError(f"{path} is a colour image; a label image has one channel of 8 or 16 bits")
    return image.astype(np.uint16)


def _label_names(folder: Path) -> list[str]:
    if not os.path.isdir(folder):
        raise LabelFolderError(f"{folder} is not a folder; give two folders of label PNGs with equal names")
    names = sorted(path.name for path in folder.iterdir() if path.suffix.lower() == ".png")
    if not names:
        raise LabelFolderError(f"{folder} holds no PNG image")
    return names


def _check_equal_names(predicted: list[str], folder: Path, true: list[str], true_folder: Path) -> None:
    for names, others, other_folder in ((true, predicted, folder), (predicted, true, true_folder)):
        missing = sorted(set(names) - set(others))
        if missing:
            more = f" and {len(missing) - 1} more" if len(missing) > 1 else ""
            raise LabelFolderError(f"{other_folder} lacks {missing[0]}{more}; the names must be equal")


def _size(image: NDArray) -> str:
    return f"{image.shape[1]}x{image.shape[0]}"
