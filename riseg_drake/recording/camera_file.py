"""camera.json: the colour camera of a folder, its lens, and the depth camera where that is another one."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from riseg_drake.host.files import MOST_SETTINGS, FileError, MissingFileError, read_text
from riseg_drake.recording import layout
from riseg_drake.recording.layout import RecordingError
from riseg_drake.recording.registration import Registration, registration_from_json

_LENS = {
    *("coeffs", "coefficients", "distortion_coefficients", "distortion_coeffs", "dist", "dist_coeffs", "d"),
    *("k1", "k2", "k3", "k4", "p1", "p2"),
}
"""Names of a lens' coefficients in the files of RealSense, OpenCV, ROS, COLMAP and Kalibr."""
_EXTRINSICS = {"extrinsics", "depth_to_color", "color_to_depth", "depth_to_colour", "baseline"}


def read_camera(path: Path, inside: Path | None) -> tuple[Registration, float, list[str]]:
    """How images become those of one pinhole, units of depth in a metre, and what is said there in vain.

    The file must lie in the folder `inside`, where one is given. Raises RecordingError.
    """
    try:
        content = json.loads(read_text(path, MOST_SETTINGS, inside))
    except MissingFileError:
        raise RecordingError(
            f"{path} is missing; it holds width, height, fx, fy, cx, cy, depth_scale"
        ) from None
    except json.JSONDecodeError as error:
        raise RecordingError(f"{path}: line {error.lineno} is not JSON ({error.msg})") from None
    except FileError as error:
        raise layout.refusal(error) from None
    except (ValueError, RecursionError):
        raise RecordingError(f"{path} is no JSON that can be read") from None
    try:
        intrinsics, depth_scale = layout.camera_from_json(content)
        return registration_from_json(content, intrinsics), depth_scale, said_in_vain(content)
    except RecordingError as error:
        raise RecordingError(f"{path}: {error}") from None


def said_in_vain(content: Mapping[str, Any]) -> list[str]:
    """What a camera.json says of lens or depth camera under names that others use, in one line or none."""
    lens = [key for key in content if key.lower() in _LENS and _is_something(content[key])]
    where = [key for key in content if key.lower() in _EXTRINSICS]
    said = []
    if lens:
        said.append(
            f'{", ".join(map(repr, lens))} is not used; a lens is "distortion": '
            "[k1, k2, p1, p2, ...], as OpenCV counts them"
        )
    if where:
        said.append(
            f'{", ".join(map(repr, where))} is not used; a depth camera of its own is "depth": {{..., "X_CD": '
            "[tx, ty, tz, qx, qy, qz, qw]}"
        )
    return said


def _is_something(value: Any) -> bool:
    """Whether coefficients, in whatever form, are not all 0."""
    if isinstance(value, list | tuple):
        return any(map(_is_something, value))
    return isinstance(value, int | float) and value != 0
