"""What lies where in a recording: the TUM RGB-D layout, with a camera file and optional extras.

    rgb.txt, depth.txt      timestamp file             (lines that begin with # are comments)
    rgb/, depth/            PNG; depth 16 bit, 0 = invalid
    groundtruth.txt         timestamp tx ty tz qx qy qz qw     the camera's pose X_WC
    camera.json             width, height, fx, fy, cx, cy, depth_scale (units of depth per metre)
    joints.csv              timestamp,q1..q7                   optional
    robot/, label/          PNG named as in rgb/: the robot's own pixels; object ids     optional

Times are seconds, lengths metres, angles radians, quaternions have the scalar last.
"""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from riseg_drake.geometry.camera import Intrinsics

COLOR_LIST = "rgb.txt"
DEPTH_LIST = "depth.txt"
POSE_LIST = "groundtruth.txt"
CAMERA_FILE = "camera.json"
JOINT_LIST = "joints.csv"
COLOR_FOLDER = "rgb"
DEPTH_FOLDER = "depth"
ROBOT_FOLDER = "robot"
LABEL_FOLDER = "label"

HEADERS = {
    COLOR_LIST: "# timestamp filename",
    DEPTH_LIST: "# timestamp filename",
    POSE_LIST: "# timestamp tx ty tz qx qy qz qw (the camera's pose X_WC: x right, y down, z forward)",
    JOINT_LIST: "timestamp," + ",".join(f"q{joint}" for joint in range(1, 8)),
}

MILLIMETRES = 1000.0
"""Units of depth per metre that the writer uses."""


class RecordingError(ValueError):
    """What is wrong with a recording, in one line that names the file."""


@dataclass(frozen=True)
class RecordedFrame:
    """One moment of a recording: an RGB-D image and whatever else was recorded with it."""

    time: float
    """s"""
    color: NDArray[np.uint8]
    """[H, W, 3], RGB."""
    depth: NDArray[np.float32]
    """[H, W], metres, 0 = invalid."""
    X_WC: NDArray[np.float64] | None = None
    """The camera's pose, [4, 4]."""
    position: NDArray[np.float64] | None = None
    """Joint angles theta_t, [7], rad."""
    robot: NDArray[np.bool_] | None = None
    """[H, W], the pixels that the robot itself covers."""
    labels: NDArray[np.uint16] | None = None
    """[H, W], the true object ids, 0 = no object."""


def camera_to_json(intrinsics: Intrinsics, depth_scale: float) -> dict[str, float]:
    """The content of camera.json."""
    return {**asdict(intrinsics), "depth_scale": depth_scale}


def camera_from_json(content: Any) -> tuple[Intrinsics, float]:
    """Intrinsics and units of depth per metre from the content of camera.json.

    Raises RecordingError, without the file's name, if a key is missing or no number.
    """
    keys = ("width", "height", "fx", "fy", "cx", "cy", "depth_scale")
    if not isinstance(content, dict):
        raise RecordingError(f"it must hold one object with the keys {', '.join(keys)}")
    for key in keys:
        if not isinstance(content.get(key), int | float):
            raise RecordingError(f'"{key}" must be a number; the keys are {", ".join(keys)}')
    if min(content[key] for key in ("width", "height", "fx", "fy", "depth_scale")) <= 0:
        raise RecordingError("width, height, fx, fy and depth_scale must be above 0")
    intrinsics = Intrinsics(
        int(content["width"]), int(content["height"]), *(float(content[key]) for key in keys[2:6])
    )
    return intrinsics, float(content["depth_scale"])


def pose_to_numbers(X_WC: NDArray) -> list[float]:
    """[tx, ty, tz, qx, qy, qz, qw] of a pose [4, 4]."""
    return [*X_WC[:3, 3].tolist(), *Rotation.from_matrix(X_WC[:3, :3]).as_quat().tolist()]


def pose_from_numbers(numbers: NDArray) -> NDArray[np.float64]:
    """The pose [4, 4] of [tx, ty, tz, qx, qy, qz, qw]."""
    X_WC = np.eye(4)
    X_WC[:3, :3] = Rotation.from_quat(numbers[3:]).as_matrix()
    X_WC[:3, 3] = numbers[:3]
    return X_WC
