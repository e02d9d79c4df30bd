import json

import cv2
import numpy as np
import pytest
import trimesh
from pycocotools.coco import COCO
from scipy.spatial.transform import Rotation

from riseg_drake.app.cli import main
from riseg_drake.app.exports import Exports, exporting
from riseg_drake.export.formats import FORMATS
from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.geometry.se3 import inverse, move_points, translation
from riseg_drake.recording.layout import RecordedFrame
from tests.recording.made_recordings import write
from tests.segmentation.drawn_scene import DrawnScene, Texture, looking_down, planar

CAMERA = Intrinsics(240, 180, 231.0, 230.8, 118.7, 89.2)
HEIGHT = 0.04
SIZE = (0.09, 0.08, HEIGHT)
STEP, TURN = 0.003, 0.02
"""m and rad a frame."""
MOVES = [0] * 4 + [1] * 6 + [0] * 8 + [1] * 6 + [0] * 8
"""Frame by frame: two pushes, and a rest after each."""


def pose(k):
    gone = sum(MOVES[: k + 1])
    return planar(-0.07, STEP * gone - 0.02, 0.3 + TURN * gone)


@pytest.fixture(scope="module")
def film(tmp_path_factory):
    scene = DrawnScene([SIZE, (0.07, 0.09, 0.05)], table=Texture(9, contrast=10), intrinsics=CAMERA)
    rng = np.random.default_rng(0)
    frames = []
    for k in range(len(MOVES)):
        frame, label = scene.frame(k, looking_down(), [pose(k), planar(0.07, 0.0)], rng)
        frames.append(RecordedFrame(k / 15, frame.color, frame.depth, looking_down(), labels=label))
    return write(tmp_path_factory.mktemp("film") / "recording", frames, CAMERA)


@pytest.fixture(scope="module")
def exported(film):
    output = film.parent / "out"
    assert main(["segment", str(film), "--output", str(output), "--export", ",".join(FORMATS)]) == 0
    return output


def masks(output):
    return [cv2.imread(str(p), cv2.IMREAD_UNCHANGED) for p in sorted((output / "mask").iterdir())]


@pytest.mark.filterwarnings("ignore:__array__ implementation")  # pycocotools' own, when it decodes
def test_every_format_has_the_masks_that_the_command_wrote(exported):
    export, there = exported / "export", masks(exported)
    assert {path.name for path in export.iterdir()} == set(FORMATS)
    coco = COCO(str(export / "coco" / "annotations.json"))
    objects = json.loads((export / "bop/test/000000/scene_gt.json").read_text())
    for k, mask in enumerate(there):
        ids = np.unique(mask[mask > 0]).tolist()
        found = {a["track_id"]: coco.annToMask(a) > 0 for a in coco.loadAnns(coco.getAnnIds(imgIds=k))}
        assert sorted(found) == [line["obj_id"] for line in objects[str(k)]] == ids
        for i, a in enumerate(ids):
            for mine in (
                found[a],
                cv2.imread(str(export / f"bop/test/000000/mask_visib/{k:06d}_{i:06d}.png"), -1) > 0,
                cv2.imread(str(export / f"bundlesdf/object_{a}/masks/{k:06d}.png"), -1) > 0,
            ):
                np.testing.assert_array_equal(mine, mask == a)
    last = len(there) - 1
    with np.load(export / f"npz/{last:06d}.npz") as data:
        np.testing.assert_array_equal(data["segmap"], there[last])
    assert coco.dataset["images"][3]["file_name"] == "rgb/000003.png"


def test_the_motion_of_a_pushed_box_is_the_one_that_it_was_drawn_with_over_both_pushes(exported):
    file = exported / "export/poses/object_1.txt"
    p_WB = [float(x) for x in file.read_text().splitlines()[1].split(": ")[1].split(";")[0].split()]
    lines = np.loadtxt(file)
    assert lines[0, 0] <= 3 / 15 + 1e-9  # from the keyframe before the push on
    for time, *numbers in lines:
        k = round(15 * time)
        X_W = pose(k) @ inverse(pose(0))
        X_B0B = translation(-np.array(p_WB)) @ X_W @ translation(np.array(p_WB))
        # A twentieth of a pixel of 1.9 mm, and what that is in turn over a quarter of the box.
        np.testing.assert_allclose(numbers[:3], X_B0B[:3, 3], atol=1e-4)
        turn = Rotation.from_quat(numbers[3:]).as_matrix().T @ X_B0B[:3, :3]
        assert np.linalg.norm(Rotation.from_matrix(turn).as_rotvec()) < 4e-3
    assert round(15 * lines[-1, 0]) == len(MOVES) - 1


def test_the_cloud_of_a_pushed_box_lies_on_its_top_where_it_was_drawn_last(exported):
    points = np.asarray(trimesh.load(exported / "export/clouds/object_1.ply").vertices)
    p_BQ = move_points(inverse(pose(len(MOVES) - 1)), points)
    top = np.abs(p_BQ[:, 2] - HEIGHT) < 0.004
    assert np.mean(top) > 0.85  # the rest lies on the sides that the camera sees
    size = np.ptp(p_BQ[top][:, :2], axis=0)
    np.testing.assert_allclose(size, SIZE[:2], atol=0.006)  # three pixels
    np.testing.assert_allclose(np.median(p_BQ[top][:, :2], axis=0), [0, 0], atol=0.002)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--export", "cocoa"], "'cocoa' is no format; the formats are coco, bop, npz"),
        (["--export", ","], "no format is named; the formats are coco"),
        (["--export", "npz", "--export-frames", "1,x"], "'1,x' is no list of frame numbers"),
        (
            ["--export", "bop", "--export-frames", "1"],
            "--export-frames goes with --export npz only",
        ),
    ],
)
def test_what_cannot_be_exported_is_one_line_before_anything_is_written(film, tmp_path, words, said, capsys):
    output = tmp_path / "out"
    try:
        code = main(["segment", str(film), "--output", str(output), *words])
    except SystemExit as end:
        code = end.code
    assert code == 2
    error = capsys.readouterr().err
    assert said in " ".join(error.split())
    assert error.count("\n") == 1
    assert not output.exists()


def test_what_is_stopped_leaves_whole_files_of_what_was_seen(tmp_path):
    noted = []
    with pytest.raises(KeyboardInterrupt), exporting(Exports(tmp_path, ("coco", "clouds")), noted.append):
        raise KeyboardInterrupt
    assert json.loads((tmp_path / "export/coco/annotations.json").read_text())["images"] == []
    assert noted == []


def test_nothing_is_written_unless_it_is_asked_for(tmp_path):
    with exporting(Exports(tmp_path), pytest.fail):
        pass
    assert list(tmp_path.iterdir()) == []
