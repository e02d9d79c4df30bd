"""Planes whose numbers are known, before one camera."""

import numpy as np
from scipy.spatial.transform import Rotation

from riseg_drake.geometry.camera import Intrinsics

CAMERA = Intrinsics(640, 480, 616.285, 615.778, 301.418, 232.864)


def tilted_plane(angle: float, distance: float, azimuth: float = 0.6) -> np.ndarray:
    """plane_C of a table `distance` away along the optical axis, tilted by `angle`."""
    axis = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    normal = Rotation.from_rotvec(angle * axis).apply([0.0, 0.0, -1.0])
    return np.append(normal, -normal[2] * distance)
