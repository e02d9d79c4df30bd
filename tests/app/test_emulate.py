"""Two processes on the real network; every wait ends with a message or with the deadline of the test."""

import json
import os
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from dataclasses import fields
from multiprocessing import Pipe

import numpy as np
import pytest
from drake import lcmt_image_array, lcmt_panda_command, lcmt_panda_status
from pydrake.lcm import DrakeLcm

from riseg_drake.app import emulate
from riseg_drake.app.cli import main
from riseg_drake.stations.ground_truth import LABEL_CHANNEL, decode_labels
from riseg_drake.stations.lcm_images import decode_images
from riseg_drake.stations.misbehaviour import CONTROL_CHANNEL
from riseg_drake.stations.motion_judge import MotionVerdict
from riseg_drake.stations.panda_robot import MOVE

DEADLINE = 60.0  # s, for anything that is waited for


class Client:
    """What stands on the other side of the network."""

    def __init__(self, url):
        self.lcm = DrakeLcm(url)
        self.statuses = self.pictures = 0
        self.status = self.picture = self.labels = None
        self.lcm.Subscribe("PANDA_STATUS", self._on_status)
        self.lcm.Subscribe("DRAKE_RGBD_CAMERA_IMAGES_emulated", self._on_picture)
        self.lcm.Subscribe(LABEL_CHANNEL, self._on_labels)

    def _on_status(self, raw):
        self.status = lcmt_panda_status.decode(raw)
        self.statuses += 1

    def _on_picture(self, raw):
        self.picture = lcmt_image_array.decode(raw)
        self.pictures += 1

    def _on_labels(self, raw):
        self.labels = lcmt_image_array.decode(raw)

    def until(self, condition, each_time=lambda: None):
        deadline = time.monotonic() + DEADLINE
        while not condition():
            assert time.monotonic() < deadline, "nothing came before the deadline"
            each_time()
            self.lcm.HandleSubscriptions(5)

    def until_more(self, what):
        """Of `pictures` or `statuses`."""
        before = getattr(self, what)
        self.until(lambda: getattr(self, what) > before)

    def until_silent(self, each_time):
        """No status has come for half a second of this process; `each_time` is done meanwhile."""
        still = 0

        def is_silent():
            nonlocal still
            still = still + 1 if self.statuses == self._before else 0
            self._before = self.statuses
            return still > 100

        self._before = self.statuses
        self.until(is_silent, each_time)

    def command(self, q, mode=1):
        message = lcmt_panda_command()
        message.utime, message.control_mode_expected = int(1e6 * time.time()), mode
        message.num_joint_position, message.joint_position = 7, list(q)
        self.lcm.Publish("PANDA_COMMAND", message.encode())

    def move(self, dq, speed=0.04):
        """Move all joints by dq, rad, slowly; from anew where this process was kept waiting."""
        goal = np.array(self.status.joint_position_desired) + dq
        q, last, v = np.array(self.status.joint_position_desired), time.time(), 0.0

        def step():
            nonlocal q, last, v
            gap, last = time.time() - last, time.time()
            if gap > 0.05:
                q, v = np.array(self.status.joint_position_desired), 0.0
                gap = 0.005
            v = min(speed, v + 0.5 * gap, np.sqrt(2 * 0.5 * np.abs(goal - q).max()))
            q = q + np.clip(goal - q, -v * gap, v * gap)
            self.command(q)

        self.until(lambda: np.abs(np.array(self.status.joint_position) - goal).max() < 1e-3, step)


