"""Where a person stands who looks on in the browser, and what stands around the work area."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import Meshcat
from pydrake.math import RigidTransform, RotationMatrix

# All from the middle of the work area on the table, m: x away from the robot, z up.
EYE = np.array([0.72, 0.0, 0.66])
"""In front of the robot and above it."""
TARGET = np.array([0.09, 0.0, 0.02])
FIELD_OF_VIEW = 40.0
"""Vertical, degrees: a longer lens than Meshcat's own, which makes near things large and far ones small."""
PANEL = np.array([0.352, 0.0, 0.12])
"""The middle of the camera's picture, in front of the work area, where the arm is never between."""
PANEL_WIDTH = 0.198  # m
BOARD_OFFSET = np.array([0.215, 0.055])
"""Of the list of all objects from the middle of that picture, right and up in its plane, m: a narrow window,
which would have no room for it, ends before it, and a wide one has nothing there."""
BOARD_SIZE = (0.19, 0.283)
"""Width and height, m."""
LABEL_HEIGHT = 0.014  # m
LABEL_LIFT = 0.02
"""From the top of an object to the middle of its label, m."""
TOP_COLOR, BOTTOM_COLOR = (0.86, 0.89, 0.92), (0.66, 0.70, 0.74)
"""Of the background."""


def open_stage(meshcat: Meshcat, centre_W: Sequence[float]) -> None:
    """Look at the work area about `centre_W` (x and y on the table, m), without Meshcat's grid and axes."""
    meshcat.SetCamera(Meshcat.PerspectiveCamera(fov=FIELD_OF_VIEW, aspect=1.5))
    meshcat.SetCameraPose(on_stage(centre_W, EYE), on_stage(centre_W, TARGET))
    for path in ("/Grid", "/Axes"):
        meshcat.SetProperty(path, "visible", False)
    meshcat.SetProperty("/Background/<object>", "top_color", list(TOP_COLOR))
    meshcat.SetProperty("/Background/<object>", "bottom_color", list(BOTTOM_COLOR))


def on_stage(centre_W: Sequence[float], place: NDArray) -> NDArray[np.float64]:
    """A place [3] that is told from the middle of the work area, in W, m."""
    return np.array([*centre_W, 0.0]) + place


def facing(p_WK: NDArray) -> RigidTransform:
    """Pose of a card K at a point [3], m, that whoever looks from EYE to TARGET sees without distortion."""
    return RigidTransform(_R_WK, p_WK)


def _rotation_of_cards() -> RotationMatrix:
    ahead = (TARGET - EYE) / np.linalg.norm(TARGET - EYE)
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    return RotationMatrix(np.column_stack([right, ahead, np.cross(right, ahead)]))


_R_WK = _rotation_of_cards()
BOARD = PANEL + _R_WK @ np.array([BOARD_OFFSET[0], 0.0, BOARD_OFFSET[1]])
"""The middle of that list."""
