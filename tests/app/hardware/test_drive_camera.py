"""`riseg drive-camera`: what is heard of a file, its pace, and the lines for the scenario."""

import os
import re
import subprocess
import sys
import threading
from dataclasses import replace

import numpy as np
import pytest
from pydrake.lcm import DrakeLcm

pytest.importorskip("rosbags", reason="rosbags is not installed: pip install 'riseg-drake[bags]'")
pytest.importorskip(
    "pyrealsense2",
    reason="no librealsense: pip install 'riseg-drake[realsense]', apt-get install libusb-1.0-0",
    exc_type=ImportError,
)

from riseg_drake.app.cli import main
from riseg_drake.app.hardware.drive_camera import Film, on_the_wall, publish, scenario_lines, unlike
from riseg_drake.app.scenario import Scenario
from riseg_drake.app.scenario_file import parse_scenario
from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.geometry.se3 import translation
from riseg_drake.stations.hardware import HardwareCameraConfig
from riseg_drake.stations.lcm_images import decode_images, decode_message
from tests.recording.made_realsense import EPOCH, RealSenseKind, aligned_by_librealsense, record
from tests.recording.make_realsense_bag import BAG, COLOR, DEPTH, patterns

COUNT = 25
BESIDE = translation(np.array([0.015, 0.0003, -0.0002]))
CHANNEL = "DRAKE_RGBD_CAMERA_IMAGES_emulated"


def film(count=COUNT):
    """Even colours, which JPEG keeps, and millimetres that change from frame to frame."""
    color, depth = next(iter(patterns()))
    return [(np.full_like(color, 8 * k), (depth // 10 + k).astype(np.uint16)) for k in range(count)]


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    return record(tmp_path_factory.mktemp("film") / "film.db3", RealSenseKind(COLOR, DEPTH, BESIDE), film())


def heard(messages):
    return [decode_images(decode_message(data), (COLOR.width, COLOR.height)) for data in messages]


def check(images, file):
    """Each is the frame of its number, with librealsense's own aligned depth to the millimetre."""
    right = aligned_by_librealsense(file, COUNT)
    for image in images:
        color, depth = right[image.sequence - 1]
        np.testing.assert_array_equal(np.rint(image.depth * 1000), depth)
        assert np.abs(image.color.astype(int) - color).max() <= 2
    assert all((depth > 0).mean() > 0.7 for _, depth in right)


def test_every_frame_of_a_file_is_heard_with_the_depth_that_librealsense_aligns(file):
    lcm, messages, now = DrakeLcm("memq://"), [], [1000.0]
    lcm.Subscribe(CHANNEL, messages.append)
    waits = []

    def wait(seconds):
        waits.append(seconds)
        now[0] += seconds

    shots = on_the_wall(Film(file).shots(), True, lambda: now[0], wait)
    for number in publish(shots, lcm, CHANNEL, lambda: now[0] + 0.004):
        lcm.HandleSubscriptions(0)
        assert number == len(messages)
    images = heard(messages)
    check(images, file)
    assert len(images) == COUNT
    # At the pace of the film, from now on: ten a second.
    np.testing.assert_allclose(waits, [0.0, *[0.1] * (COUNT - 1)], atol=1e-6)
    np.testing.assert_allclose([i.time for i in images], 1000 + np.arange(COUNT) / 10, atol=1.1e-3)
    assert [i.sequence for i in images] == list(range(1, COUNT + 1))


def test_a_bag_that_is_older_is_played_too():
    shots = list(Film(BAG).shots())
    assert [s.color[5, 7, 0] for s in shots] == [color[5, 7, 0] for color, _ in patterns()]
    assert all(0.45 < np.median(s.depth[s.depth > 0]) < 0.6 for s in shots)
    assert shots[0].time == pytest.approx(EPOCH, abs=1e-5)


def test_a_camera_is_stamped_as_it_says_or_by_the_computer_where_its_clock_is_its_own():
    (shot,) = list(Film(BAG).shots())[:1]
    for by_wall, expected in ((True, shot.time), (False, 77.0)):
        ((time, _),) = on_the_wall(iter([replace(shot, by_wall=by_wall)]), False, lambda: 77.0, pytest.fail)
        assert time == expected


def test_the_printed_lines_are_the_scenario_of_that_camera():
    k = Intrinsics(1280, 720, 912.125, 911.5, 640.25, 361.75)
    camera = parse_scenario(scenario_lines(k), Scenario, "the lines").hardware.camera
    assert replace(camera, width=0).intrinsics == k
    assert unlike(camera, k) == []
    assert unlike(HardwareCameraConfig(), replace(k, width=848, height=480, fx=616.0)) == [
        "the scenario has fy: 615.778, the camera 911.5; take the lines below",
        "the scenario has cx: 405.418, the camera 640.25; take the lines below",
        "the scenario has cy: 232.864, the camera 361.75; take the lines below",
    ]


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("none.bag", "is not there; expected a file with .bag or .db3 or .mcap"),
        ("text.db3", "no bag that can be read"),
    ],
)
def test_what_is_no_recording_is_said_in_one_line(tmp_path, capsys, name, words):
    (tmp_path / "text.db3").write_text("a text")
    assert main(["drive-camera", "--file", str(tmp_path / name)]) == 2
    said = capsys.readouterr().err.strip()
    assert words in said
    assert "\n" not in said


def test_without_a_camera_or_without_the_library_the_remedy_is_said_in_one_line(capsys, monkeypatch):
    import pyrealsense2 as rs

    if len(rs.context().query_devices()):
        pytest.skip("a RealSense camera is plugged in")
    assert main(["drive-camera"]) == 2
    assert "plug it into a USB 3 port" in capsys.readouterr().err
    monkeypatch.setitem(sys.modules, "pyrealsense2", None)
    for more in ([], ["--file", str(BAG)]):
        assert main(["drive-camera", *more]) == 2
        said = capsys.readouterr().err.strip()
        assert "pip install 'riseg-drake[realsense]'" in said
        assert "\n" not in said


@pytest.mark.renders
def test_the_program_publishes_a_whole_file_on_the_network_of_this_machine(tmp_path, file):
    """On a multicast group of its own.

    UDP may lose pictures where a machine is busy and its buffer small, so each is told by its number.
    """
    url = f"udpm://239.255.76.67:{20000 + os.getpid() % 20000}?ttl=0&recv_buf_size=4194304"
    scenario = tmp_path / "robot.yaml"
    scenario.write_text(f'station: !HardwareStationConfig\n  lcm: {{url: "{url}", camera_serial: "42"}}\n')
    lcm, messages, over = DrakeLcm(url), [], threading.Event()
    lcm.Subscribe("DRAKE_RGBD_CAMERA_IMAGES_42", messages.append)

    def listen():
        while not over.is_set() or lcm.HandleSubscriptions(0):
            lcm.HandleSubscriptions(20)

    listener = threading.Thread(target=listen)
    listener.start()
    program = [sys.executable, "-m", "riseg_drake", "drive-camera", str(scenario), "--file", str(file)]
    said = subprocess.run(program, capture_output=True, text=True, timeout=120)
    over.set()
    listener.join()
    assert said.returncode == 0, said.stderr
    assert "DRAKE_RGBD_CAMERA_IMAGES_42" in said.stdout
    assert re.search(rf"^{COUNT} pictures in", said.stdout, re.M)
    assert f"fx: {COLOR.fx:.3f}" in said.stdout
    images = heard(messages)
    numbers = [i.sequence for i in images]
    assert numbers == sorted(set(numbers)), "each once, and in order"
    assert len(numbers) > COUNT / 2
    check(images, file)
