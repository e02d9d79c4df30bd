"""camera.json: the colour camera of a folder, its lens, and the depth camera where that is another one."""

import json
from pathlib import Path

from riseg_drake.host.files import MOST_SETTINGS, FileError, MissingFileError, read_text
from riseg_drake.recording import layout
from riseg_drake.recording.layout import RecordingError
from riseg_drake.recording.registration import Registration, registration_from_json


def read_camera(path: Path, inside: Path | None) -> tuple[Registration, float]:
    """How images become those of one pinhole, and units of depth in a metre.

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
        return registration_from_json(content, intrinsics), depth_scale
    except RecordingError as error:
        raise RecordingError(f"{path}: {error}") from None
