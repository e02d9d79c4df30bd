"""`riseg convert`, and masks from a bag against masks from the folder that it was written to."""

import json

import cv2
import numpy as np
import pytest

pytest.importorskip("rosbags", reason="rosbags is not installed: pip install 'riseg-drake[bags]'")

from riseg_drake.app.cli import main
from tests.recording.made_bags import BagKind, write_bag
from tests.recording.made_recordings import SMALL, drawn_frames, write

pytestmark = pytest.mark.renders
KINDS = [
    BagKind(ros=1),
    BagKind(ros=1, color="png", depth="png"),
    BagKind(storage="mcap", bare=True, color="bgr8"),
    BagKind(poses="nothing"),
]


@pytest.fixture(scope="module")
def pushed():
    return drawn_frames(8, rate=10.0)


def masks(source, output, *more):
    assert main(["segment", str(source), "--output", str(output), *more]) == 0
    return {p.name: cv2.imread(str(p), cv2.IMREAD_UNCHANGED) for p in sorted((output / "mask").iterdir())}


@pytest.mark.parametrize("kind", KINDS)
def test_a_bag_gives_the_masks_of_its_folder_and_of_the_folder_it_is_converted_to(tmp_path, pushed, kind):
    bag = write_bag(tmp_path / "bag", pushed, SMALL, kind)
    of_bag = masks(bag, tmp_path / "out_bag")
    assert of_bag["000007.png"].any()
    assert main(["convert", str(bag), str(tmp_path / "converted")]) == 0
    folder = write(tmp_path / "folder", pushed)
    for source in (tmp_path / "converted", folder):
        found = masks(source, tmp_path / f"out_{source.name}")
        assert list(found) == list(of_bag)
        for name, mask in found.items():
            np.testing.assert_array_equal(mask, of_bag[name])


def test_a_folder_with_something_in_it_is_left_alone(tmp_path, pushed, capsys):
    folder = write(tmp_path / "folder", pushed)
    before = sorted(folder.rglob("*"))
    assert main(["convert", str(folder), str(folder)]) == 2
    assert "is not empty; give a new folder" in capsys.readouterr().err
    assert sorted(folder.rglob("*")) == before


def test_depth_keeps_its_units(tmp_path, pushed):
    folder = write(tmp_path / "folder", pushed)
    camera = json.loads((folder / "camera.json").read_text())
    (folder / "camera.json").write_text(json.dumps({**camera, "depth_scale": 5000}))
    assert main(["convert", str(folder), str(tmp_path / "out")]) == 0
    assert json.loads((tmp_path / "out" / "camera.json").read_text())["depth_scale"] == 5000
    for path in (folder / "depth").iterdir():
        written = cv2.imread(str(tmp_path / "out" / "depth" / path.name), cv2.IMREAD_UNCHANGED)
        np.testing.assert_array_equal(written, cv2.imread(str(path), cv2.IMREAD_UNCHANGED))
