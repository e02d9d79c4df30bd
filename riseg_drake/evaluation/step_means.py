"""The figures of many scenes after each interaction step, as the paper averages them: over scenes."""

from collections.abc import Sequence
from dataclasses import astuple, fields

import numpy as np
from numpy.typing import NDArray

from riseg_drake.evaluation.scores import Scores

TRUE_COUNT = [field.name for field in fields(Scores)].index("objects_true")

EMPTY_PREDICTION = Scores(
    overlap_precision=1.0,
    overlap_recall=0.0,
    overlap_f=0.0,
    boundary_precision=1.0,
    boundary_recall=0.0,
    boundary_f=0.0,
    objects_predicted=0.0,
    objects_found=0.0,
    objects_true=float("nan"),
    found_share=0.0,
)
"""What the protocol gives for a mask without objects, of a scene that was never seen."""


def carried(scores: Sequence[Scores], last_step: int) -> list[Scores]:
    """A scene's scores after each of the steps 0..last_step.

    A scene that ended earlier (nothing left to push, or it failed) keeps its last scores in the steps that
    follow. One that failed before its first step counts as an empty prediction throughout.
    """
    reached = list(scores[: last_step + 1]) or [EMPTY_PREDICTION]
    return reached + [reached[-1]] * (last_step + 1 - len(reached))


def step_means(scenes: Sequence[Sequence[Scores]], last_step: int) -> list[Scores]:
    """For each of the steps 0..last_step the unweighted mean of every figure over the scenes (at least one).

    Every scene counts in every step, see `carried`; only in the count of true objects the scenes are
    left out that were never seen.
    """
    table = _table(scenes, last_step)
    means = table.mean(axis=0)
    seen = ~np.isnan(table[..., TRUE_COUNT]).any(axis=1)
    if seen.any():
        means[:, TRUE_COUNT] = table[seen, :, TRUE_COUNT].mean(axis=0)
    return [Scores(*row) for row in means.tolist()]


def step_deviations(scenes: Sequence[Sequence[Scores]], last_step: int) -> list[Scores]:
    """The sample standard deviation over scenes of each of `step_means`; 0 for a single scene."""
    table = _table(scenes, last_step)
    return [Scores(*row) for row in table.std(axis=0, ddof=1 if len(table) > 1 else 0).tolist()]


def _table(scenes: Sequence[Sequence[Scores]], last_step: int) -> NDArray[np.float64]:
    """All figures, [scenes, steps, 10]."""
    if not scenes:
        raise ValueError("no scenes to take the mean of")
    return np.array([[astuple(scores) for scores in carried(scene, last_step)] for scene in scenes])
