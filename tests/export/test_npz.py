import cv2
import numpy as np

from riseg_drake.export.npz import NpzExport
from tests.export.segmented_frames import FRAMES


def exported(folder, *numbers):
    export = NpzExport(folder, numbers)
    for frame in FRAMES:
        export.take(frame)
    notes = export.finish()
    return sorted(path.name for path in folder.iterdir()), notes


def test_a_file_holds_what_its_inference_reads_in_metres_with_the_mask_and_colours_that_it_swaps(tmp_path):
    assert exported(tmp_path, 2)[0] == ["000002.npz"]
    with np.load(tmp_path / "000002.npz", allow_pickle=False) as data:
        assert sorted(data.files) == ["K", "depth", "rgb", "segmap"]
        frame = FRAMES[2]
        np.testing.assert_array_equal(data["segmap"], frame.mask)
        np.testing.assert_array_equal(data["depth"], frame.depth)
        assert data["depth"].dtype == np.float32
        np.testing.assert_array_equal(data["K"].reshape(3, 3), [[61.25, 0, 31.5], [0, 60.75, 23.25], [0, 0, 1]])
        np.testing.assert_array_equal(cv2.cvtColor(data["rgb"], cv2.COLOR_BGR2RGB), frame.color)


def test_unless_frames_are_named_it_is_the_last_one_and_that_is_said(tmp_path):
    files, (note,) = exported(tmp_path)
    assert files == ["000003.npz"]
    assert note == "npz: the last frame, number 3 at 1.7 s"


def test_a_frame_that_never_came_is_named(tmp_path):
    files, notes = exported(tmp_path, 0, 3, 7, 9)
    assert files == ["000000.npz", "000003.npz"]
    assert notes == ["npz: no frame 7, 9; they go from 0 to 3"]
