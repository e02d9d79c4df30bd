"""About which axes a thing may roll: what is round about an axis comes to lie on itself when it turns.

A motion is one of a surface along itself where the velocities of its points lie in it (slippage: Gelfand and
Guibas, 2004). Depth does not tell how far a can has rolled, so that nothing that starts from outline and depth
leads there: it has to be tried.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.camera import bounding_region
from riseg_drake.geometry.rgbd import Frame
from riseg_drake.segmentation.scales import LOWEST
from riseg_drake.segmentation.slides import along_plane, turned_and_shifted

_WINDOW = 2 * LOWEST
"""m; surface within so much around a point tells how it lies there."""
_ACROSS = 0.2
"""Share of the points' speed across the surface, up to which they move along it: normals err by 0.06 rad."""
_RADII = (LOWEST, 0.08)
"""m; what is thinner has no side to roll on, and what turns about an axis farther away slides."""
_TRUSTED, _ROUNDS = 0.8, 3
"""Share of the points, those that agree best, as a patch may lie on two things; how often they are chosen."""
_RIDGE = 1e-2
"""Of the normals' information on shifts: along what they do not tell nothing shifts."""


@dataclass(frozen=True)
class RollingAxis:
    """An axis about which some points may roll."""

    direction: NDArray[np.float64]
    """[3], of length 1."""
    point: NDArray[np.float64]
    """[3], m, on the axis."""


def surface_normals(
    frame: Frame, mask: NDArray[np.bool_], v: NDArray[np.intp], u: NDArray[np.intp]
) -> NDArray[np.float64]:
    """Normals [S, 3], towards the camera, of a surface [H, W] at pixels v, u [S], by planes through their
    surroundings.

    The inverse depth of a plane is linear in the pixels.
    """
    known = mask & (frame.depth > 0)
    region = bounding_region(known)
    weight = known[region].astype(np.float64)
    per_depth = np.divide(1.0, frame.depth[region], out=np.zeros(weight.shape), where=known[region])
    k = frame.intrinsics
    side = 2 * int(np.ceil(_WINDOW * k.fx / float(np.median(frame.depth[known])))) + 1
    y, x = np.mgrid[: weight.shape[0], : weight.shape[1]].astype(np.float64)
    at = v - region[0].start, u - region[1].start

    def near(values: NDArray[np.float64]) -> NDArray[np.float64]:
        total = cv2.boxFilter(values * weight, -1, (side, side), borderType=cv2.BORDER_CONSTANT)
        return np.asarray(total[at])

    one = np.maximum(near(weight), 1e-9)
    mean_x, mean_y, mean_w = (near(a) / one for a in (x, y, per_depth))
    # The ridge is for a window of a single row or column.
    xx, yy = near(x * x) / one - mean_x**2 + 1e-3, near(y * y) / one - mean_y**2 + 1e-3
    xy = near(x * y) / one - mean_x * mean_y
    xw, yw = near(x * per_depth) / one - mean_x * mean_w, near(y * per_depth) / one - mean_y * mean_w
    determinant = xx * yy - xy**2
    along_u, along_v = (yy * xw - xy * yw) / determinant, (xx * yw - xy * xw) / determinant
    w = mean_w + along_u * (at[1] - mean_x) + along_v * (at[0] - mean_y)
    n = -np.stack([k.fx * along_u, k.fy * along_v, w - (u - k.cx) * along_u - (v - k.cy) * along_v], axis=1)
    return np.asarray(n / np.linalg.norm(n, axis=1, keepdims=True))


def rolling_axes(
    p_KQ: NDArray[np.float64], normals: NDArray[np.float64], up: NDArray[np.float64]
) -> list[RollingAxis]:
    """Axes that lie as the table does, about which points [S, 3], m, with normals [S, 3] turn along their own
    surface: none of what has edges, one of what lies like a can, two of a ball. `up` [3] is across the table.
    """
    middle = p_KQ.mean(0)
    axes = (_axis(p_KQ - middle, normals, along_plane(up).T, which) for which in range(2))
    return [RollingAxis(axis.direction, middle + axis.point) for axis in axes if axis is not None]


def _axis(
    q: NDArray[np.float64], normals: NDArray[np.float64], B: NDArray[np.float64], which: int
) -> RollingAxis | None:
    """The axis in the plane B [3, 2] about which points q [S, 3] slip best, or second best, if they do."""
    trusted = np.ones(len(q), bool)
    for _ in range(_ROUNDS):
        n = normals[trusted]
        arm = np.cross(q[trusted], n) @ B
        C_vw = n.T @ arm
        # The velocity v that keeps the surface in itself best for each direction of the axis, and what is left.
        v_of = -np.linalg.solve(n.T @ n + _RIDGE * len(n) * np.eye(3), C_vw)
        along_B = np.linalg.eigh(arm.T @ arm + C_vw.T @ v_of)[1][:, which]
        omega, v = B @ along_B, v_of @ along_B
        velocity = v + np.cross(omega, q)
        off = np.abs((normals * velocity).sum(1))
        trusted = off <= np.quantile(off, _TRUSTED)
    share = np.sqrt((off[trusted] ** 2).mean() / (velocity[trusted] ** 2).sum(1).mean())
    point = np.cross(omega, v)
    arm = q - point
    radius = ((arm - np.outer(arm @ omega, omega)) * normals).sum(1)[trusted].mean()
    return RollingAxis(omega, point) if share < _ACROSS and _RADII[0] < radius < _RADII[1] else None


def rolls(axis: RollingAxis, up: NDArray[np.float64], amounts: NDArray[np.float64]) -> NDArray[np.float64]:
    """Motions [G, 4, 4] of things that roll on a plane: turned about an axis by the third of `amounts` [G, 3],
    rad, and shifted along it and across it by the others, m."""
    forward = np.cross(up / np.linalg.norm(up), axis.direction)
    return turned_and_shifted(axis.direction, axis.point, np.stack([axis.direction, forward]), amounts)
