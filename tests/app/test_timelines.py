import cv2
import numpy as np
import pytest

from riseg_drake.app.cli import main
from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.recording.layout import RecordedFrame
from tests.recording.made_recordings import write
from tests.segmentation.drawn_scene import DrawnScene, Texture, looking_down, planar
from tests.timeline.read_back import rows

CAMERA = Intrinsics(160, 120, 154.0, 153.9, 78.7, 59.2)


@pytest.fixture(scope="module")
def film(tmp_path_factory):
    scene = DrawnScene([(0.09, 0.08, 0.04)], table=Texture(9, contrast=10), intrinsics=CAMERA)
    rng = np.random.default_rng(0)
    frames = []
    for k in range(12):
        frame, label = scene.frame(k, looking_down(), [planar(0.0, 0.004 * max(k - 2, 0))], rng)
        frames.append(RecordedFrame(k / 15, frame.color, frame.depth, looking_down(), labels=label))
    return write(tmp_path_factory.mktemp("film") / "recording", frames, CAMERA)


def test_a_segmentation_has_its_masks_and_scores_on_the_time_line(film, tmp_path, capsys):
    assert main(["segment", str(film), "--output", str(tmp_path / "out"), "--rerun"]) == 0
    assert f"to look at: rerun {tmp_path}/out/rerun.rrd" in capsys.readouterr().out
    there = rows(tmp_path / "out" / "rerun.rrd")
    written = [cv2.imread(str(file), -1) for file in sorted((tmp_path / "out" / "mask").iterdir())]
    masks = there["camera/image/mask"]
    np.testing.assert_allclose([time for time, _ in masks], np.arange(12) / 15, atol=1e-6)
    for (_, logged), mask in zip(masks, written, strict=True):
        np.testing.assert_array_equal(
            np.frombuffer(bytes(logged["buffer"][0]), np.uint16).reshape(mask.shape), mask
        )
    assert len(there[r"scores/Overlap\ F"]) == len(there["stages/OpticalFlow"]) == 12
    assert "twists/group_0/v" in there


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--rerun", "out.bag"], "--rerun out.bag: Rerun's files end in .rrd"),
        (["--rerun", "there.rrd"], "there is a file of another kind"),
    ],
)
def test_what_cannot_be_a_time_line_is_one_line_before_anything_is_written(
    film, tmp_path, words, said, capsys, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "there.rrd").write_text("mine")
    assert main(["segment", str(film), "--output", "out", *words]) == 2
    error = capsys.readouterr().err
    assert said in " ".join(error.split())
    assert error.count("\n") == 1
    assert not (tmp_path / "out").exists()
