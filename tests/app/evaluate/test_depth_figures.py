"""The figures of depth against errors that were put in, on a drawn scene."""

from functools import cache

import numpy as np
import pytest

from riseg_drake.app.evaluate.depth_figures import DISPARITY, depth_figures, depth_table, draw_depth
from riseg_drake.geometry.rgbd import Frame
from riseg_drake.host.images import read_image
from riseg_drake.recording.layout import RecordedFrame
from riseg_drake.recording.writer import RecordingWriter
from riseg_drake.stations.smooth_error import SmoothErrorParameters, smooth_error
from tests.segmentation.drawn_scene import CAMERA, DrawnScene, Texture, looking_down, planar

WHITE = 0.08
"""px of disparity."""
ROUNDING = 1e-3 / np.sqrt(12) * DISPARITY / 0.45**2
"""What whole millimetres make of it at the table's distance, px."""


@cache
def drawn() -> list[Frame]:
    """Ten frames with white noise, seen by a camera that moves a little."""
    scene = DrawnScene([(0.07, 0.06, 0.03)], table=Texture(5, contrast=14), depth_noise=WHITE / DISPARITY)
    rng, there = np.random.default_rng(2), [planar(-0.03, 0.02)]
    return [scene.frame(number, looking_down(x=0.001 * number), there, rng)[0] for number in range(10)]


def record(folder, smooth: float = 0.0, shift: float = 0.0, holes: float = 0.0):
    parameters = SmoothErrorParameters(disparity_std=smooth, flicker=1.0)
    with RecordingWriter(folder, CAMERA) as writer:
        for number, frame in enumerate(drawn()):
            rng = np.random.default_rng([3, number])
            depth = frame.depth * (rng.random(frame.depth.shape) >= holes)
            depth += depth**2 / DISPARITY * smooth_error(depth.shape, frame.X_WC, parameters, 0, rng)
            depth += np.where(depth > 0, shift * (number % 2), 0)
            writer.append(RecordedFrame(number / 15, frame.color, depth.astype(np.float32), frame.X_WC))
    return folder


def test_white_noise_has_its_size_and_no_smooth_part(tmp_path) -> None:
    figures = depth_figures(record(tmp_path / "white"))
    assert figures["noise_px"] == pytest.approx(np.hypot(WHITE, ROUNDING), rel=0.1)
    expected_mm = 1e3 * np.hypot(WHITE, ROUNDING) * 0.45**2 / DISPARITY
    assert figures["noise_mm"]["0.3 to 0.5 m"] == pytest.approx(expected_mm, rel=0.1)
    assert figures["smooth_next_px"] < 0.02
    assert figures["table_tilt_rad"] < 0.001
    assert figures["holes"] == 0
    assert np.isnan(figures["holes_dark"])


def test_of_a_smooth_error_is_left_what_a_blur_leaves(tmp_path) -> None:
    figures = depth_figures(record(tmp_path / "smooth", smooth=0.2))
    # Of a squared exponential of width w, a blur of width s leaves w^2 / (w^2 + 2 s^2) of the variance.
    assert figures["smooth_next_px"] == pytest.approx(0.2 * np.sqrt(15**2 / (15**2 + 2 * 20**2)), rel=0.25)
    assert figures["noise_px"] == pytest.approx(np.sqrt(0.2**2 + WHITE**2 + ROUNDING**2), rel=0.15)
    assert figures["table_tilt_rad"] > 0.001


def test_a_table_that_jumps_and_holes_are_seen(tmp_path) -> None:
    figures = depth_figures(record(tmp_path / "jumps", shift=0.004, holes=0.1))
    assert figures["table_height_mm"] == pytest.approx(4, rel=0.1)
    assert figures["holes"] == pytest.approx(0.1, abs=0.005)


def test_the_table_has_a_column_for_each_recording_and_the_picture_too(tmp_path) -> None:
    recording = record(tmp_path / "one")
    figures = depth_figures(recording)
    lines = depth_table({"a": figures, "b": figures})
    assert lines[0] == "| | a | b |"
    assert all(line.count("|") == 4 for line in lines)
    assert "| noise at 1 to 1.5 m, mm | - | - |" in lines
    draw_depth([recording, recording], tmp_path / "depth.png")
    assert read_image(tmp_path / "depth.png").shape == (480, 640, 3)
