import json
from dataclasses import replace

import cv2
import numpy as np
import pytest

from riseg_drake.app.cli import main
from riseg_drake.app.run.interactions import interactions
from riseg_drake.app.segment import command as module
from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.recording.reader import RecordingReader
from tests.recording.made_recordings import SMALL, drawn_frames, write

MODEL = """<robot name="gantry"><link name="base"/><link name="hand"><visual><origin xyz="0 -0.1 0.1"/>
<geometry><box size="0.02 0.02 0.02"/></geometry></visual></link>
<joint name="x" type="prismatic"><parent link="base"/><child link="hand"/><axis xyz="1 0 0"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
<link name="eye"/><joint name="mount" type="fixed"><parent link="hand"/><child link="eye"/>
<origin xyz="0 0 0.45" rpy="3.14159265 0 0"/></joint></robot>"""


@pytest.fixture(scope="module")
def pushed():
    return drawn_frames(8)


@pytest.fixture
def recording(tmp_path, pushed):
    return write(tmp_path / "recording", pushed)


def segment(recording, *more):
    output = recording.parent / "out"
    assert main(["segment", str(recording), "--output", str(output), "--overwrite", *more]) == 0
    return output, json.loads((output / "summary.json").read_text())


def masks(output):
    return {p.name: cv2.imread(str(p), cv2.IMREAD_UNCHANGED) for p in sorted((output / "mask").iterdir())}


def test_every_frame_gets_a_mask_and_a_place_in_the_video_and_a_score(recording):
    output, summary = segment(recording)
    found = masks(output)
    assert list(found) == [f"{k:06d}.png" for k in range(8)]
    assert all(mask.dtype == np.uint16 and mask.shape == SMALL.shape for mask in found.values())
    assert not found["000000.png"].any()
    truth = cv2.imread(str(recording / "label" / "000007.png"), cv2.IMREAD_UNCHANGED) == 1
    last = found["000007.png"] > 0
    assert np.count_nonzero(last & truth) / np.count_nonzero(last | truth) > 0.8
    video = cv2.VideoCapture(str(output / "overlay.mp4"))
    assert int(video.get(cv2.CAP_PROP_FRAME_COUNT)) == 8
    assert "Done: all frames were read." in (output / "report.html").read_text()
    assert summary["state"] == "done"
    assert (summary["frames"], summary["objects"], summary["left_out"]) == (8, 1, [])
    assert len((output / "scores.csv").read_text().splitlines()) == 9
    assert summary["scores_last"]["obj_gt"] == 2


def test_pictures_of_the_video_are_files_where_that_is_asked_for(recording):
    output, _ = segment(recording)
    assert not (output / "overlay").exists()
    output, _ = segment(recording, "--overlay")
    pictures = sorted((output / "overlay").iterdir())
    assert [p.name for p in pictures] == sorted(masks(output))
    color = cv2.imread(str(recording / "rgb" / "000007.png"))
    shown, mask = cv2.imread(str(pictures[-1])), masks(output)["000007.png"]
    # As the camera saw it, but for what is tinted, and the outline around that.
    beside = cv2.dilate((mask > 0).astype(np.uint8), np.ones((9, 9))) == 0
    assert np.array_equal(shown[beside], color[beside])
    assert np.mean((shown != color).any(2)[mask > 0]) > 0.9


@pytest.mark.renders
def test_without_poses_the_camera_stands_still_and_the_masks_are_the_same(recording):
    with_poses = masks(segment(recording)[0])
    (recording / "groundtruth.txt").unlink()
    output, summary = segment(recording)
    assert summary["camera_poses"] == "fixed camera"
    for name, mask in masks(output).items():
        np.testing.assert_array_equal(mask, with_poses[name])


def test_robot_masks_of_the_recording_are_never_objects(tmp_path, pushed):
    robot = pushed[-1].labels == 1
    frames = [replace(frame, robot=robot) for frame in pushed]
    output, summary = segment(write(tmp_path / "recording", frames))
    assert summary["robot_pixels"] == "robot/"
    assert not any(mask[robot].any() for mask in masks(output).values())


@pytest.mark.renders
def test_a_robot_of_ones_own_says_where_its_camera_is(tmp_path, pushed):
    (tmp_path / "gantry.urdf").write_text(MODEL)
    frames = [replace(frame, X_WC=None, position=np.zeros(1)) for frame in pushed]
    write(tmp_path / "recording", frames)
    lines = (tmp_path / "recording" / "joints.csv").read_text().splitlines()
    (tmp_path / "recording" / "joints.csv").write_text("\n".join(["timestamp,x", *lines[1:]]) + "\n")
    robot = ["--robot", str(tmp_path / "gantry.urdf"), "--camera-frame", "eye"]
    output, summary = segment(tmp_path / "recording", *robot)
    assert summary["camera_poses"] == summary["robot_pixels"] == "joints.csv"
    assert summary["objects"] == 1
    assert main(["segment", str(tmp_path / "recording"), "--output", str(output), *robot[:3], "nose"]) == 2


