"""Walls behind a table: wide upright planes with nothing behind them (not in the paper).

Seen from straight above the table they are lines. No size tells a wall that touches the table from a box
that stands on it, but beside a box the camera sees on, and beside a wall it does not.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from riseg_drake.segmentation.scales import DEPTH_NOISE

_WALLS, _HYPOTHESES = 3, 96
"""Walls that are looked for, and lines through two points that are tried for each."""


@dataclass
class WallParameters:
    """What is a wall."""

    width: float = 0.5
    """m; what is less wide is none."""
    share: float = 0.03
    """Of all that is seen; what is less is none."""
    behind_share: float = 0.1
    """Of a wall's own points; where more lie behind it, it is none."""
    foot: float = 0.05
    """m above the table; what is lower is not asked."""
    thickness: float = 0.01
    """m; depth noise comes on top."""
    depth_noise: float = DEPTH_NOISE
    """Standard deviation of depth at 1 m, m, that is reckoned with."""


def find_walls(
    feet: NDArray, height: NDArray, depth: NDArray, parameters: WallParameters
) -> NDArray[np.float64]:
    """Walls as lines [n_x, n_y, d] on the table's plane, [M, 3]; the camera is on the positive side.

    Args:
        feet: [N, 2], m, of all that is seen, on the plane; the camera's own is the origin.
        height: [N], m above the plane.
        depth: [N], m.
        parameters: see there.
    """
    rng, found = np.random.default_rng(0), np.empty((0, 3))
    reach = _reach(depth, parameters)
    upright = height > parameters.foot
    for _ in range(_WALLS):
        asked = np.flatnonzero(upright)
        if len(asked) < parameters.share * len(height):
            break
        a, b = feet[asked[rng.integers(len(asked), size=(2, _HYPOTHESES))]].astype(float)
        lines = _lines(a, b)
        if not len(lines):
            break
        apart = lines[:, :2].astype(np.float32) @ feet.T + lines[:, 2:].astype(np.float32)
        on = (np.abs(apart) < reach) & upright
        best = int(np.argmax(on.sum(1) - 2 * (apart < -reach).sum(1)))
        if np.count_nonzero(on[best]) < parameters.share * len(height):
            break
        line = _fitted_line(feet[on[best]])
        apart_best = feet @ line[:2] + line[2]
        mine = (np.abs(apart_best) < reach) & upright
        if np.count_nonzero(apart_best < -reach) > parameters.behind_share * np.count_nonzero(mine):
            break
        upright &= ~mine
        first, last = np.quantile(feet[mine] @ np.array([-line[1], line[0]]), [0.02, 0.98])
        if last - first >= parameters.width:
            found = np.vstack([found, line])
    return found


def in_walls(walls: NDArray, feet: NDArray, depth: NDArray, parameters: WallParameters) -> NDArray[np.bool_]:
    """Which points, of feet [..., 2] and depth [...], m, lie in one of the walls [M, 3], or behind it."""
    inside = np.zeros(depth.shape, bool)
    if len(walls):
        reach = _reach(depth, parameters)
        for x, y, d in walls.astype(np.float32):
            inside |= feet[..., 0] * x + feet[..., 1] * y + d < reach
    return inside


def _reach(depth: NDArray, parameters: WallParameters) -> NDArray[np.float32]:
    """How far from a wall's plane its own points may appear, m."""
    return (parameters.thickness + 3 * parameters.depth_noise * depth**2).astype(np.float32)


def _lines(a: NDArray, b: NDArray) -> NDArray[np.float64]:
    """Lines [M, 3] through pairs of points [N, 2] that are not too near each other."""
    direction = b - a
    length = np.linalg.norm(direction, axis=1)
    far = length > 0.1
    normal = np.column_stack([-direction[far, 1], direction[far, 0]]) / length[far, None]
    d = -(normal * a[far]).sum(1)
    return np.column_stack([normal, d]) * np.where(d < 0, -1.0, 1.0)[:, None]


def _fitted_line(points: NDArray) -> NDArray[np.float64]:
    """The line [3] of least squares through points [N, 2], with the origin on its positive side."""
    centre = points.mean(0, dtype=float)
    _, vectors = np.linalg.eigh(np.cov(points.T))
    d = -float(vectors[:, 0] @ centre)
    return np.append(vectors[:, 0], d) * (-1.0 if d < 0 else 1.0)
