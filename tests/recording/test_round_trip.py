import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.recording.layout import RecordedFrame, RecordingError
from riseg_drake.recording.reader import RecordingReader
from riseg_drake.recording.writer import RecordingWriter, depth_to_millimetres

INTRINSICS = Intrinsics(64, 48, 61.6285, 61.5778, 30.1418, 23.2864)


def frames(number, rng):
    """Frames as a camera of millimetre resolution gives them, 1/15 s apart."""
    for k in range(number):
        X_WC = np.eye(4)
        X_WC[:3, :3] = Rotation.random(None, rng).as_matrix()
        X_WC[:3, 3] = rng.normal(size=3)
        depth = rng.integers(0, 3000, INTRINSICS.shape).astype(np.float32) * np.float32(0.001)
        yield RecordedFrame(
            time=k / 15,
            color=rng.integers(0, 256, (*INTRINSICS.shape, 3), np.uint8),
            depth=depth,
            X_WC=X_WC,
            position=rng.uniform(-3, 3, 7),
            robot=rng.random(INTRINSICS.shape) < 0.2,
            labels=rng.integers(0, 7, INTRINSICS.shape).astype(np.uint16),
        )


def test_what_was_written_is_read_back_bit_for_bit(tmp_path):
    written = list(frames(4, np.random.default_rng(0)))
    with RecordingWriter(tmp_path / "recording", INTRINSICS) as writer:
        for frame in written:
            writer.append(frame)
    reader = RecordingReader(tmp_path / "recording")
    assert reader.intrinsics == INTRINSICS
    assert len(reader) == 4
    for before, after in zip(written, reader, strict=True):
        assert after.time == before.time
        for name in ("color", "depth", "position", "robot", "labels"):
            np.testing.assert_array_equal(getattr(after, name), getattr(before, name), err_msg=name)
            assert getattr(after, name).dtype == getattr(before, name).dtype, name
        # A pose passes through a quaternion.
        np.testing.assert_allclose(after.X_WC, before.X_WC, rtol=0, atol=1e-14)


def test_poses_joints_and_masks_may_be_absent(tmp_path):
    color = np.zeros((*INTRINSICS.shape, 3), np.uint8)
    depth = np.ones(INTRINSICS.shape, np.float32)
    with RecordingWriter(tmp_path, INTRINSICS) as writer:
        writer.append(RecordedFrame(0.5, color, depth))
    (frame,) = RecordingReader(tmp_path)
    assert frame.X_WC is frame.position is frame.robot is frame.labels is None
    assert not (tmp_path / "joints.csv").exists()


def test_a_recording_can_be_read_while_it_is_written(tmp_path):
    with RecordingWriter(tmp_path, INTRINSICS) as writer:
        for number, frame in enumerate(frames(3, np.random.default_rng(1)), start=1):
            writer.append(frame)
            assert len(list(RecordingReader(tmp_path))) == number
            assert not list(tmp_path.rglob("*.unfinished"))


def test_an_image_that_cannot_be_written_enters_no_list(tmp_path):
    first, second = frames(2, np.random.default_rng(2))
    with RecordingWriter(tmp_path, INTRINSICS) as writer:
        writer.append(first)
        (tmp_path / "depth" / "000001.png").mkdir()  # in the way of the second frame
        with pytest.raises(OSError, match="000001"):
            writer.append(second)
    assert len(list(RecordingReader(tmp_path))) == 1


def test_a_folder_with_a_recording_is_not_written_over(tmp_path):
    with RecordingWriter(tmp_path, INTRINSICS) as writer:
        writer.append(next(frames(1, np.random.default_rng(3))))
    with pytest.raises(RecordingError, match="holds a recording already"):
        RecordingWriter(tmp_path, INTRINSICS)


def test_depth_that_does_not_fit_millimetres_of_16_bits_becomes_invalid():
    depth = np.array([[0.0004, 0.0006, 65.534, 65.535, np.inf, np.nan, -1.0]], np.float32)
    np.testing.assert_array_equal(depth_to_millimetres(depth), [[0, 1, 65534, 0, 0, 0, 0]])


def test_depth_is_found_by_the_nearest_stamp_within_the_limit(tmp_path):
    with RecordingWriter(tmp_path, INTRINSICS) as writer:
        for frame in frames(3, np.random.default_rng(4)):
            writer.append(frame)
    lines = (tmp_path / "depth.txt").read_text().splitlines()
    late = ["0.019 depth/000000.png", "0.1333 depth/000002.png", "0.2 depth/000001.png"]
    (tmp_path / "depth.txt").write_text("\n".join([lines[0], *late]) + "\n")
    assert [frame.time for frame in RecordingReader(tmp_path)] == [0, 2 / 15]


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("camera.json", '{"width": 64}', 'camera.json: "height" is missing; the keys are'),
        ("camera.json", "{\n oops", "camera.json: line 2 is not JSON"),
        ("rgb.txt", "0.0\n", "rgb.txt: line 1 must be: timestamp file"),
        ("depth.txt", "zero depth/000000.png\n", "depth.txt: line 1 holds 'zero'"),
        ("groundtruth.txt", "0 1 2 3\n", "groundtruth.txt: line 1 must hold 8 numbers, it holds 4"),
        ("joints.csv", "0,1,2,3,4,5,6,nan\n", "joints.csv: line 1 holds 'nan'"),
        ("rgb.txt", None, "rgb.txt is missing"),
        ("rgb/000000.png", "", "000000.png is not a readable PNG"),
    ],
)
def test_damage_is_reported_with_file_and_line(tmp_path, name, content, message):
    with RecordingWriter(tmp_path, INTRINSICS) as writer:
        writer.append(next(frames(1, np.random.default_rng(5))))
    (tmp_path / name).unlink()
    if content is not None:
        (tmp_path / name).write_text(content)
    with pytest.raises(RecordingError, match=message):
        list(RecordingReader(tmp_path))
