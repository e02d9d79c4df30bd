"""Colour and depth by librealsense: of files that it recorded, since there is no camera here."""

from collections import deque
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip(
    "pyrealsense2",
    reason="no librealsense: pip install 'riseg-drake[realsense]', apt-get install libusb-1.0-0",
    exc_type=ImportError,
)

import pyrealsense2 as rs

from riseg_drake.geometry.lens import Lens
from riseg_drake.geometry.se3 import translation
from riseg_drake.stations import realsense
from riseg_drake.stations.realsense import (
    CameraDriverConfig,
    LibrealsenseAlignment,
    RealSenseCamera,
    RealSenseError,
    lens_of,
    opened_camera,
    set_up,
)
from tests.recording.made_realsense import (
    EPOCH,
    RealSenseKind,
    aligned_by_librealsense,
    realsense_intrinsics,
    record,
)
from tests.recording.make_realsense_bag import COLOR, DEPTH, X_CD, patterns

BESIDE = translation(np.array([0.015, 0.0003, -0.0002]))
"""A .db3 has six digits of it, and has turned cameras less exactly than X_CD is."""
KIND = RealSenseKind(COLOR, DEPTH, BESIDE, unit=0.0001)


def film(count=8):
    color, depth = next(iter(patterns()))
    return [(np.full_like(color, k), (depth + 50 * k).astype(np.uint16)) for k in range(count)]


@pytest.mark.parametrize(("X_CD", "share"), [(BESIDE, 1.0), (X_CD, 0.998)])
def test_depth_is_aligned_as_librealsense_aligns_what_it_plays(tmp_path, X_CD, share):
    frames = film()
    file = record(tmp_path / "film.db3", replace(KIND, X_CD=X_CD), frames)
    align = LibrealsenseAlignment(Lens(COLOR), Lens(DEPTH), X_CD, 0.0001)
    right = aligned_by_librealsense(file, 8)
    for (_, depth), (_, aligned) in zip(frames, right, strict=True):
        metres = align(depth.astype(np.float32) * np.float32(0.0001))
        assert np.mean(np.rint(metres * 10_000) == aligned) >= share
        assert (aligned > 0).mean() > 0.7


def test_a_camera_that_streams_gives_colour_aligned_depth_and_the_time_until_it_falls_silent(
    tmp_path, monkeypatch
):
    """Librealsense's pipeline on a file, each frame of which waits for the one before it to be taken."""
    monkeypatch.setattr(realsense, "PATIENCE", 1.0)
    file = record(tmp_path / "film.db3", KIND, film())
    right = aligned_by_librealsense(file, 8)
    config = rs.config()
    config.enable_device_from_file(str(file), False)
    config.resolve(rs.pipeline_wrapper(rs.pipeline())).get_device().as_playback().set_real_time(False)
    camera, shots = RealSenseCamera(config), []
    assert (camera.serial, camera.lens, camera.intrinsics) == (KIND.serial, Lens(COLOR), COLOR)
    with pytest.raises(RealSenseError, match=r"sent nothing for 1 s: is it still plugged in"):
        deque(map(shots.append, camera.shots()))
    assert len(shots) > 4
    for shot in shots:
        index = round((shot.time - EPOCH) * 10)
        assert shot.time == pytest.approx(EPOCH + index / 10, abs=1e-5)
        assert shot.by_wall
        assert index in range(8)
        np.testing.assert_array_equal(shot.color, right[index][0])
        np.testing.assert_array_equal(np.rint(shot.depth * 10_000), right[index][1])


def test_streams_that_a_camera_does_not_have_are_said(tmp_path):
    file, config = record(tmp_path / "film.db3", KIND, patterns()), rs.config()
    config.enable_device_from_file(str(file), False)
    config.enable_stream(rs.stream.depth, 1280, 720, rs.format.z16, 30)
    with pytest.raises(RealSenseError, match="rs-enumerate-devices lists the sizes"):
        RealSenseCamera(config)


@pytest.mark.parametrize("model", ["brown_conrady", "inverse_brown_conrady"])
def test_a_lens_is_opencvs(model):
    distortion = (0.1, -0.2, 0.001, 0.002, 0.05)
    lens = lens_of(realsense_intrinsics(COLOR, model, distortion))
    assert lens.intrinsics == COLOR
    np.testing.assert_allclose(lens.distortion, distortion, atol=1e-7)
    assert lens_of(realsense_intrinsics(COLOR)).is_pinhole
    with pytest.raises(RealSenseError, match="ftheta"):
        lens_of(realsense_intrinsics(COLOR, "ftheta", distortion))


def test_without_a_camera_the_remedy_is_said():
    if len(rs.context().query_devices()):
        pytest.skip("a RealSense camera is plugged in")
    with pytest.raises(RealSenseError, match="plug it into a USB 3 port"):
        opened_camera(None, (848, 480), CameraDriverConfig())


def test_without_librealsense_the_remedy_is_said(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "pyrealsense2", None)
    with pytest.raises(RealSenseError, match=r"pip install 'riseg-drake\[realsense\]'"):
        realsense.librealsense()


class Sensor:
    """Notes what it is told."""

    def __init__(self, stereo, lacks=(), moves=False):
        self.stereo, self.lacks, self.moves, self.told = stereo, lacks, moves, []

    def is_color_sensor(self):
        return not self.stereo and not self.moves

    def is_depth_sensor(self):
        return self.stereo

    def supports(self, option):
        return option.name not in self.lacks

    def set_option(self, option, value):
        self.told.append((option.name, value))


def test_settings_are_made_in_the_units_of_the_camera():
    stereo, color, motion = Sensor(True), Sensor(False), Sensor(False, moves=True)
    device = SimpleNamespace(query_sensors=lambda: [stereo, color, motion])
    config = CameraDriverConfig(
        color_exposure=0.0125, depth_exposure=0.0085, emitter=False, preset="high_accuracy"
    )
    assert set_up(device, config) == []
    assert stereo.told == [
        ("global_time_enabled", 1),
        ("visual_preset", 3),
        ("emitter_enabled", 0),
        ("enable_auto_exposure", 0),
        ("exposure", 8500),
    ]
    assert color.told == [("global_time_enabled", 1), ("enable_auto_exposure", 0), ("exposure", 125)]
    assert motion.told == []


def test_a_camera_with_one_sensor_takes_colours_exposure_by_it_and_what_it_lacks_is_named():
    only = Sensor(True, lacks=("emitter_enabled",))
    config = CameraDriverConfig(color_exposure=0.0125)
    assert set_up(SimpleNamespace(query_sensors=lambda: [only]), config) == ["emitter_enabled"]
    assert only.told[-1] == ("exposure", 12500)


def test_exposure_is_left_to_the_camera_where_none_is_given():
    color = Sensor(False)
    set_up(SimpleNamespace(query_sensors=lambda: [color]), CameraDriverConfig())
    assert color.told == [("global_time_enabled", 1), ("enable_auto_exposure", 1)]
