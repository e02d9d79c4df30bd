"""Masks while things move: how well the moved objects are segmented in every frame, not only at rest.

It is the paper's promise that nothing waits for an action to end. What counts is each frame from 1 cm of
motion of an object on, until the camera observes again.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from riseg_drake.evaluation.scores import overlap_f_by_object

MOVED = 0.01
"""An object counts from this much motion on in one interaction, m."""


@dataclass(frozen=True)
class InMotion:
    """The moved objects of one interaction, or of many."""

    frames: int
    """Frames that show a moved object."""
    overlap_f: float
    """Mean over these frames of the mean Overlap F of the moved objects that are in sight."""
    at_rest_f: float
    """The same objects' in the last frame at rest after it."""


def moved_objects(
    before: Mapping[str, NDArray], now: Mapping[str, NDArray], names: Mapping[int, str]
) -> set[int]:
    """The ids of the objects that have moved by 1 cm or more, from their poses X_WBcm [4, 4] by name."""
    return {
        object_id
        for object_id, name in names.items()
        if name in before and np.linalg.norm(now[name][:3, 3] - before[name][:3, 3]) >= MOVED
    }


def overlap_f_of(moved: Iterable[int], mask: NDArray, labels: NDArray) -> float:
    """Mean Overlap F, in [0, 1], of the moved objects in one mask [H, W] with its true labels [H, W]; NaN
    with none in sight.
    """
    f = overlap_f_by_object(mask, labels)
    in_sight = [f[object_id] for object_id in moved if object_id in f]
    return float(np.mean(in_sight)) if in_sight else float("nan")


def in_motion(overlap_f: Sequence[float], at_rest_f: float) -> InMotion | None:
    """One interaction, from the Overlap F of its frames, in [0, 1] (NaN: nothing moved in sight), and that at
    rest; None where no frame counts.
    """
    seen = [f for f in overlap_f if not np.isnan(f)]
    return InMotion(len(seen), float(np.mean(seen)), at_rest_f) if seen else None


class FramesInMotion:
    """The frames in motion of one interaction, scored as they come."""

    def __init__(self) -> None:
        self.moved: dict[float, set[int]] = {}
        """By the time of each frame, s, the true ids of what had moved."""
        self._overlap_f: list[float] = []

    def score(self, time: float, moved: Iterable[int], mask: NDArray, labels: NDArray) -> None:
        """Take in the mask [H, W] of the frame of a `time`, s, with its true labels [H, W]."""
        self.moved[time] = set(moved)
        self._overlap_f.append(overlap_f_of(self.moved[time], mask, labels))

    def closed(self, mask: NDArray, labels: NDArray) -> InMotion | None:
        """Their figures, once the frame at rest that ends the interaction has its mask [H, W] and true labels
        [H, W]; None where none counts."""
        ever = set[int]().union(*self.moved.values())
        return in_motion(self._overlap_f, overlap_f_of(ever, mask, labels))


def in_motion_of_steps(
    scenes: Sequence[Sequence[InMotion | None]], last_step: int
) -> list[tuple[int, InMotion | None]]:
    """Of each of the interactions 1..last_step: in how many scenes something moved, and their mean."""
    return [mean_over_scenes([scene[i : i + 1] for scene in scenes]) for i in range(last_step)]


def mean_over_scenes(scenes: Iterable[Sequence[InMotion | None]]) -> tuple[int, InMotion | None]:
    """In how many scenes something moved, and the unweighted mean of these; None where it did in none."""
    each = [figures for figures in map(pooled, scenes) if figures is not None]
    if not each:
        return 0, None
    rest = [figures.at_rest_f for figures in each if not np.isnan(figures.at_rest_f)]
    mean = InMotion(
        sum(figures.frames for figures in each),
        float(np.mean([figures.overlap_f for figures in each])),
        float(np.mean(rest)) if rest else float("nan"),
    )
    return len(each), mean


def pooled(interactions: Iterable[InMotion | None]) -> InMotion | None:
    """Many interactions as one, each with the weight of its frames; None where no frame counts."""
    counted = [each for each in interactions if each is not None]
    frames = sum(each.frames for each in counted)
    if not frames:
        return None
    with_rest = [each for each in counted if not np.isnan(each.at_rest_f)]
    rest_frames = sum(each.frames for each in with_rest)
    return InMotion(
        frames,
        sum(each.frames * each.overlap_f for each in counted) / frames,
        sum(each.frames * each.at_rest_f for each in with_rest) / rest_frames if rest_frames else float("nan"),
    )