@pytest.mark.parametrize(
    ("size", "rate"),
    [
        pytest.param((141, 107), 30.0, id="odd"),
        pytest.param((212, 120), 6.0, id="wide", marks=pytest.mark.renders),
        pytest.param((320, 180), 60.0, id="fast", marks=pytest.mark.renders),
    ],
)
def test_any_size_and_rate_works(tmp_path, size, rate):
    width, height = size
    camera = Intrinsics(width, height, 0.96 * width, 0.96 * width, width / 2 - 1, height / 2 + 1)
    recording = write(tmp_path / "recording", drawn_frames(7, camera, rate), camera)
    output, summary = segment(recording)
    assert summary["objects"] == 1
    assert summary["rate_hz"] == pytest.approx(rate, rel=0.01)
    assert all(mask.shape == (height, width) for mask in masks(output).values())


def test_a_damaged_frame_is_left_out_and_reported(recording, capsys):
    damaged = recording / "rgb" / "000004.png"
    damaged.write_bytes(damaged.read_bytes()[:-40])
    output, summary = segment(recording)
    assert list(masks(output)) == [f"{k:06d}.png" for k in range(8) if k != 4]
    (left_out,) = summary["left_out"]
    assert left_out["line"] == 6
    assert "000004.png is not a readable PNG" in left_out["why"]
    assert "rgb.txt: line 6 is left out" in capsys.readouterr().out


def test_a_frame_without_a_table_is_left_out_and_the_next_one_counts(recording):
    write_png = cv2.imwrite
    write_png(str(recording / "depth" / "000003.png"), np.zeros(SMALL.shape, np.uint16))
    output, summary = segment(recording)
    assert [entry["line"] for entry in summary["left_out"]] == [5]
    assert "no plane" in summary["left_out"][0]["why"]
    assert masks(output)["000007.png"].any()


def test_ctrl_c_leaves_whole_files_and_a_summary(recording, monkeypatch, capsys):
    taken = []

    def stop(*arguments):
        taken.append(arguments)
        if len(taken) == 4:
            raise KeyboardInterrupt
        return take(*arguments)

    take = module._take
    monkeypatch.setattr(module, "_take", stop)
    output = recording.parent / "out"
    assert main(["segment", str(recording), "--output", str(output)]) == 130
    assert capsys.readouterr().err == f"riseg: stopped; 3 masks in {output}\n"
    summary = json.loads((output / "summary.json").read_text())
    assert (summary["state"], summary["frames"]) == ("interrupted", 3)
    assert len(masks(output)) == 3
    assert int(cv2.VideoCapture(str(output / "overlay.mp4")).get(cv2.CAP_PROP_FRAME_COUNT)) == 3
    left = {"summary.json", "mask", "overlay.mp4", "scores.csv", "report.html"}
    assert {path.name for path in output.iterdir()} == left


def test_an_output_folder_with_other_things_is_left_alone(recording, capsys):
    assert main(["segment", str(recording), "--output", str(recording)]) == 2
    assert "holds no earlier segmentation" in capsys.readouterr().err
    assert (recording / "rgb.txt").is_file()


@pytest.mark.renders
def test_the_same_recording_gives_the_same_masks_again(recording):
    first = masks(segment(recording)[0])
    for name, mask in masks(segment(recording)[0]).items():
        np.testing.assert_array_equal(mask, first[name])


@pytest.mark.renders
def test_a_recorded_run_gives_the_masks_of_the_run_bit_for_bit_in_every_frame(
    small_scenario, tmp_path, monkeypatch
):
    run, seen = tmp_path / "run", {}

    def listening(diagram, clock, progress, longest, listeners):
        def keep(frame, context):
            seen[frame.time] = diagram.mask(context).copy()

        yield from interactions(diagram, clock, progress, longest, (*listeners, keep))

    monkeypatch.setattr("riseg_drake.app.run.command.interactions", listening)
    assert main(["run", str(small_scenario), "--seed", "1", "--record", "--output", str(run)]) == 0
    output = tmp_path / "out"
    assert main(["segment", str(run / "recording"), "--output", str(output)]) == 0
    found = masks(output)
    times = [frame.time for frame in RecordingReader(run / "recording")]
    assert times == list(seen)
    for mask, time in zip(found.values(), times, strict=True):
        np.testing.assert_array_equal(mask, seen[time])
    assert any(mask.any() for mask in seen.values())


def test_what_is_doubted_is_a_warning_and_an_error_if_asked_for(recording, capsys):
    camera = json.loads((recording / "camera.json").read_text())
    (recording / "camera.json").write_text(json.dumps({**camera, "depth_scale": 1250}))
    _, summary = segment(recording)
    (line,) = (warning for warning in summary["warnings"] if "is the unit of no camera" in warning)
    assert capsys.readouterr().out.count(line) == 1
    output = recording.parent / "strict"
    assert main(["segment", str(recording), "--output", str(output), "--strict"]) == 2
    assert line in capsys.readouterr().err
    assert not output.exists()


def test_a_right_recording_is_not_doubted(recording):
    _, summary = segment(recording, "--strict")
    assert summary["warnings"] == []
    assert summary["frames_with"] == {"depth": 8, "pose": 8, "label": 8}


def test_robot_masks_that_are_named_otherwise_are_said_and_not_claimed(tmp_path, pushed):
    frames = [replace(frame, robot=np.zeros(SMALL.shape, bool)) for frame in pushed]
    recording = write(tmp_path / "recording", frames)
    for path in (recording / "robot").iterdir():
        path.rename(path.with_name(f"robot of {path.name}"))
    _, summary = segment(recording)
    assert summary["robot_pixels"] == "none"
    assert summary["frames_with"]["robot mask"] == 0
    assert any(line.startswith("robot/ is not used") for line in summary["warnings"])
