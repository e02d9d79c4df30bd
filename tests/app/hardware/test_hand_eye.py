import json

import numpy as np
import pytest
from pydrake.lcm import DrakeLcm

from riseg_drake.app.cli import main
from riseg_drake.app.hardware.drivers import HardwareError
from riseg_drake.app.hardware.hand_eye import _Collector, _postures
from riseg_drake.app.output_folder import SUMMARY
from riseg_drake.app.scenario import HARDWARE, load_scenario
from riseg_drake.app.work_state import RunStoppedError
from riseg_drake.robot.kinematics import READY, PandaKinematics
from riseg_drake.stations.even_clock import EvenClock
from riseg_drake.stations.ideal_arm import status_message
from riseg_drake.stations.lcm_images import encode_images
from riseg_drake.stations.lcm_reception import Reception

START = 1_790_000_000.0


def test_every_picture_is_kept_once_with_the_cameras_pose_of_its_own_time():
    now = START
    config = load_scenario(None, HARDWARE).hardware
    config.camera.latency = 0.04
    kinematics, lcm = PandaKinematics(config.panda), DrakeLcm("memq://")
    reception = Reception(lcm, config.lcm, clock=EvenClock(lambda: now, lambda: now))
    collector = _Collector(reception, config.camera, kinematics)
    for now in np.arange(START, START + 0.5, 0.01):
        lcm.Publish(config.lcm.status_channel, status_message(now, READY + (now - START)).encode())
        reception.listen()
    color, depth = np.full((480, 848, 3), 90, np.uint8), np.full((480, 848), 0.5, np.float32)
    for taken in (START + 0.2, START + 0.3):
        message = encode_images(color, depth, taken, taken + 0.03, 0)
        lcm.Publish(config.lcm.image_channel, message.encode())
        reception.listen()
        for _ in range(2):
            collector.look()
    assert [frame.sequence for frame in collector.frames] == [0, 1]
    for frame, since in zip(collector.frames, (0.16, 0.26), strict=True):
        np.testing.assert_allclose(frame.X_WC, kinematics.X_WC(READY + since), atol=1e-5)
        assert frame.color.shape == (480, 640, 3)
        assert frame.robot.shape == (480, 640)


def test_the_arm_moves_by_four_centimetres_around_where_it_looks_from_and_back():
    config = load_scenario(None, HARDWARE).hardware
    kinematics = PandaKinematics(config.panda)
    tips = np.array([kinematics.X_WE(q)[:3, 3] for q in _postures(kinematics, config)])
    np.testing.assert_allclose(np.linalg.norm(tips[1:-1] - tips[0], axis=1), 0.04, atol=1e-6)
    np.testing.assert_allclose(tips[-1], tips[0], atol=1e-6)


@pytest.mark.parametrize(
    ("error", "code", "state", "words"),
    [
        (KeyboardInterrupt(), 130, "interrupted", "stopped; no verdict in {out}"),
        (HardwareError("nothing came"), 2, "failed", "nothing came"),
        (RunStoppedError("the arm was pushed"), 2, "stopped", "the arm was pushed"),
    ],
)
def test_a_check_that_does_not_come_to_its_end_says_so_in_its_summary(
    error, code, state, words, tmp_path, monkeypatch, capsys
):
    def wait(*_, **__):
        raise error

    monkeypatch.setattr("riseg_drake.app.hardware.hand_eye.wait_for_drivers", wait)
    scenario, out = tmp_path / "robot.yaml", tmp_path / "out"
    scenario.write_text('station: !HardwareStationConfig {lcm: {url: "memq://"}}\n')
    assert main(["hand-eye", str(scenario), "--yes", "--output", str(out)]) == code
    assert capsys.readouterr().err == f"riseg: {words.format(out=out)}\n"
    summary = json.loads((out / SUMMARY).read_text())
    assert (summary["command"], summary["state"]) == ("hand-eye", state)
    assert summary["end"] in (str(error), "stopped by the user")


def test_where_no_two_pictures_can_be_compared_the_check_has_failed(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("riseg_drake.app.hardware.hand_eye._watched_moves", lambda *_: [])
    scenario, out = tmp_path / "robot.yaml", tmp_path / "out"
    scenario.write_text('station: !HardwareStationConfig {lcm: {url: "memq://"}}\n')
    assert main(["hand-eye", str(scenario), "--yes", "--output", str(out)]) == 2
    assert "put patterned things on the table" in capsys.readouterr().err
    assert json.loads((out / SUMMARY).read_text())["state"] == "failed"
