"""The field's scores of a segmentation: Overlap and Boundary, and how many objects were found.

The protocol is that of Xie et al. (UOIS, CoRL 2019) as Xiang et al. (UCN, CoRL 2020) fixed it, by which
the paper's table and figure are made. Label images are [H, W], integers, 0 = background.
"""

from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass

import numpy as np
from munkres import Munkres
from numpy.typing import NDArray

from riseg_drake.evaluation.boundary import boundary_map, dilate, tolerance

FOUND_ABOVE_F = 0.75
"""An object counts as found if its Overlap F-measure is strictly above this."""

FIGURES = (
    "Objects Precision",
    "Objects Recall",
    "Objects F-measure",
    "Boundary Precision",
    "Boundary Recall",
    "Boundary F-measure",
    "obj_detected",
    "obj_detected_075",
    "obj_gt",
    "obj_detected_075_percentage",
)
"""The ten figures by the names that the field's files use, in the order of the fields of `Scores`."""


@dataclass(frozen=True)
class Scores:
    """The ten figures of one image, or their means over images; P, R, F and the share lie in [0, 1].

    Boundary precision or recall is NaN where there is no boundary (a mask that fills the image).
    """

    overlap_precision: float
    overlap_recall: float
    overlap_f: float
    boundary_precision: float
    boundary_recall: float
    boundary_f: float
    objects_predicted: float
    objects_found: float
    """Assigned pairs with Overlap F above 0.75."""
    objects_true: float
    found_share: float
    """Objects found over true objects."""

    def as_dict(self) -> dict[str, float]:
        """The ten figures by their names in the field, see `FIGURES`."""
        return dict(zip(FIGURES, astuple(self), strict=True))

    @classmethod
    def from_dict(cls, figures: Mapping[str, float | None]) -> "Scores":
        """The inverse of `as_dict`; None, as JSON spells NaN, is NaN. Raises KeyError."""
        values = (figures[name] for name in FIGURES)
        return cls(*(float("nan") if value is None else float(value) for value in values))


def score(prediction: NDArray, ground_truth: NDArray) -> Scores:
    """Compare a predicted with the true label image, both [H, W], integers, 0 = background.

    Raises ValueError if the two differ in shape or are not label images.
    """
    check_labels(prediction, "prediction")
    check_labels(ground_truth, "ground truth")
    if prediction.shape != ground_truth.shape:
        raise ValueError(f"the prediction is {_size(prediction)}, the ground truth {_size(ground_truth)}")

    predicted = _objects(prediction)
    true = _objects(ground_truth)
    if len(predicted) == 0 or len(true) == 0:
        return _scores_of_nothing(len(predicted), len(true))

    predicted_area = np.array([_area(prediction == j) for j in predicted])
    true_area = np.array([_area(ground_truth == i) for i in true])
    tp = _overlaps(prediction, ground_truth, predicted, true)  # [true, predicted]
    f, pairs = _assigned(tp, predicted_area, true_area)
    overlap = sum(int(tp[i, j]) for i, j in pairs)
    found = sum(f[i, j] > FOUND_ABOVE_F for i, j in pairs)
    overlap_p = overlap / predicted_area.sum()
    overlap_r = overlap / true_area.sum()
    boundary_p, boundary_r = _boundary_scores(prediction, ground_truth, predicted, true, pairs)
    return Scores(
        overlap_p,
        overlap_r,
        _harmonic_mean(overlap_p, overlap_r),
        boundary_p,
        boundary_r,
        _harmonic_mean(boundary_p, boundary_r),
        objects_predicted=float(len(predicted)),
        objects_found=float(found),
        objects_true=float(len(true)),
        found_share=found / len(true),
    )


def overlap_f_by_object(prediction: NDArray, ground_truth: NDArray) -> dict[int, float]:
    """Overlap F of every object of the ground truth with the predicted one that is assigned to it, else 0.

    Both are label images [H, W]; the assignment is that of `score`.
    """
    by_object = dict.fromkeys(_objects(ground_truth).tolist(), 0.0)
    return by_object | {i: f for i, _, f in _matched(prediction, ground_truth)}


def mean_scores(scores: Sequence[Scores]) -> Scores:
    """The figures of a data set: the unweighted mean of each over its images. Raises ValueError for none."""
    if not scores:
        raise ValueError("no images to take the mean of")
    return Scores(*np.mean([astuple(image) for image in scores], axis=0).tolist())


def numbered_alike(ground_truth: NDArray, prediction: NDArray) -> NDArray:
    """The true label image [H, W] with the numbers of the predicted objects [H, W] that its objects are matched
    with, as for Overlap F; objects that are matched with none have numbers of their own."""
    number = {int(a): int(prediction.max()) + k for k, a in enumerate(_objects(ground_truth), start=1)}
    number |= {i: j for i, j, f in _matched(prediction, ground_truth) if f > 0}
    alike = np.zeros_like(ground_truth)
    for a, b in number.items():
        alike[ground_truth == a] = b
    return alike


