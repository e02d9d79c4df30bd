"""What the reader makes of a folder: which stamps belong together, what is odd, and what may be missing."""

import json

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from riseg_drake.recording.layout import RecordingError
from riseg_drake.recording.reader import RecordingReader

WIDTH, HEIGHT = 40, 32


def put(path, image):
    path.parent.mkdir(exist_ok=True)
    assert cv2.imwrite(str(path), np.asarray(image))


def listed(folder, name, stamps, file="000000"):
    (folder / name).write_text("".join(f"{t} {name.removesuffix('.txt')}/{file}.png\n" for t in stamps))


def numbers(folder, name, *rows, separator=" "):
    (folder / name).write_text("".join(separator.join(map(str, row)) + "\n" for row in rows))


@pytest.fixture
def folder(tmp_path):
    """A recording of one frame, at 0 s; all of it is 1 m away."""
    camera = {"width": WIDTH, "height": HEIGHT, "fx": 40, "fy": 40, "cx": 20, "cy": 16, "depth_scale": 1000}
    (tmp_path / "camera.json").write_text(json.dumps(camera))
    put(tmp_path / "rgb" / "000000.png", np.zeros((HEIGHT, WIDTH, 3), np.uint8))
    put(tmp_path / "depth" / "000000.png", np.full((HEIGHT, WIDTH), 1000, np.uint16))
    listed(tmp_path, "rgb.txt", [0.0])
    listed(tmp_path, "depth.txt", [0.0])
    return tmp_path


def scaled(folder, depth_scale):
    camera = json.loads((folder / "camera.json").read_text())
    (folder / "camera.json").write_text(json.dumps({**camera, "depth_scale": depth_scale}))


def both_listed(folder, stamps):
    listed(folder, "rgb.txt", stamps)
    listed(folder, "depth.txt", stamps)


def reasons(reader):
    return [(each.line, each.why) for each in reader.left_out]


POSE = (0, 0, 0, 0, 0, 0, 1)


def test_stamps_belong_together_up_to_two_hundredths_of_a_second(folder):
    both = [1.0, 2.0]
    listed(folder, "rgb.txt", both)
    listed(folder, "depth.txt", [1.0196, 2.0204])
    reader = RecordingReader(folder)
    assert [frame.time for frame in reader] == [1.0]
    assert reasons(reader) == [(2, "depth.txt has nothing nearer than 0.0204 s in time")]
    wider = RecordingReader(folder, stamp_limit=0.03)
    assert (len(wider), wider.left_out) == (2, [])


def test_where_most_stamps_of_a_list_have_no_partner_its_clock_or_unit_is_in_doubt(folder):
    listed(folder, "rgb.txt", [1.0, 2.0, 3.0, 4.0])
    listed(folder, "depth.txt", [1.0, 2.0, 30.0, 40.0])
    assert RecordingReader(folder).warnings == []
    listed(folder, "depth.txt", [1.0, 20.0, 30.0, 40.0])
    assert RecordingReader(folder).warnings == [
        "3 of 4 stamps have no partner in depth.txt: another clock, or unit?"
    ]


def test_lines_that_are_not_newer_are_noted_of_every_list_in_which_they_stand(folder):
    both_listed(folder, [0.0, 0.5, 0.5])
    numbers(folder, "groundtruth.txt", (0.0, *POSE), (0.0, *POSE), (0.5, *POSE))
    numbers(folder, "joints.csv", (0.0, 1), (0.5, 1), (0.5, 1), separator=",")
    reader = RecordingReader(folder)
    assert len(reader) == 2
    noted = [(each.file.removeprefix(f"{folder}/"), each.line) for each in reader.left_out]
    assert noted == [("groundtruth.txt", 2), ("joints.csv", 3), ("rgb.txt", 3), ("depth.txt", 3)]


