"""Scenes of the BOP data sets: the camera of every image in scene_camera.json."""

import json
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.lens import Lens
from riseg_drake.geometry.se3 import inverse
from riseg_drake.host.files import FileError, read_bytes, read_text
from riseg_drake.host.images import MOST_BYTES, image_kind
from riseg_drake.recording import layout
from riseg_drake.recording.layout import RecordingError
from riseg_drake.recording.registration import Registration
from riseg_drake.recording.stamped_lists import StampedTable

SCENE_CAMERA = "scene_camera.json"
MILLIMETRE = 1e-3
"""m; BOP's unit of length."""


@dataclass(frozen=True)
class BopScene:
    """What the file says of all images together."""

    registration: Registration
    depth_scale: float
    """Units in a metre."""
    poses: StampedTable | None
    """X_WC; None where it has none."""


def read_bop_scene(folder: Path, first_image: Path, rate: float, inside: Path | None) -> BopScene:
    """The camera of a scene, whose images have numbers for names, so many a second, Hz.

    Raises RecordingError, also where intrinsics or the unit of depth change from image to image.
    """
    path = folder / SCENE_CAMERA
    try:
        content = json.loads(read_text(path, inside=inside))
        kind = image_kind(read_bytes(first_image, MOST_BYTES, inside))
    except FileError as error:
        raise layout.refusal(error) from None
    except (ValueError, RecursionError):
        raise RecordingError(f"{path} is no JSON that can be read") from None
    if kind is None:
        raise RecordingError(f"{first_image} is not a readable PNG or JPEG image")
    if (
        not isinstance(content, dict)
        or not content
        or not all(re.fullmatch(r"\d{1,9}", key) for key in content)
    ):
        raise RecordingError(f"{path} must hold an object with a camera for each image's number")
    cameras = [content[key] for key in sorted(content, key=int)]
    K = [_numbers(path, camera, "cam_K", 9) for camera in cameras]
    scales = {camera.get("depth_scale", 1.0) for camera in cameras}
    if len({tuple(k) for k in K}) > 1 or len(scales) > 1:
        raise RecordingError(f"{path}: cam_K or depth_scale differs between images; one camera is read")
    (scale,) = scales
    if not isinstance(scale, int | float) or not scale > 0:
        raise RecordingError(f'{path}: "depth_scale" must be a number above 0, mm in a unit of depth')
    (fx, _, cx), (_, fy, cy), _ = K[0].reshape(3, 3).tolist()
    camera = {"width": kind.width, "height": kind.height, "fx": fx, "fy": fy, "cx": cx, "cy": cy}
    try:
        intrinsics, units = layout.camera_from_json({**camera, "depth_scale": 1 / (scale * MILLIMETRE)})
    except RecordingError as error:
        raise RecordingError(f"{path}: {error}") from None
    poses = None
    if all("cam_R_w2c" in camera for camera in cameras):
        rows = [layout.pose_to_numbers(_X_WC(path, camera)) for camera in cameras]
        times = np.array([int(key) / rate for key in sorted(content, key=int)])
        poses = StampedTable(path, [], times, np.array(rows), np.arange(1, len(rows) + 1))
    return BopScene(Registration(Lens(intrinsics)), units, poses)


def _X_WC(path: Path, camera: dict[str, Any]) -> NDArray[np.float64]:
    X_CW = np.eye(4)
    X_CW[:3, :3] = _numbers(path, camera, "cam_R_w2c", 9).reshape(3, 3)
    X_CW[:3, 3] = _numbers(path, camera, "cam_t_w2c", 3) * MILLIMETRE
    R = X_CW[:3, :3]
    if np.abs(R @ R.T - np.eye(3)).max() > 0.01 or np.linalg.det(R) < 0:
        raise RecordingError(f'{path}: "cam_R_w2c" is no rotation')
    return inverse(X_CW)


def _numbers(path: Path, camera: Any, key: str, count: int) -> NDArray[np.float64]:
    values = camera.get(key) if isinstance(camera, dict) else None
    if (
        not isinstance(values, list)
        or len(values) != count
        or not all(isinstance(v, int | float) and abs(v) < 1e9 for v in values)
    ):
        raise RecordingError(f'{path}: "{key}" must hold {count} numbers for each image')
    return np.array(values, float)