def check_labels(labels: NDArray, name: str) -> None:
    """Raise ValueError unless `labels` is a label image: [H, W], integers from 0 up."""
    if labels.ndim != 2 or labels.size == 0:
        raise ValueError(f"the {name} is not a label image: its shape is {labels.shape}, not [height, width]")
    if not np.issubdtype(labels.dtype, np.integer) or labels.min() < 0:
        raise ValueError(f"the {name} is not a label image: labels are integers from 0 up")


def _scores_of_nothing(predicted: int, true: int) -> Scores:
    """The figures where at least one of the images has no object: nothing claimed is nothing wrong."""
    precision = float(predicted == 0)
    recall = float(true == 0)
    both = precision * recall
    prf = (precision, recall, both)
    return Scores(*prf, *prf, float(predicted), 0.0, float(true), found_share=both)


def _objects(labels: NDArray) -> NDArray:
    values = np.unique(labels)
    return values[values != 0]


def _overlaps(prediction: NDArray, ground_truth: NDArray, predicted: NDArray, true: NDArray) -> NDArray:
    """How many pixels every true object shares with every predicted one, [true, predicted]."""
    both = (prediction > 0) & (ground_truth > 0)
    i = np.searchsorted(true, ground_truth[both])
    j = np.searchsorted(predicted, prediction[both])
    cells = np.bincount(i * len(predicted) + j, minlength=len(true) * len(predicted))
    return cells.reshape(len(true), len(predicted))


def _matched(prediction: NDArray, ground_truth: NDArray) -> list[tuple[int, int, float]]:
    """The true and the predicted object of each pair that is assigned, and the pair's Overlap F."""
    predicted, true = _objects(prediction), _objects(ground_truth)
    if len(predicted) == 0 or len(true) == 0:
        return []
    predicted_area = np.array([_area(prediction == j) for j in predicted])
    true_area = np.array([_area(ground_truth == i) for i in true])
    f, pairs = _assigned(_overlaps(prediction, ground_truth, predicted, true), predicted_area, true_area)
    return [(int(true[i]), int(predicted[j]), float(f[i, j])) for i, j in pairs]


def _assigned(
    tp: NDArray, predicted_area: NDArray, true_area: NDArray
) -> tuple[NDArray[np.float64], list[tuple[int, int]]]:
    """Overlap F of all pairs [true, predicted], and the pairs whose sum of F is greatest."""
    p = tp / predicted_area[None, :]
    r = tp / true_area[:, None]
    with np.errstate(invalid="ignore"):
        f = np.where(p + r > 0, 2 * p * r / (p + r), 0.0)
    # Which of several equally good assignments is taken decides the Boundary figures: all of the field
    # uses the classic Munkres procedure, so we do, rather than another solver with the same optimum.
    return f, Munkres().compute((f.max() - f).tolist())


def _boundary_scores(
    prediction: NDArray,
    ground_truth: NDArray,
    predicted: NDArray,
    true: NDArray,
    pairs: Sequence[tuple[int, int]],
) -> tuple[float, float]:
    """Boundary precision and recall: agreement over assigned pairs, against all boundaries there are."""
    radius = tolerance(prediction.shape)
    around = _around_objects(prediction, ground_truth)
    prediction, ground_truth = prediction[around], ground_truth[around]
    b_predicted = [boundary_map(prediction == j) for j in predicted]
    b_true = [boundary_map(ground_truth == i) for i in true]
    tp_p = sum(_area(b_predicted[j] & dilate(b_true[i], radius)) for i, j in pairs)
    tp_r = sum(_area(b_true[i] & dilate(b_predicted[j], radius)) for i, j in pairs)
    return (
        _ratio(tp_p, sum(_area(b) for b in b_predicted)),
        _ratio(tp_r, sum(_area(b) for b in b_true)),
    )


def _around_objects(prediction: NDArray, ground_truth: NDArray) -> tuple[slice, slice]:
    """The window that holds every object and its boundary, which lies up to 1 px outside."""
    height, width = prediction.shape
    v, u = np.nonzero((prediction > 0) | (ground_truth > 0))
    return (
        slice(max(v.min() - 1, 0), min(v.max() + 2, height)),
        slice(max(u.min() - 1, 0), min(u.max() + 2, width)),
    )


def _area(mask: NDArray[np.bool_]) -> int:
    return int(np.count_nonzero(mask))


def _ratio(part: int, whole: int) -> float:
    return part / whole if whole else float("nan")


def _harmonic_mean(p: float, r: float) -> float:
    """2 p r / (p + r), and 0 where that is no number."""
    return 2 * p * r / (p + r) if p + r > 0 else 0.0


def _size(image: NDArray) -> str:
    return f"{image.shape[1]}x{image.shape[0]}"
