"""What is wrong with a recording is said in one line, with file and line."""

import json
import os
import shutil
import struct
import zlib

import cv2
import numpy as np
import pytest

from riseg_drake.app.cli import main
from riseg_drake.recording.layout import RecordingError
from riseg_drake.recording.reader import RecordingReader
from tests.recording.made_recordings import drawn_frames, write


@pytest.fixture(scope="module")
def frames():
    return drawn_frames(6)


@pytest.fixture
def recording(tmp_path, frames):
    return write(tmp_path / "recording", frames)


def lines_of(path, change):
    lines = path.read_text().splitlines()
    path.write_text("\n".join(change(lines)) + "\n")


def swapped(lines):
    return [*lines[:3], lines[4], lines[3], *lines[5:]]


def camera(**changes):
    def change(folder):
        path = folder / "camera.json"
        path.write_text(json.dumps({**json.loads(path.read_text()), **changes}))

    return change


def list_changed(name, change):
    return lambda folder: lines_of(folder / name, change)


def image(name, pixels):
    return lambda folder: cv2.imwrite(str(folder / name), pixels)


WIDE = np.zeros((120, 170), np.uint16)
BAD = {
    "colour stamps swapped": (list_changed("rgb.txt", swapped), "rgb.txt: line 5: time runs backwards"),
    "depth stamps swapped": (list_changed("depth.txt", swapped), "depth.txt: line 5: time runs backwards"),
    "poses swapped": (list_changed("groundtruth.txt", swapped), "groundtruth.txt: line 5: time runs backwards"),
    "no partner": (
        list_changed("depth.txt", lambda lines: [f"9{line}" for line in lines[1:]]),
        "rgb.txt: line 2: neither this stamp nor any other has a partner in depth.txt",
    ),
    "not a rotation": (
        list_changed("groundtruth.txt", lambda lines: [*lines[:3], "0.2 0 0 0 0.5 0.5 0 0", *lines[4:]]),
        "groundtruth.txt: line 4: the quaternion",
    ),
    "no focal length": (camera(fx=0), '"fx" is 0, it must be from 1 to 1e+06'),
    "a focal length that no camera has": (camera(fy=1e-300), '"fy" is 1e-300, it must be from 1 to 1e+06'),
    "units of depth that nobody counts in": (camera(depth_scale=1e8), "it must be from 1 to 1e"),
    "principal point outside": (camera(cx=161.0), '"cx" is 161.0, outside of the 160 pixels of width'),
    "half a pixel": (camera(width=160.5), '"width" is 160.5, it must be a whole number'),
    "scale of nothing": (camera(depth_scale=float("nan")), '"depth_scale" must be a number'),
    "another size": (camera(width=162), "rgb.txt: line 2: "),
    "gray colour": (image("rgb/000002.png", WIDE.astype(np.uint8)), "rgb.txt: line 4: "),
    "8 bit depth": (image("depth/000002.png", WIDE.astype(np.uint8)), "it must have 1 channel of 16 bits"),
    "one image of another size": (image("depth/000003.png", WIDE), "depth.txt: line 5: "),
    "labels of another size": (image("label/000001.png", WIDE), "label/000001.png has 170x120 pixels"),
    "an image missing": (
        lambda folder: (folder / "rgb" / "000003.png").unlink(),
        "rgb.txt: line 5: ",
    ),
    "no camera": (lambda folder: (folder / "camera.json").unlink(), "camera.json is missing"),
    "no list": (lambda folder: (folder / "rgb.txt").unlink(), "rgb.txt is missing"),
    "binary list": (lambda folder: (folder / "rgb.txt").write_bytes(b"\xff\xfe\x00"), "readable text file"),
    "empty list": (list_changed("depth.txt", lambda lines: lines[:1]), "depth.txt: it names no image"),
    "six joints": (
        lambda folder: (folder / "joints.csv").write_text("0,1,2,3,4,5,6\n"),
        "joints.csv: line 1 holds 6 joint angles, the Panda has 7",
    ),
}


