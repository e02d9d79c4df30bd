"""What the interactions did to the scene: the paper promises to leave it as it was.

Poses are X_WBcm [4, 4]: the axes of a body's frame B in its centre of mass Bcm. Origins of frames say little,
as those of lying things lie on their undersides.

*Tilt* is the angle by which the direction in B that pointed up at the start leans now, less what rolling does:
of a body of revolution only the change of the angle between its axis and the vertical counts, of a ball
nothing. So a can or a lying bottle that rolls does not tilt, however far; a can that stood and lies now is
tilted by 90 degrees, and so is a cube that lies on another face. Heights could not tell the last from the
first: in both, the centre of mass is as high as before.

An object has *toppled* once it is tilted by more than 20 degrees. It *fell* if its centre of mass came down by
more than 1 cm and it did not topple: it slid or rolled off another. It has *left the table* if its centre of
mass is below the top.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.camera import back_project
from riseg_drake.geometry.rgbd import Frame
from riseg_drake.geometry.se3 import move_points

TOPPLED_DEG = 20.0
"""An object has toppled once it is tilted by more than this, degrees."""
FELL = 0.01
"""An object that did not topple fell if its centre of mass came down by more than this, m."""

NO_AXES: NDArray = np.zeros((0, 3))
"""Of what is no body of revolution."""


@dataclass(frozen=True)
class ObjectMotion:
    """What one interaction did to one object."""

    moved_m: float
    """Distance between the object's centre of mass before and after, m."""
    tilted_deg: float
    """Its tilt since before the interaction, degrees."""
    tilted_in_all_deg: float = 0.0
    """The same since before the first interaction, degrees."""
    left_table: bool = False
    """Its centre of mass is below the table's top."""
    came_down_m: float = 0.0
    """By how much its centre of mass is lower than before the first interaction, m; less than 0: higher."""

    @property
    def toppled(self) -> bool:
        """Whether it has turned over since before the first interaction."""
        return self.tilted_in_all_deg > TOPPLED_DEG

    @property
    def fell(self) -> bool:
        """Whether it is lower than before the first interaction without having turned over."""
        return self.came_down_m > FELL and not self.toppled


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
    """The most that any object is tilted against the start."""
    toppled: int
    """Objects that turned over in these interactions."""
    fell: int
    """Objects that came down onto the table in them, or onto something else, without turning over."""
    left_table: int
    """Objects that left the table in them."""


def motion_between(
    start: Mapping[str, NDArray],
    before: Mapping[str, NDArray],
    after: Mapping[str, NDArray],
    axes: Mapping[str, NDArray],
) -> dict[str, ObjectMotion]:
    """What happened to every object, by its name, from its poses X_WBcm [4, 4].

    Args:
        start: before the first interaction.
        before: before this interaction.
        after: after it.
        axes: unit vectors in B [k, 3] about which it is a body of revolution; may lack what is none.
    """
    return {
        name: ObjectMotion(
            moved_m=float(np.linalg.norm(X_WBcm[:3, 3] - before[name][:3, 3])),
            tilted_deg=tilt(before[name], X_WBcm, axes.get(name, NO_AXES)),
            tilted_in_all_deg=tilt(start[name], X_WBcm, axes.get(name, NO_AXES)),
            left_table=bool(X_WBcm[2, 3] < 0.0),
            came_down_m=float(start[name][2, 3] - X_WBcm[2, 3]),
        )
        for name, X_WBcm in after.items()
    }


def tilt(X_WBcm0: NDArray, X_WBcm1: NDArray, axes: NDArray = NO_AXES) -> float:
    """By how much an object leans more than it did, degrees; neither turning on the table nor rolling counts.

    Args:
        X_WBcm0: [4, 4], before.
        X_WBcm1: [4, 4], after.
        axes: unit vectors in B [k, 3] about which it is a body of revolution; none, one, or a ball's three.
    """
    R_WB0, R_WB1 = X_WBcm0[:3, :3], X_WBcm1[:3, :3]
    if len(axes) == 0:
        return _from_vertical(R_WB1 @ R_WB0.T[:, 2])
    if len(axes) == 1:
        return abs(_from_vertical(R_WB1 @ axes[0]) - _from_vertical(R_WB0 @ axes[0]))
    return 0.0


def _from_vertical(direction_W: NDArray) -> float:
    """The angle between a unit vector [3] and the vertical, degrees."""
    return math.degrees(math.atan2(math.hypot(direction_W[0], direction_W[1]), direction_W[2]))


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
    interactions = toppled = fell = left_table = 0
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
                toppled += motion.toppled and not was.toppled
                fell += motion.fell and not (was.fell or was.toppled or motion.left_table)
                left_table += motion.left_table and not was.left_table
    return DisturbanceFigures(
        interactions=interactions,
        pushed_mean_m=float(np.mean(pushed)) if pushed else float("nan"),
        others_median_m=float(np.median(others)) if others else float("nan"),
        tilt_max_deg=max(tilts, default=float("nan")),
        toppled=toppled,
        fell=fell,
        left_table=left_table,
    )
