"""What the interactions did to the scene: the paper promises to leave it as it was."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.camera import back_project
from riseg_drake.geometry.rgbd import Frame
from riseg_drake.geometry.se3 import move_points

TOPPLED_DEG = 20.0
"""An object has toppled once it leans so much more than at the start, degrees."""
FALLEN = 0.02
"""An object has left the table once its origin is so much below the top (or below where it started), m."""


@dataclass(frozen=True)
class ObjectMotion:
    """What one interaction did to one object."""

    moved_m: float
    """Distance between the object's origin before and after, m."""
    tilted_deg: float
    """Angle by which its upright has turned since before the interaction, degrees."""
    tilted_in_all_deg: float = 0.0
    """The same since before the first interaction, degrees."""
    left_table: bool = False
    """It is lower now than anything on the table can be."""


@dataclass(frozen=True)
class Disturbance:
    """What one interaction did to a scene."""

    pushed: str | None
    """The object that the push went for; None if that is not known."""
    motions: Mapping[str, ObjectMotion] = field(default_factory=dict)
    """By object."""


@dataclass(frozen=True)
class DisturbanceFigures:
    """The same over many scenes; NaN where there is nothing to count."""

    interactions: int
    pushed_mean_m: float
    """How far the pushed objects moved, mean."""
    others_median_m: float
    """How far all other objects moved, median."""
    tilt_max_deg: float
    """The most that any object leans more than at the start."""
    toppled: int
    """Objects that came to lean more than 20 degrees in these interactions."""
    left_table: int
    """Objects that left the table in these interactions."""


def motion_between(
    start: Mapping[str, NDArray], before: Mapping[str, NDArray], after: Mapping[str, NDArray]
) -> dict[str, ObjectMotion]:
    """What happened to every object, by its name, from its poses X_WB [4, 4].

    Args:
        start: before the first interaction.
        before: before this interaction.
        after: after it.
    """
    return {
        name: ObjectMotion(
            moved_m=float(np.linalg.norm(X_WB[:3, 3] - before[name][:3, 3])),
            tilted_deg=_tilt(before[name], X_WB),
            tilted_in_all_deg=_tilt(start[name], X_WB),
            left_table=bool(X_WB[2, 3] < min(0.0, start[name][2, 3]) - FALLEN),
        )
        for name, X_WB in after.items()
    }


def _tilt(X_WB0: NDArray, X_WB1: NDArray) -> float:
    """By how much the direction that pointed up leans now, degrees; turning on the table is no tilt."""
    R = X_WB1[:3, :3] @ X_WB0[:3, :3].T  # turns the object's old attitude into the new one
    return math.degrees(math.acos(min(1.0, max(-1.0, R[2, 2]))))


def object_at(p_WQ: NDArray, frame: Frame, labels: NDArray) -> int | None:
    """The object whose visible points come nearest to a point of the table, seen from above.

    Args:
        p_WQ: [3], m; where a push meets its object.
        frame: the view from before the push.
        labels: [H, W], the true object ids in it.
    """
    seen = (labels > 0) & (frame.depth > 0)
    if not seen.any():
        return None
    p_WP = move_points(frame.X_WC, back_project(frame.depth, frame.intrinsics)[seen])
    nearest = np.argmin(np.linalg.norm(p_WP[:, :2] - p_WQ[:2], axis=1))
    return int(labels[seen][nearest])


def disturbance_of_steps(scenes: Sequence[Sequence[Disturbance]], last_step: int) -> list[DisturbanceFigures]:
    """The figures of the interactions 1..last_step, each over the scenes that got so far."""
    return [_figures(scenes, [i]) for i in range(last_step)]


def disturbance_of_all(scenes: Sequence[Sequence[Disturbance]]) -> DisturbanceFigures:
    """The figures over all interactions of all scenes."""
    return _figures(scenes, range(max(map(len, scenes), default=0)))


def _figures(scenes: Sequence[Sequence[Disturbance]], steps: Iterable[int]) -> DisturbanceFigures:
    pushed: list[float] = []
    others: list[float] = []
    tilts: list[float] = []
    interactions = toppled = left_table = 0
    for i in steps:
        for scene in scenes:
            if i >= len(scene):
                continue
            interactions += 1
            before = scene[i - 1].motions if i > 0 else {}
            for name, motion in scene[i].motions.items():
                (pushed if name == scene[i].pushed else others).append(motion.moved_m)
                tilts.append(motion.tilted_in_all_deg)
                was = before.get(name, ObjectMotion(0.0, 0.0))
                toppled += motion.tilted_in_all_deg > TOPPLED_DEG >= was.tilted_in_all_deg
                left_table += motion.left_table and not was.left_table
    return DisturbanceFigures(
        interactions=interactions,
        pushed_mean_m=float(np.mean(pushed)) if pushed else float("nan"),
        others_median_m=float(np.median(others)) if others else float("nan"),
        tilt_max_deg=max(tilts, default=float("nan")),
        toppled=toppled,
        left_table=left_table,
    )