@pytest.mark.parametrize("what", BAD)
def test_bad_input_is_one_line_with_the_place_and_exit_code_2(recording, capsys, what):
    damage, message = BAD[what]
    damage(recording)
    assert main(["segment", str(recording), "--output", str(recording.parent / "out")]) == 2
    error = capsys.readouterr().err
    assert error.startswith("riseg: ")
    assert message in error
    assert error.count("\n") == 1


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (camera(cx=20.0), '"cx" is 20, far off the middle'),
        (camera(depth_scale=10.0), "the median depth is"),
        (camera(fy=300.0), '"fx" and "fy"'),
    ],
)
def test_what_is_unlikely_is_a_warning(recording, change, message):
    change(recording)
    reader = RecordingReader(recording)
    assert len(list(reader)) == 6
    assert any(message in warning for warning in reader.warnings)


def test_a_step_back_in_a_long_list_is_left_out_and_the_rest_is_read(recording):
    for name, file in (("rgb.txt", "rgb"), ("depth.txt", "depth")):
        stamps = [0.01 * k if k != 20 else 0.05 for k in range(40)]
        (recording / name).write_text("".join(f"{t} {file}/{k % 6:06d}.png\n" for k, t in enumerate(stamps)))
    (recording / "groundtruth.txt").unlink()
    reader = RecordingReader(recording)
    assert len(list(reader)) == 39
    assert {line.line for line in reader.left_out} == {21}


def test_a_pose_between_two_rows_is_between_them(recording):
    rows = ["0 0 0 0 0 0 0 1", "0.02 0.2 0 0 0 0 0.0871557 0.9961947"]
    (recording / "groundtruth.txt").write_text("\n".join(rows) + "\n")
    for name, file in (("rgb.txt", "rgb"), ("depth.txt", "depth")):
        (recording / name).write_text(f"0.005 {file}/000000.png\n")
    (frame,) = RecordingReader(recording)
    np.testing.assert_allclose(frame.X_WC[:3, 3], [0.05, 0, 0], atol=1e-9)
    assert np.degrees(np.arctan2(frame.X_WC[1, 0], frame.X_WC[0, 0])) == pytest.approx(2.5, abs=1e-4)


def test_colour_may_be_jpeg_and_a_jpeg_that_was_cut_off_is_left_out(recording):
    for path in sorted((recording / "rgb").glob("*.png")):
        cv2.imwrite(str(path.with_suffix(".jpg")), cv2.imread(str(path)))
        path.unlink()
    lines_of(recording / "rgb.txt", lambda lines: [line.replace(".png", ".jpg") for line in lines])
    cut = recording / "rgb" / "000003.jpg"
    cut.write_bytes(cut.read_bytes()[:-40])
    reader = RecordingReader(recording)
    assert len(list(reader)) == 5
    assert [line.line for line in reader.left_out] == [5]
    assert "PNG or JPEG" in reader.left_out[0].why


@pytest.mark.parametrize("name", ["rgb.txt", "depth.txt", "groundtruth.txt", "camera.json"])
def test_a_mark_at_a_files_beginning_and_line_ends_of_windows_do_no_harm(recording, name):
    path = recording / name
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes().replace(b"\n", b"\r\n"))
    assert len(list(RecordingReader(recording))) == 6


def resized(content, width, height):
    """A PNG whose header claims another size, with a right check sum."""
    head = content[12:16] + struct.pack(">II", width, height) + content[24:29]
    return content[:12] + head + struct.pack(">I", zlib.crc32(head)) + content[33:]


@pytest.mark.parametrize("name", ["rgb/000001.png", "depth/000001.png", "label/000001.png"])
def test_an_image_that_claims_20000_pixels_is_refused_by_its_header(recording, name, monkeypatch):
    path = recording / name
    path.write_bytes(resized(path.read_bytes(), 20000, 20000))
    monkeypatch.setattr("cv2.imdecode", lambda *_: pytest.fail("it is decoded"))
    with pytest.raises(RecordingError, match="has 20000x20000 pixels"):
        RecordingReader(recording)


