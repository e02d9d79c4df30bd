"""What lies where in a recording: the TUM RGB-D layout, with a camera file and optional extras.

    rgb.txt, depth.txt      timestamp file             (lines that begin with # are comments)
    rgb/, depth/            PNG; depth 16 bit, 0 = invalid; colour may be JPEG
    groundtruth.txt         timestamp tx ty tz qx qy qz qw     the camera's pose X_WC
    camera.json             width, height, fx, fy, cx, cy, depth_scale (units of depth per metre)
    joints.csv              timestamp,q1..q7                   optional
    robot/, label/          PNG named as in rgb/: the robot's own pixels; object ids     optional
    scenario.yaml, run.json what a run was told, and its seed  optional, written by `riseg run --record`

Times are seconds, lengths metres, angles radians, quaternions have the scalar last.
"""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.host.files import FileError, LeadsOutError

COLOR_LIST = "rgb.txt"
DEPTH_LIST = "depth.txt"
POSE_LIST = "groundtruth.txt"
CAMERA_FILE = "camera.json"
JOINT_LIST = "joints.csv"
CAMERA_KEYS = "width, height, fx, fy, cx, cy, depth_scale"
SCENARIO_FILE = "scenario.yaml"
RUN_FILE = "run.json"
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

SMALLEST, LARGEST = 32, 16384
"""Pixels on a side of an image: below that optical flow does not work, above it no camera does."""
LEAST, MOST = 1.0, 1e6
"""Pixels of a focal length, and units of depth in a metre: from metres to micrometres."""
OFF_CENTRE = 0.15
"""Share of the image by which the principal point may be off its middle before a person is warned."""

MILLIMETRES = 1000.0
"""Units of depth per metre that the writer uses."""


class RecordingError(ValueError):
    """What is wrong with a recording, in one line that names the file."""


def refusal(error: FileError, where: str = "") -> RecordingError:
    """What to say of a file that is not read, at a place in a list."""
    hint = "; --follow allows that" if isinstance(error, LeadsOutError) else ""
    return RecordingError(f"{where}{error}{hint}")


@dataclass(frozen=True)
class LeftOut:
    """A line of a list that was passed over, and why."""

    file: str
    line: int
    why: str
    unit: str = "line"
    """What is counted from 1: lines of a list, images, or messages."""

    def __str__(self) -> str:
        return f"{self.file}: {self.unit} {self.line} is left out: {self.why}"


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
    name: str = ""
    """The colour image's file, as rgb.txt has it; empty while it is in no file."""
    line: int = 0
    """Where rgb.txt names it, from 1; 0 while it does not."""


def camera_to_json(intrinsics: Intrinsics, depth_scale: float) -> dict[str, float]:
    """The content of camera.json; `depth_scale` in units per metre."""
    return {**asdict(intrinsics), "depth_scale": depth_scale}


def camera_from_json(content: Any) -> tuple[Intrinsics, float]:
    """Intrinsics and units of depth per metre from the content of camera.json.

    Raises RecordingError, without the file's name, for what cannot be.
    """
    keys = CAMERA_KEYS.split(", ")
    if not isinstance(content, dict):
        raise RecordingError(f"it must hold one object with the keys {CAMERA_KEYS}")
    for key in keys:
        if key not in content:
            raise RecordingError(f'"{key}" is missing; the keys are {CAMERA_KEYS}')
        value = content[key]
        if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < 1e9:
            raise RecordingError(f'"{key}" must be a number; the keys are {CAMERA_KEYS}')
    for key in ("width", "height"):
        if content[key] % 1 or not SMALLEST <= content[key] <= LARGEST:
            raise RecordingError(
                f'"{key}" is {content[key]}, it must be a whole number from {SMALLEST} to {LARGEST}'
            )
    for key in ("fx", "fy", "depth_scale"):
        if not LEAST <= content[key] <= MOST:
            raise RecordingError(f'"{key}" is {content[key]:g}, it must be from {LEAST:g} to {MOST:g}')
    for key, size in (("cx", "width"), ("cy", "height")):
        if not 0 <= content[key] < content[size]:
            raise RecordingError(f'"{key}" is {content[key]}, outside of the {content[size]} pixels of {size}')
    intrinsics = Intrinsics(
        int(content["width"]), int(content["height"]), *(float(content[key]) for key in keys[2:6])
    )
    return intrinsics, float(content["depth_scale"])


def unlikely_camera(k: Intrinsics) -> list[str]:
    """What is odd about intrinsics, a line each: possible, but most often a mistake."""
    warnings = []
    for key, value, size in (("cx", k.cx, k.width), ("cy", k.cy, k.height)):
        if abs(value - size / 2) > OFF_CENTRE * size:
            warnings.append(f'"{key}" is {value:g}, far off the middle of {size} pixels')
    if not 1 / 1.25 < k.fx / k.fy < 1.25:
        warnings.append(f'"fx" and "fy" are {k.fx:g} and {k.fy:g}; they are nearly equal in most cameras')
    if not 0.3 < k.fx / k.width < 5:
        warnings.append(f'"fx" is {k.fx:g} at a width of {k.width}: an unusual angle of view')
    return warnings


def pose_to_numbers(X_WC: NDArray) -> list[float]:
    """[tx, ty, tz, qx, qy, qz, qw] of a pose [4, 4]."""
    return [*X_WC[:3, 3].tolist(), *Rotation.from_matrix(X_WC[:3, :3]).as_quat().tolist()]


def pose_from_numbers(numbers: NDArray) -> NDArray[np.float64]:
    """The pose [4, 4] of [tx, ty, tz, qx, qy, qz, qw]."""
    X_WC = np.eye(4)
    X_WC[:3, :3] = Rotation.from_quat(numbers[3:]).as_matrix()
    X_WC[:3, 3] = numbers[:3]
    return X_WC
