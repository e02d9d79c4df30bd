"""Folders as other programs leave them: numbers for names, arrays and TIFF, BOP scenes, two cameras."""

import json

import cv2
import numpy as np
import pytest

from riseg_drake.geometry.se3 import exp_se3, inverse
from riseg_drake.recording.layout import RecordingError
from riseg_drake.recording.reader import RecordingReader
from riseg_drake.recording.source import SourceOptions
from tests.recording.made_recordings import SMALL, drawn_frames, write

WIDTH, HEIGHT = 40, 32
CAMERA = {"width": WIDTH, "height": HEIGHT, "fx": 40, "fy": 40, "cx": 20, "cy": 16, "depth_scale": 1000}
SHAPE = (HEIGHT, WIDTH)


def put(path, image):
    path.parent.mkdir(exist_ok=True)
    if path.suffix == ".npy":
        np.save(path, image)
    else:
        assert cv2.imwrite(str(path), image)


@pytest.fixture
def numbered(tmp_path):
    """Three images a side, without lists, numbers 0, 2, 10. Image k has gray k, and is k + 1 metres away."""
    (tmp_path / "camera.json").write_text(json.dumps(CAMERA))
    for k in (0, 2, 10):
        put(tmp_path / "rgb" / f"frame-{k}.color.png", np.full((*SHAPE, 3), k, np.uint8))
        put(tmp_path / "depth" / f"{k:06d}.png", np.full(SHAPE, 1000 * (k + 1), np.uint16))
    return tmp_path


def read(folder, **options):
    return list(RecordingReader(folder, options=SourceOptions(**options)))


def test_images_go_by_the_numbers_in_their_names_at_the_rate_that_is_given(numbered):
    frames = read(numbered, rate=10.0)
    assert [frame.time for frame in frames] == [0.0, 0.2, 1.0]
    assert [frame.color[0, 0, 0] for frame in frames] == [0, 2, 10]
    np.testing.assert_allclose([frame.depth[0, 0] for frame in frames], [1.0, 3.0, 11.0], rtol=1e-6)
    with pytest.raises(RecordingError, match=r"images without a rgb\.txt; --rate HZ says how many a second$"):
        read(numbered)


def test_names_that_are_stamps_need_no_rate(numbered):
    for folder, stem in (("rgb", "1305031102.175304"), ("depth", "1305031102.175304000"[:17])):
        for path in (numbered / folder).iterdir():
            path.unlink()
        image = np.zeros((*SHAPE, 3), np.uint8) if folder == "rgb" else np.full(SHAPE, 1000, np.uint16)
        put(numbered / folder / f"{stem}.png", image)
    assert [frame.time for frame in read(numbered)] == [1305031102.175304]
    (numbered / "rgb" / "1305031102.175304.png").rename(numbered / "rgb" / "1305031102175304000.png")
    assert [frame.time for frame in read(numbered)] == [1305031102.175304]


def test_two_folders_that_would_do_are_a_question_that_names_the_option(numbered):
    put(numbered / "color" / "000000.png", np.full((*SHAPE, 3), 99, np.uint8))
    with pytest.raises(RecordingError, match=r"holds rgb, color; choose by --topics color=FOLDER"):
        read(numbered, rate=1.0)
    (frame,) = read(numbered, rate=1.0, topics={"color": "color"})
    assert frame.color[0, 0, 0] == 99
    with pytest.raises(RecordingError, match=r"no folder nowhere with images; name one by --topics"):
        read(numbered, rate=1.0, topics={"color": "nowhere"})


@pytest.mark.parametrize("suffix", ["npy", "tiff"])
def test_depth_may_be_metres_as_floats(numbered, suffix):
    (numbered / "camera.json").write_text(json.dumps({**CAMERA, "depth_scale": 1}))
    for path in (numbered / "depth").iterdir():
        path.unlink()
    depth = np.full(SHAPE, 1.25, np.float32)
    depth[0, :3] = [0, np.nan, np.inf]
    put(numbered / "depth" / f"0.{suffix}", depth)
    (frame,) = read(numbered, rate=1.0, stamp_limit=0.4)
    np.testing.assert_array_equal(frame.depth[0, :4], np.float32([0, 0, 0, 1.25]))


