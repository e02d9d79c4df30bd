"""Files of RealSense cameras: a .bag as librealsense 2.56 wrote it, .db3 files written by that of today."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("rosbags", reason="rosbags is not installed: pip install 'riseg-drake[bags]'")
pytest.importorskip(
    "pyrealsense2",
    reason="no librealsense: pip install 'riseg-drake[realsense]', apt-get install libusb-1.0-0",
    exc_type=ImportError,
)

import cv2
import pyrealsense2 as rs

from riseg_drake.app.cli import main
from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.geometry.depth_alignment import align_depth
from riseg_drake.geometry.lens import Lens, grid_rays
from riseg_drake.geometry.se3 import exp_se3, move_points
from riseg_drake.recording.layout import RecordingError
from riseg_drake.recording.reader import RecordingReader
from riseg_drake.recording.source import SourceOptions
from riseg_drake.recording.source_kinds import opened_source
from tests.recording.made_realsense import (
    EPOCH,
    RealSenseKind,
    aligned_by_librealsense,
    realsense_intrinsics,
    record,
)
from tests.recording.made_recordings import drawn_frames, write
from tests.recording.make_realsense_bag import BAG, COLOR, DEPTH, X_CD, patterns
from tests.segmentation.drawn_scene import DrawnScene, Texture, looking_down, planar

D415 = RealSenseKind(
    Intrinsics(848, 480, 616.285, 615.778, 405.418, 232.864),
    Intrinsics(848, 480, 645.0, 645.0, 424.3, 240.1),
    exp_se3(np.array([0.0, 0.004, 0.0, 0.015, 0.0003, 0.0002])),
)
D435 = replace(D415, depth=Intrinsics(848, 480, 425.0, 425.0, 424.3, 240.1))
METRE = np.float32(0.0001)
SMALL = Intrinsics(160, 120, 154.125, 153.875, 79.25, 59.375)
"""In numbers that librealsense, which has 32 bits, keeps."""


def opened(path, **options):
    return opened_source(path, SourceOptions(**options))


def millimetres(frame):
    return np.rint(frame.depth * 1000).astype(np.uint16)


@pytest.fixture(scope="module")
def frames():
    """Of a camera at rest, in whole millimetres and tenths of a second."""
    return [
        replace(f, X_WC=None, labels=None, depth=millimetres(f) * np.float32(0.001))
        for f in drawn_frames(5, SMALL, rate=10.0)
    ]


@pytest.mark.parametrize("compressed", [True, False])
@pytest.mark.parametrize("format", ["rgb8", "bgr8", "rgba8"])
def test_a_file_with_aligned_depth_gives_the_frames_of_the_folder_bit_for_bit(
    tmp_path, frames, format, compressed
):
    order = {"rgb8": [0, 1, 2], "bgr8": [2, 1, 0], "rgba8": [0, 1, 2, 2]}[format]
    file = record(
        tmp_path / "film.db3",
        RealSenseKind(SMALL, SMALL, format=format, compressed=compressed),
        [(f.color[..., order], millimetres(f)) for f in frames],
    )
    source, folder = opened(file), RecordingReader(write(tmp_path / "folder", frames, SMALL))
    assert (len(source), source.intrinsics, source.depth_scale) == (5, SMALL, folder.depth_scale)
    assert (source.camera_poses, source.joints) == (None, None)
    for index, (a, b) in enumerate(zip(source, folder, strict=True)):
        np.testing.assert_array_equal(a.color, b.color)
        np.testing.assert_array_equal(a.depth, b.depth)
        assert a.time == pytest.approx(EPOCH + index / 10, abs=1e-6)
    assert (source.warnings, source.left_out) == ([], [])


@pytest.mark.parametrize("format", ["yuyv", "uyvy"])
def test_colours_that_no_png_holds_are_read_as_opencv_has_them(tmp_path, format):
    pixels = np.random.default_rng(0).integers(0, 256, (*SMALL.shape, 2), np.uint8)
    file = record(
        tmp_path / "film.db3",
        RealSenseKind(SMALL, SMALL, format=format),
        [(pixels, np.full(SMALL.shape, 500, np.uint16))],
    )
    (frame,) = opened(file)
    right = cv2.COLOR_YUV2RGB_YUYV if format == "yuyv" else cv2.COLOR_YUV2RGB_UYVY
    np.testing.assert_array_equal(frame.color, cv2.cvtColor(pixels, right))


def test_a_bag_of_librealsense_2_56_has_its_images_stamps_unit_and_both_cameras():
    source = opened(BAG)
    assert (source.intrinsics, source.depth_scale, len(source)) == (COLOR, 10_000, 3)
    for index, (frame, (color, depth)) in enumerate(zip(source, patterns(), strict=True)):
        np.testing.assert_array_equal(frame.color, color)
        expected = align_depth(depth.astype(np.float32) * METRE, Lens(DEPTH), X_CD, COLOR)
        both = (frame.depth > 0) & (expected > 0)
        # The file holds the cameras' offset as float32.
        assert both.mean() > 0.7
        assert np.mean((frame.depth > 0) == (expected > 0)) > 0.999
        assert np.mean(np.abs(frame.depth - expected)[both] < 1e-6) > 0.99
        assert frame.time == pytest.approx(EPOCH + index / 10, abs=1e-5)
    assert source.warnings == ["depth of /device_0/sensor_0/Depth_0/image/data is not aligned to colour; "
                               "the program aligns it"]  # fmt: skip


def test_both_formats_turn_points_of_depth_into_colour_by_the_same_pose(tmp_path):
    kind = RealSenseKind(COLOR, DEPTH, X_CD, unit=0.0001)
    file = record(tmp_path / "film.db3", kind, patterns())
    for a, b in zip(opened(file), opened(BAG), strict=True):
        np.testing.assert_array_equal(a.color, b.color)
        assert np.mean(np.abs(a.depth - b.depth) < 1e-6) > 0.999


def z_of_depth_camera(aligned, kind):
    """What the depth camera measures, m, of the points that a depth image of the colour camera shows."""
    p_CQ = grid_rays(Lens(kind.color), 0.0, 0.0) * aligned.astype(float)[..., None]
    return np.where(aligned > 0, move_points(np.linalg.inv(kind.X_CD), p_CQ)[..., 2], 0)


def as_librealsense_places_it(depth, kind):
    """Where colour is the coarser image, librealsense takes a pixel of depth by its upper left corner."""
    finer = kind.depth.fx > kind.color.fx
    half = 0.5 * kind.color.fx / kind.depth.fx if finer else 0.0
    there = replace(kind.color, cx=kind.color.cx - half, cy=kind.color.cy - half)
    return align_depth(depth, Lens(kind.depth), kind.X_CD, there)


@pytest.fixture(scope="module", params=[(D415, 0.0), (D415, 0.0015), (D435, 0.0), (D435, 0.0015)])
def alignment(request, tmp_path_factory):
    """A camera, what it measured, what librealsense and this program make of it, what is true, m."""
    kind, noise = request.param
    file = tmp_path_factory.mktemp("aligned") / "film.db3"
    sizes = [(0.09, 0.08, 0.04), (0.07, 0.09, 0.05), (0.05, 0.05, 0.1)]
    bodies = [planar(-0.07, 0, 0.3), planar(0.07, 0), planar(0, 0.1, 0.5)]

    def drawn(camera, X_WC, rng=None):
        scene = DrawnScene(sizes, table=Texture(9, contrast=10), intrinsics=camera, depth_noise=noise)
        return scene.frame(0, X_WC, bodies, rng)[0]

    measured = millimetres(drawn(kind.depth, looking_down(), np.random.default_rng(0) if noise else None))
    record(file, kind, [(np.zeros((*kind.color.shape, 3), np.uint8), measured)])
    ((_, theirs),) = aligned_by_librealsense(file, 1)
    (ours,) = opened(file)
    true = drawn(kind.color, looking_down() @ np.linalg.inv(kind.X_CD)).depth
    return kind, measured * np.float32(0.001), theirs * np.float32(0.001), ours.depth, true


def within_2_mm(a, b):
    return np.mean(np.abs(a - b) <= 0.002)


@pytest.mark.renders
def test_alignment_agrees_with_that_of_librealsense_in_99_percent_of_pixels(alignment):
    """To 2 mm, with noise, too, in what it measures and places otherwise: z stays the depth camera's, and a
    coarser colour image is half a pixel beside."""
    kind, measured, theirs, ours, _ = alignment
    placed = as_librealsense_places_it(measured, kind)
    assert within_2_mm(z_of_depth_camera(placed, kind), theirs) >= 0.99
    assert np.mean((ours > 0) == (theirs > 0)) >= 0.99
    wrong_way = align_depth(measured, Lens(kind.depth), np.linalg.inv(kind.X_CD), kind.color)
    assert within_2_mm(z_of_depth_camera(wrong_way, kind), theirs) < 0.97


@pytest.mark.renders
def test_aligned_depth_is_nearer_to_the_truth_than_that_of_librealsense(alignment):
    _, _, theirs, ours, true = alignment
    seen = {name: depth > 0 for name, depth in (("ours", ours), ("theirs", theirs))}
    right = within_2_mm(ours[seen["ours"]], true[seen["ours"]])
    assert right >= 0.994
    assert right > within_2_mm(theirs[seen["theirs"]], true[seen["theirs"]]) + 0.002


@pytest.mark.parametrize("model", ["brown_conrady", "inverse_brown_conrady", "modified_brown_conrady"])
def test_lenses_project_as_librealsense_projects(tmp_path, model):
    distortion = (0.1, -0.2, 0.001, 0.002, 0.05)
    kind = replace(D415, model=model, distortion=distortion)
    file = record(
        tmp_path / "film.db3",
        kind,
        [(np.zeros((*kind.color.shape, 3), np.uint8), np.full((480, 848), 500, np.uint16))],
    )
    lens = opened(file).registration.color
    np.testing.assert_allclose(lens.distortion, distortion, atol=1e-8)
    uv = np.array([[20.0, 30.0], [212.0, 100.0], [800.0, 440.0]])
    right = realsense_intrinsics(kind.color, model, distortion)
    back = [rs.rs2_project_point_to_pixel(right, ray.tolist()) for ray in lens.rays_at(uv)]
    np.testing.assert_allclose(back, uv, atol=0.02)


def test_a_fisheye_is_opencvs_and_a_lens_that_opencv_does_not_know_is_said(tmp_path):
    blank = [(np.zeros((*SMALL.shape, 3), np.uint8), np.full(SMALL.shape, 500, np.uint16))]
    kind = RealSenseKind(SMALL, SMALL, model="kannala_brandt4", distortion=(0.02, -0.01, 0.003, 0.001, 0.0))
    lens = opened(record(tmp_path / "fisheye.db3", kind, blank)).registration.color
    assert lens.fisheye
    uv = np.array([[20.0, 30.0], [140.0, 100.0]])
    right = realsense_intrinsics(SMALL, kind.model, kind.distortion)
    back = [rs.rs2_project_point_to_pixel(right, ray.tolist()) for ray in lens.rays_at(uv)]
    np.testing.assert_allclose(back, uv, atol=1e-3)
    unknown = record(tmp_path / "ftheta.db3", replace(kind, model="ftheta"), blank)
    with pytest.raises(RecordingError, match="model Ftheta, which OpenCV does not know"):
        opened(unknown)


@pytest.mark.renders
def test_the_masks_of_a_file_are_those_of_the_folder(tmp_path, frames):
    film = [(f.color, millimetres(f)) for f in frames]
    record(tmp_path / "film.db3", RealSenseKind(SMALL, SMALL), film)
    write(tmp_path / "folder", frames, SMALL)
    for name in ("film.db3", "folder"):
        assert main(["segment", str(tmp_path / name), "--output", str(tmp_path / f"of_{name}")]) == 0
    ours, theirs = (sorted((tmp_path / f"of_{name}" / "mask").iterdir()) for name in ("film.db3", "folder"))
    assert len(ours) == len(theirs) == 5
    assert [a.read_bytes() for a in ours] == [b.read_bytes() for b in theirs]
    assert cv2.imread(str(ours[-1]), cv2.IMREAD_UNCHANGED).max() > 0