@pytest.mark.parametrize("name", ["groundtruth.txt", "joints.csv"])
def test_a_frame_without_a_pose_or_joints_near_it_is_left_out_where_others_have_them(folder, name):
    both_listed(folder, [1.0, 1.5])
    numbers(folder, name, (0.985, *POSE), separator="," if name.endswith("csv") else " ")
    reader = RecordingReader(folder)
    (frame,) = reader
    assert frame.time == 1.0
    assert (frame.X_WC is None, frame.position is None) == (name == "joints.csv", name != "joints.csv")
    assert reasons(reader) == [(2, f"{name} has nothing nearer than 0.515 s in time")]


def test_where_nothing_has_a_partner_the_list_that_lacks_most_is_named(folder):
    listed(folder, "rgb.txt", [1.0, 2.0])
    listed(folder, "depth.txt", [1.0])
    numbers(folder, "groundtruth.txt", (9.0, *POSE))
    with pytest.raises(RecordingError, match=r"line 1: neither .* in groundtruth\.txt within 0\.02 s"):
        RecordingReader(folder)
    numbers(folder, "groundtruth.txt", (2.0, *POSE))
    listed(folder, "depth.txt", [9.0])
    with pytest.raises(RecordingError, match=r"has a partner in depth\.txt within 0\.02 s"):
        RecordingReader(folder)


def test_between_two_rows_place_and_joints_go_evenly_and_turns_about_one_axis(folder):
    turns = Rotation.from_rotvec([[0.1, 0.2, -0.3], [0.5, 0.2, 0.1]])
    rows = [(t, *p, *q) for t, p, q in zip((0.98, 1.02), ((1, 2, 3), (5, 4, -1)), turns.as_quat(), strict=True)]
    numbers(folder, "groundtruth.txt", *rows)
    numbers(folder, "joints.csv", (0.98, 1, 2, 3), (1.02, 5, 4, -1), separator=",")
    both_listed(folder, [0.99])
    (frame,) = RecordingReader(folder)
    np.testing.assert_allclose(frame.position, [2, 2.5, 2], atol=1e-9)
    np.testing.assert_allclose(frame.X_WC[:3, 3], [2, 2.5, 2], atol=1e-9)
    whole = (turns[0].inv() * turns[1]).as_rotvec()
    expected = turns[0] * Rotation.from_rotvec(whole / 4)
    np.testing.assert_allclose(frame.X_WC[:3, :3], expected.as_matrix(), atol=1e-9)
    np.testing.assert_array_equal(frame.X_WC[3], [0, 0, 0, 1])


def test_joints_at_a_rows_own_moment_are_that_row(folder):
    numbers(folder, "joints.csv", (0.98, 1, 2), (1.0, 5, 4), (1.02, 7, 7), separator=",")
    both_listed(folder, [1.0])
    (frame,) = RecordingReader(folder)
    np.testing.assert_array_equal(frame.position, [5, 4])


@pytest.mark.parametrize(("length", "right"), [(0.989, False), (0.991, True), (1.009, True), (1.011, False)])
def test_a_quaternions_length_may_be_rounded_by_a_hundredth(folder, length, right):
    numbers(folder, "groundtruth.txt", (0.0, *POSE), (0.1, 9, 9, 9, 0, 0, 0.6 * length, 0.8 * length))
    if right:
        assert len(RecordingReader(folder)) == 1
    else:
        with pytest.raises(RecordingError, match=f"groundtruth.txt: line 2: .* has the length {length:.3g};"):
            RecordingReader(folder)


@pytest.mark.parametrize(
    ("stamps", "rate"), [([3.0], 1.0), ([3.0, 3.25], 4.0), ([0.0, 0.125, 0.25, 0.375, 2.0], 8.0)]
)
def test_the_rate_is_that_of_most_frames(folder, stamps, rate):
    both_listed(folder, stamps)
    assert RecordingReader(folder).rate == rate


def test_depth_is_a_number_of_units_and_both_spellings_of_none_are_zero(folder):
    scaled(folder, 5000)
    depth = np.full((HEIGHT, WIDTH), 10000, np.uint16)
    depth[0, :4] = [0, 65535, 65534, 1]
    put(folder / "depth" / "000000.png", depth)
    (frame,) = RecordingReader(folder)
    assert frame.depth.dtype == np.float32
    np.testing.assert_allclose(frame.depth[0, :5], [0, 0, 13.1068, 0.0002, 2.0], rtol=1e-6)