def test_an_array_of_objects_is_never_loaded(numbered):
    (numbered / "depth" / "000000.png").unlink()
    np.save(numbered / "depth" / "0.npy", np.array([[{}]], object), allow_pickle=True)
    reader = RecordingReader(numbered, options=SourceOptions(rate=1.0))
    assert [frame.time for frame in reader] == [2.0, 10.0]
    assert "which is no depth image" in reader.left_out[0].why


def test_depth_of_a_camera_of_its_own_is_aligned(numbered):
    """A wall, seen 0.1 m to the left by the depth camera: at 1 m that is 4 px."""
    depth = {key: CAMERA[key] for key in CAMERA if key != "depth_scale"} | {"X_CD": [-0.1, 0, 0, 0, 0, 0, 1]}
    (numbered / "camera.json").write_text(json.dumps({**CAMERA, "depth": depth}))
    frame, *_ = read(numbered, rate=1.0)
    np.testing.assert_allclose(frame.depth[:, : WIDTH - 4], 1.0, atol=1e-6)
    assert not frame.depth[:, WIDTH - 4 :].any()
    (numbered / "camera.json").write_text(json.dumps({**CAMERA, "depth": {**depth, "X_CD": [1, 2]}}))
    with pytest.raises(RecordingError, match=r'camera\.json: "X_CD" of "depth" must hold tx ty tz'):
        read(numbered, rate=1.0)


def test_a_scene_of_bop_has_its_cameras_and_poses_in_millimetres(numbered):
    (numbered / "camera.json").unlink()
    X_WC = exp_se3(np.array([0.3, -0.2, 0.1, 0.5, 0.6, 0.7]))
    X_CW = inverse(X_WC)
    camera = {
        "cam_K": [40, 0, 20, 0, 41, 16, 0, 0, 1],
        "depth_scale": 0.5,
        "cam_R_w2c": X_CW[:3, :3].ravel().tolist(),
        "cam_t_w2c": (1000 * X_CW[:3, 3]).tolist(),
    }
    scene = numbered / "scene_camera.json"
    scene.write_text(json.dumps({str(k): camera for k in (0, 2, 10)}))
    reader = RecordingReader(numbered, options=SourceOptions(rate=1.0))
    first, second, _ = reader
    assert (reader.intrinsics.fx, reader.intrinsics.fy, reader.intrinsics.width) == (40, 41, WIDTH)
    np.testing.assert_allclose([first.depth[0, 0], second.depth[0, 0]], [0.5, 1.5], rtol=1e-6)
    np.testing.assert_allclose(second.X_WC, X_WC, atol=1e-12)
    scene.write_text(json.dumps({"0": camera, "2": {**camera, "depth_scale": 1.0}}))
    with pytest.raises(RecordingError, match="cam_K or depth_scale differs between images"):
        read(numbered, rate=1.0)
    with pytest.raises(RecordingError, match="is a BOP scene; --rate HZ says how many"):
        read(numbered)


def test_masks_of_jpeg_images_go_by_the_stem(numbered):
    for path in (numbered / "rgb").iterdir():
        path.unlink()
    put(numbered / "rgb" / "0.jpg", np.zeros((*SHAPE, 3), np.uint8))
    put(numbered / "label" / "0.png", np.full(SHAPE, 3, np.uint8))
    (frame,) = read(numbered, rate=1.0)
    np.testing.assert_array_equal(frame.labels, np.full(SHAPE, 3))


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"topics": {"colour": "rgb"}}, r"--topics: 'colour' is not color or depth"),
        ({"topics": {"color": "rgb", "pose": "/pose"}}, r"--topics: 'pose' is not color or depth"),
        ({"world_frame": "map"}, r"--world-frame is for the transforms of a bag"),
        ({"rate": 30.0}, r"--rate is for images without a list, and .*rgb\.txt has a stamp for each"),
    ],
)
def test_an_option_that_a_folder_has_no_use_for_is_said(tmp_path, options, says):
    folder = write(tmp_path / "listed", drawn_frames(1), SMALL)
    with pytest.raises(RecordingError, match=says):
        read(folder, **options)
