import json
import re

import pytest

from riseg_drake.recording.camera_file import read_camera, said_in_vain
from riseg_drake.recording.reader import RecordingReader
from tests.recording.made_recordings import SMALL, drawn_frames, write

CAMERA = {"width": 160, "height": 120, "fx": 154.1, "fy": 153.9, "cx": 79.2, "cy": 59.4, "depth_scale": 1000}


def test_a_file_is_intrinsics_scale_and_nothing_to_say(tmp_path):
    (tmp_path / "camera.json").write_text(json.dumps({**CAMERA, "serial": "1234", "model": "D415"}))
    registration, scale, odd = read_camera(tmp_path / "camera.json", None)
    assert (registration.intrinsics, scale, odd) == (SMALL, 1000, [])


@pytest.mark.parametrize(
    ("said", "expected"),
    [
        ({"coeffs": [0.1, -0.08, 0, 0, 0]}, "'coeffs' is not used; a lens is \"distortion\""),
        ({"k1": 0.1, "k2": 0.0}, "'k1' is not used"),
        ({"coeffs": [0.0] * 5, "distortion_model": "brown_conrady"}, ""),
        ({"distortion": [0.1, -0.08, 0, 0, 0]}, ""),
        ({"depth_to_color": {"translation": [0.015, 0, 0]}}, "'depth_to_color' is not used; .*\"X_CD\""),
    ],
)
def test_what_others_call_otherwise_is_said_to_be_unused(said, expected):
    lines = said_in_vain({**CAMERA, **said})
    assert len(lines) == bool(expected)
    if expected:
        assert re.search(expected, lines[0])


def test_a_recording_warns_of_it(tmp_path):
    folder = write(tmp_path / "recording", drawn_frames(2))
    (folder / "camera.json").write_text(json.dumps({**CAMERA, "coeffs": [0.1, 0, 0, 0, 0]}))
    (line,) = RecordingReader(folder).warnings
    assert line.startswith(f"{folder / 'camera.json'}: 'coeffs' is not used")