@pytest.fixture
def emulator(tmp_path):
    """A running `riseg emulate`, a client, and the scenario of both; alone on a port of their own."""
    url = f"udpm://239.255.76.67:{20000 + os.getpid() % 20000}?ttl=0&recv_buf_size=4194304"
    scenario = tmp_path / "one_toy.yaml"
    scenario.write_text(
        "station: {scene: {count_min: 1, count_max: 1}}\n"
        f"emulator: {{lcm: {{url: '{url}'}}, driver: {{control_mode: position}}, rate: 5.0}}\n"
    )
    client = Client(url)
    process = subprocess.Popen(
        [
            *(sys.executable, "-m", "riseg_drake", "emulate", str(scenario)),
            *("--fault", "images duplicate 0.2", "--judge", str(tmp_path / "verdict.json")),
        ],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        yield client, process, scenario
    finally:
        process.kill()
        process.communicate()


@pytest.mark.renders
def test_a_client_moves_the_arm_sees_pictures_and_is_taught_manners(emulator):
    client, process, scenario = emulator
    client.until(lambda: client.status and client.picture and client.labels)
    images = decode_images(client.picture)
    assert images.color.shape == (480, 848, 3)
    assert (images.depth > 0).mean() > 0.8
    assert decode_labels(client.labels).labels.max() == 1
    assert images.time == pytest.approx(client.status.utime * 1e-6, abs=DEADLINE)

    assert client.status.robot_mode == MOVE
    client.move(np.full(7, 0.02))
    assert client.status.robot_mode == MOVE
    q = client.status.joint_position_desired
    for spoil in (lambda: client.command(np.zeros(7)), lambda: client.command(q, mode=2)):
        client.until_silent(spoil)
        client.until_more("pictures")  # the world goes on
        assert main(["emulate", str(scenario), "--say", "start"]) == 0
        client.until_more("statuses")
        assert client.status.robot_mode == MOVE

    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=DEADLINE)
    said = " ".join(out.split())
    assert (process.returncode, err) == (0, "")
    assert "exit code 0: reflex joint_motion_generator_velocity_discontinuity" in said
    assert "exit code 0: control_mode_expected is 2, but the driver runs with --control_mode=position" in said
    assert "acceleration" in said
    verdict = json.loads((scenario.parent / "verdict.json").read_text())
    assert set(verdict) == {field.name for field in fields(MotionVerdict)}
    assert verdict["seconds"] > 0.3  # 0.02 rad at 0.04 rad/s
    assert 0 < verdict["acceleration_rms"] < verdict["acceleration_largest"] <= 1 + 1e-9


@pytest.mark.renders
@pytest.mark.parametrize("told", [signal.SIGINT, signal.SIGTERM])
def test_ctrl_c_or_kill_ends_both_processes_and_says_the_rates(emulator, told):
    client, process, _ = emulator
    client.until(lambda: client.pictures > 1)
    process.send_signal(told)
    out, err = process.communicate(timeout=DEADLINE)
    assert process.returncode == 0
    assert err == ""
    assert "status at" in out
    assert "pictures at" in out


@pytest.mark.renders
def test_a_scene_that_cannot_be_is_said_once_in_one_line(tmp_path):
    scenario = tmp_path / "none.yaml"
    scenario.write_text("station: {scene: {count_min: 0}}\n")
    ended = subprocess.run(
        [sys.executable, "-m", "riseg_drake", "emulate", str(scenario)], capture_output=True, text=True
    )
    assert ended.returncode == 2
    where = f"{scenario}: line 1: station.scene."
    assert ended.stderr == f"riseg: {where}count_min, count_max: 0, 6; expected 1 <= min <= max\n"


@pytest.mark.parametrize("option", ["--say", "--fault"])
def test_an_unknown_word_is_refused_with_those_that_are_known(option, capsys):
    assert main(["emulate", option, "dance"]) == 2
    error = capsys.readouterr().err
    assert "'dance' is not known to the emulator; it knows images|status drop" in error
    assert error.count("\n") == 1


def test_a_word_is_said_on_the_control_channel(tmp_path):
    url = f"udpm://239.255.76.67:{40000 + os.getpid() % 20000}?ttl=0"
    scenario = tmp_path / "s.yaml"
    scenario.write_text(f"emulator: {{lcm: {{url: '{url}'}}}}\n")
    lcm, heard = DrakeLcm(url), []
    lcm.Subscribe(CONTROL_CHANNEL, heard.append)
    lcm.HandleSubscriptions(0)
    assert main(["emulate", str(scenario), "--say", "images drop 0.1"]) == 0
    lcm.HandleSubscriptions(1000)
    assert heard == [b"images drop 0.1"]


def test_a_camera_that_has_died_is_one_line(monkeypatch, capsys):
    here, there = Pipe()
    there.close()

    @contextmanager
    def dead(*_):
        yield here

    monkeypatch.setattr(emulate, "_camera_process", dead)
    monkeypatch.setattr(emulate, "_place", lambda *_: None)
    assert main(["emulate"]) == 2
    error = capsys.readouterr().err
    assert error.startswith("riseg: the process that draws the camera's pictures has died")
    assert error.count("\n") == 1
