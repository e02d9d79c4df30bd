"""Where the arm waits so that a camera fixed to the world sees the work area and not the arm."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import cv2
import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.robot.silhouette import RobotSilhouette

if TYPE_CHECKING:
    from riseg_drake.robot.kinematics import PandaKinematics

HALF_WIDTH, TALLEST = 0.25, 0.15
"""The arm shall not hide what lies within a box about the middle of the work area: as far to each side, and as
high, m."""
HIDES_LITTLE = 0.002
"""Shares of that box's picture that differ by less count as equal; then the shorter way decides."""
_REACH, _SIDE, _TIP = (0.25, 0.32, 0.4, 0.48), (0.0, 0.6, -0.6, 1.1, -1.1, 1.6, -1.6), (0.2, 0.3, 0.4)
"""Where the tip may wait: distances from the arm's axis, m, directions about it, rad, heights, m."""
_WAITING_CLEARANCE = 0.02
"""Room that the waiting arm keeps to the table, the camera and itself, m."""


def posture_out_of_view(kinematics: "PandaKinematics", centre_W: Sequence[float]) -> NDArray[np.float64]:
    """The posture [7], rad, that hides the least of the work area from the fixed camera, tool upright.

    Of those that hide hardly more, the one from which the way to the middle of the work area is shortest
    (largest joint difference); `centre_W` is its x and y in W, m.

    Raises:
        ValueError: the camera is not fixed, does not see the middle of the work area, or the arm can wait
            nowhere.
    """
    from riseg_drake.robot.kinematics import tip_pointing_down

    X_WC = kinematics.fixed_camera
    if X_WC is None:
        raise ValueError("the camera is on the wrist: nothing is out of its view")
    intrinsics = Intrinsics(width=200, height=200, fx=100.0, fy=100.0, cx=99.5, cy=99.5)
    box = _picture_of_box(X_WC, centre_W, intrinsics)
    silhouette = RobotSilhouette(kinematics, intrinsics)
    q_centre = kinematics.solve_ik(tip_pointing_down([*centre_W, _TIP[0]], 0.0))
    if q_centre is None:
        raise ValueError(f"centre_W: the arm does not reach {list(centre_W)}; (0.5, 0) is within reach")
    waiting = []
    for turn in _SIDE:
        for reach in _REACH:
            for height in _TIP:
                X_WE = tip_pointing_down([reach * np.cos(turn), reach * np.sin(turn), height], turn)
                q = kinematics.solve_ik(X_WE, q_centre, min_clearance=_WAITING_CLEARANCE)
                if q is not None:
                    hidden = np.count_nonzero(silhouette.mask(q) & box) / np.count_nonzero(box)
                    waiting.append((hidden, float(np.abs(q - q_centre).max()), q))
    if not waiting:
        raise ValueError("X_WC: the arm can wait nowhere without touching the camera; move the camera away")
    least = min(hidden for hidden, _, _ in waiting)
    _, _, q = min((item for item in waiting if item[0] <= least + HIDES_LITTLE), key=lambda item: item[1])
    return q


def _picture_of_box(X_WC: NDArray, centre_W: Sequence[float], intrinsics: Intrinsics) -> NDArray[np.bool_]:
    """The pixels [H, W] in which the box lies that shall not be hidden. Raises ValueError."""
    offsets = np.stack(np.meshgrid([-1, 1], [-1, 1], [0, 1], indexing="ij"), axis=-1).reshape(-1, 3)
    p_WQ = np.array([*centre_W, 0.0]) + offsets * [HALF_WIDTH, HALF_WIDTH, TALLEST]
    p_CQ = (p_WQ - X_WC[:3, 3]) @ X_WC[:3, :3]
    p_CT = (np.array([*centre_W, 0.0]) - X_WC[:3, 3]) @ X_WC[:3, :3]
    if p_CQ[:, 2].min() < 0.05 or np.hypot(*p_CT[:2]) > p_CT[2]:
        raise ValueError(
            f"X_WC: the camera does not look at the work area around {list(centre_W)}; its z axis points ahead"
        )
    k = intrinsics
    uv = p_CQ[:, :2] / p_CQ[:, 2:] * k.fx + [k.cx, k.cy]
    picture = np.zeros(k.shape, np.uint8)
    cv2.fillConvexPoly(picture, cv2.convexHull(np.round(uv).astype(np.int32)), 1)
    return picture.astype(bool)