def test_a_jpeg_of_another_size_is_not_decoded(recording, monkeypatch):
    image = np.zeros((600, 800, 3), np.uint8)
    (recording / "rgb" / "000000.jpg").write_bytes(cv2.imencode(".jpg", image)[1].tobytes())
    lines_of(recording / "rgb.txt", lambda lines: [line.replace("000000.png", "000000.jpg") for line in lines])
    reader = RecordingReader(recording)
    monkeypatch.setattr("cv2.imdecode", lambda *_: pytest.fail("it is decoded"))
    with pytest.raises(RecordingError, match="has 800x600 pixels"):
        next(iter(reader))


@pytest.mark.parametrize("name", ["rgb.txt", "depth.txt", "groundtruth.txt", "camera.json"])
@pytest.mark.parametrize("kind", ["pipe", "device"])
def test_a_pipe_or_a_device_in_the_place_of_a_file_is_one_line(recording, name, kind):
    (recording / name).unlink()
    if kind == "pipe":
        os.mkfifo(recording / name)
    else:
        (recording / name).symlink_to("/dev/zero")
    with pytest.raises(RecordingError, match=f"{name} is a {kind}, not a file"):
        RecordingReader(recording, follow=True)


@pytest.mark.parametrize("name", ["scenario.yaml", "run.json"])
def test_a_pipe_in_the_place_of_a_runs_settings_is_one_line(recording, capsys, name):
    os.mkfifo(recording / name)
    assert main(["segment", str(recording), "--output", str(recording.parent / "out")]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_a_file_name_of_5000_characters_is_a_missing_image(recording):
    lines_of(recording / "rgb.txt", lambda lines: [*lines[:3], f"0.133 {'a' * 5000}.png", *lines[4:]])
    with pytest.raises(RecordingError, match=r"line 4: .*a\.png is missing"):
        RecordingReader(recording)


@pytest.mark.parametrize("name", ["groundtruth.txt", "camera.json", "rgb/000002.png", "label/000002.png"])
def test_a_link_that_leads_out_of_the_recording_is_followed_on_request_only(recording, name):
    elsewhere = recording.parent / "elsewhere"
    (recording / name).rename(elsewhere)
    (recording / name).symlink_to(elsewhere)
    with pytest.raises(RecordingError, match=r"leads out of .*recording; --follow allows that"):
        RecordingReader(recording)
    assert len(list(RecordingReader(recording, follow=True))) == 6


@pytest.mark.parametrize("path", ["/etc/hostname", "../elsewhere.png", "{parent}/elsewhere.png"])
def test_a_path_that_leads_out_of_the_recording_is_refused(recording, path):
    (recording.parent / "elsewhere.png").write_bytes((recording / "rgb" / "000000.png").read_bytes())
    path = path.format(parent=recording.parent)
    lines_of(recording / "rgb.txt", lambda lines: [*lines[:3], f"0.133 {path}", *lines[4:]])
    with pytest.raises(RecordingError, match=r"rgb\.txt: line 4: .* leads out of"):
        RecordingReader(recording)


def test_a_recording_behind_a_link_is_a_recording(recording):
    link = recording.parent / "link"
    link.symlink_to(recording)
    assert len(list(RecordingReader(link))) == 6


@pytest.mark.parametrize("name", ["groundtruth.txt", "joints.csv"])
def test_a_list_that_is_a_link_to_nothing_is_missing(recording, name):
    (recording / name).unlink(missing_ok=True)
    (recording / name).symlink_to("gone")
    with pytest.raises(RecordingError, match=f"{name} is missing"):
        RecordingReader(recording)


@pytest.mark.parametrize("kind", ["file", "link"])
def test_robot_masks_that_are_no_folder_are_not_passed_over(recording, kind):
    shutil.rmtree(recording / "robot", ignore_errors=True)
    if kind == "file":
        (recording / "robot").write_text("")
    else:
        (recording / "robot").symlink_to("gone")
    with pytest.raises(RecordingError, match=r"robot is no folder of images; make it one or take it away"):
        RecordingReader(recording).holds_images("robot")