@pytest.mark.parametrize(
    ("depth_scale", "warned"), [(10100, True), (9900, False), (100.5, False), (99.5, True)]
)
def test_depth_that_is_on_the_whole_nearer_than_10_cm_or_farther_than_10_m_is_odd(folder, depth_scale, warned):
    scaled(folder, depth_scale)
    depth = np.full((HEIGHT, WIDTH), 1000, np.uint16)
    depth[: HEIGHT * 3 // 4] = 0  # what is invalid says nothing
    put(folder / "depth" / "000000.png", depth)
    reader = RecordingReader(folder)
    list(reader)
    assert [warning.split(": ")[1].split(" m,")[0] for warning in reader.warnings] == (
        [f"the median depth is {1000 / depth_scale:.3g}"] if warned else []
    )


def test_odd_depth_is_said_once_of_the_first_frame(folder):
    both_listed(folder, [0.0, 0.5])
    scaled(folder, 10)
    reader = RecordingReader(folder)
    assert len(list(reader)) == 2
    assert len(reader.warnings) == 1


def test_a_frame_without_any_depth_is_read(folder):
    put(folder / "depth" / "000000.png", np.zeros((HEIGHT, WIDTH), np.uint16))
    reader = RecordingReader(folder)
    (frame,) = reader
    assert not frame.depth.any()
    assert reader.warnings == []


def with_one_missing(folder, number, name="rgb.txt"):
    """So many frames, all of the same images, but for the second."""
    stamps = [k / 10 for k in range(number)]
    both_listed(folder, stamps)
    lines = (folder / name).read_text().splitlines()
    lines[1] = lines[1].replace("000000", "gone")
    (folder / name).write_text("\n".join(lines) + "\n")


@pytest.mark.parametrize("name", ["rgb.txt", "depth.txt"])
def test_one_image_in_twenty_may_be_missing_and_one_in_nineteen_is_too_many(folder, name):
    with_one_missing(folder, 20, name)
    reader = RecordingReader(folder)
    assert len(reader) == len(list(reader)) == 19
    ((line, why),) = reasons(reader)
    assert line == 2
    assert why.endswith("gone.png is missing")
    with_one_missing(folder, 19, name)
    with pytest.raises(RecordingError, match=r"rgb\.txt: line 2: .*gone\.png is missing"):
        RecordingReader(folder)


def test_what_cannot_be_read_is_left_out_and_the_first_reason_is_said_where_nothing_can(folder):
    both_listed(folder, [0.0, 0.1])
    listed(folder, "depth.txt", [0.0, 0.1])
    lines = (folder / "depth.txt").read_text().replace("0.1 depth/000000", "0.1 depth/bad")
    (folder / "depth.txt").write_text(lines)
    (folder / "depth" / "bad.png").write_bytes(b"no image")
    reader = RecordingReader(folder)
    assert len(reader) == 2
    assert [(frame.time, frame.name, frame.line) for frame in reader] == [(0.0, "rgb/000000.png", 1)]
    ((line, why),) = reasons(reader)
    assert line == 2
    assert "bad.png is not a readable PNG image" in why

    (folder / "depth" / "000000.png").write_bytes(b"no image either")
    with pytest.raises(RecordingError, match=r"line 1: no frame can be read: .*000000\.png is not a readable"):
        list(RecordingReader(folder))


def test_a_colour_image_may_have_an_alpha_channel(folder):
    rgba = np.zeros((HEIGHT, WIDTH, 4), np.uint8)
    rgba[..., :] = (10, 20, 30, 99)  # B, G, R, A as OpenCV has them
    put(folder / "rgb" / "000000.png", rgba)
    (frame,) = RecordingReader(folder)
    np.testing.assert_array_equal(frame.color, np.broadcast_to([30, 20, 10], (HEIGHT, WIDTH, 3)))


@pytest.mark.parametrize("bits", [np.uint8, np.uint16])
def test_masks_have_one_channel_of_8_or_16_bits_and_anything_above_0_is_the_robot(folder, bits):
    mask = np.zeros((HEIGHT, WIDTH), bits)
    mask[3, 5], mask[7, 9] = 1, 200
    put(folder / "robot" / "000000.png", mask)
    put(folder / "label" / "000000.png", mask)
    reader = RecordingReader(folder)
    (frame,) = reader
    assert np.argwhere(frame.robot).tolist() == [[3, 5], [7, 9]]
    np.testing.assert_array_equal(frame.labels, mask)
    assert frame.labels.dtype == np.uint16


SHAPE = (HEIGHT, WIDTH)
GRAY, DEEP = np.zeros(SHAPE, np.uint8), np.zeros(SHAPE, np.uint16)
COLOR, DEEP_COLOR = np.zeros((*SHAPE, 3), np.uint8), np.zeros((*SHAPE, 3), np.uint16)
WRONG = [
    ("rgb", GRAY, "1 channel of 8 bits", "3 channels of 8 bits"),
    ("rgb", DEEP_COLOR, "3 channels of 16 bits", "3 channels of 8 bits"),
    ("depth", GRAY, "1 channel of 8 bits", "1 channel of 16 bits"),
    ("depth", DEEP_COLOR, "3 channels of 16 bits", "1 channel of 16 bits"),
    ("robot", COLOR, "3 channels of 8 bits", "1 channel of 8 or 16 bits"),
    ("label", COLOR, "3 channels of 8 bits", "1 channel of 8 or 16 bits"),
]


@pytest.mark.parametrize(("where", "image", "kind", "right"), WRONG)
def test_an_image_of_another_kind_is_refused_at_once_and_so_is_one_that_changes_later(
    folder, where, image, kind, right
):
    put(folder / "label" / "000000.png", GRAY)
    put(folder / "robot" / "000000.png", GRAY)
    reader = RecordingReader(folder)
    put(folder / where / "000000.png", image)
    with pytest.raises(RecordingError, match=rf"{where}/000000\.png: .* have {right.replace('1', 'one', 1)}"):
        list(reader)
    with pytest.raises(RecordingError, match=rf"{where}/000000\.png has {kind}; it must have {right}$"):
        RecordingReader(folder)


def test_whether_there_are_labels_is_whether_their_folder_holds_anything(folder):
    reader = RecordingReader(folder)
    assert not reader.holds_images("label")
    (folder / "label").mkdir()
    assert not reader.holds_images("label")
    put(folder / "label" / "000000.png", GRAY)
    assert reader.holds_images("label")
    (frame,) = reader
    assert frame.labels is not None


def test_what_lies_beside_is_looked_at_for_the_frames_that_have_it(folder):
    both_listed(folder, [0.0, 0.1])
    lines = (folder / "rgb.txt").read_text().replace("0.1 rgb/000000", "0.1 rgb/000001")
    (folder / "rgb.txt").write_text(lines)
    put(folder / "rgb" / "000001.png", COLOR)
    put(folder / "label" / "000001.png", GRAY + 4)
    first, second = RecordingReader(folder)
    assert first.labels is None
    np.testing.assert_array_equal(second.labels, np.full(SHAPE, 4))


@pytest.mark.parametrize(
    ("content", "says"),
    [("{\n\n oops", r"camera\.json: line 3 is not JSON"), ("[" * 100_000, r"camera\.json is no JSON that can")],
)
def test_a_camera_file_that_cannot_be_read_is_named(folder, content, says):
    (folder / "camera.json").write_text(content)
    with pytest.raises(RecordingError, match=says):
        RecordingReader(folder)


def test_a_name_that_is_no_folder_is_no_recording(folder):
    with pytest.raises(RecordingError, match=r"rgb\.txt is not a folder; a recording is one"):
        RecordingReader(folder / "rgb.txt")
