import json

import numpy as np
import pytest
from pydrake.lcm import DrakeLcm
from rich.console import Console

from riseg_drake.app.cli import main
from riseg_drake.app.hardware.drivers import HardwareError
from riseg_drake.app.hardware.hand_eye import _Collector, _outlines_told, _postures, _postures_in_view
from riseg_drake.app.output_folder import SUMMARY
from riseg_drake.app.scenario import HARDWARE, load_scenario
from riseg_drake.app.work_state import RunStoppedError
from riseg_drake.geometry.rgbd import Frame
from riseg_drake.geometry.se3 import exp_se3
from riseg_drake.robot.description import PandaDescription
from riseg_drake.robot.kinematics import READY, PandaKinematics, observation_posture
from riseg_drake.robot.silhouette import RobotSilhouette
from riseg_drake.segmentation.outline_error import LEAST
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


IN_FRONT = [1.0303, 0.0, 0.5503, -2.3562, 0.0, 1.5708]


@pytest.fixture(scope="module")
def watched():
    """Station, arm and postures [7] of the check before a fixed camera, the first out of its view."""
    config = load_scenario(None, HARDWARE).hardware
    config.camera.mount, config.camera.X_WC = "world", IN_FRONT
    kinematics = PandaKinematics(config.panda, config.camera.fixed_pose)
    return config, kinematics, _postures_in_view(kinematics, config)


def test_before_a_fixed_camera_the_arm_shows_itself_over_the_work_area(watched):
    config, kinematics, (waiting, *shown) = watched
    np.testing.assert_array_equal(waiting, observation_posture(kinematics, config.centre_W, 0.5))
    tips = np.array([kinematics.X_WE(q)[:3, 3] for q in shown])
    expected = [[0.5, 0, 0.1], [0.55, 0.12, 0.1], [0.55, -0.12, 0.1], [0.42, 0, 0.1]]
    np.testing.assert_allclose(tips, expected, atol=1e-9)
    silhouette = RobotSilhouette(kinematics, config.camera.intrinsics)
    base = silhouette.mask(waiting)  # which is in the picture, too
    for q in shown:
        assert np.count_nonzero(silhouette.mask(q) & ~base) > 1.5 * LEAST * base.size


@pytest.fixture(scope="module")
def drawn(watched):
    """The arm's pixels [H, W] in each of these postures, as it is drawn."""
    config, kinematics, postures = watched
    silhouette = RobotSilhouette(kinematics, config.camera.intrinsics, 0, 0)
    return [silhouette.mask(q) for q in postures]


@pytest.mark.parametrize(("turned", "words"), [(0.0, "good"), (0.005, "usable"), (0.02, "bad")])
def test_a_fixed_camera_that_is_turned_is_found_out_by_the_arms_outline(turned, words, capsys, watched, drawn):
    config, kinematics, postures = watched
    # About the camera's y axis: to the right the arm is seen further left, by f tan(angle).
    X_WC = kinematics.fixed_camera @ exp_se3(np.array([0, turned, 0, 0, 0, 0]))
    intrinsics = config.camera.intrinsics
    really = RobotSilhouette(PandaKinematics(PandaDescription(), X_WC), intrinsics, 0, 0)
    color = np.full((*intrinsics.shape, 3), 90, np.uint8)
    frames = []
    for q, robot in zip(postures, drawn, strict=True):  # the arm is 0.3 m before a wall
        depth = np.where(really.mask(q), 0.7, 1.0).astype(np.float32)
        frames.append(Frame(0, 0.0, intrinsics, color, depth, kinematics.X_WC(q), robot))
    told, pictures, name = _outlines_told(frames, Console())
    assert name == "outline"
    assert len(pictures) == told["pictures"] == 4
    assert told["shift_px"][0] == pytest.approx(-config.camera.fx * np.tan(turned), abs=0.8)
    assert f"): {words}" in " ".join(capsys.readouterr().out.split())
