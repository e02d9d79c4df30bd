import os

import cv2
import numpy as np
import pytest

from riseg_drake.export.bundlesdf import BundleSdfExport
from tests.export.segmented_frames import FRAMES, NOTHING


def refuse(*_):
    raise OSError("no links here")


@pytest.mark.parametrize("links", [True, False])
def test_each_id_has_a_film_of_the_frames_that_show_it_with_masks_to_the_pixel(tmp_path, monkeypatch, links):
    if not links:
        monkeypatch.setattr(os, "link", refuse)
    export = BundleSdfExport(tmp_path)
    for frame in FRAMES:
        export.take(frame)
    assert export.finish() == []
    assert sorted(path.name for path in tmp_path.iterdir()) == ["object_2", "object_300"]
    shown = [frame for frame in FRAMES if frame.number != NOTHING]
    for object_id in (2, 300):
        folder = tmp_path / f"object_{object_id}"
        K = np.loadtxt(folder / "cam_K.txt").reshape(3, 3)
        np.testing.assert_array_equal(K, [[61.25, 0, 31.5], [0, 60.75, 23.25], [0, 0, 1]])
        for part in ("rgb", "depth", "masks"):
            assert sorted(p.name for p in (folder / part).iterdir()) == [f"{f.stem}.png" for f in shown]
        for frame in shown:
            color, depth, mask = (
                cv2.imread(str(folder / part / f"{frame.stem}.png"), cv2.IMREAD_UNCHANGED)
                for part in ("rgb", "depth", "masks")
            )
            np.testing.assert_array_equal(mask > 0, frame.mask == object_id)
            np.testing.assert_array_equal(color[..., ::-1], frame.color)
            assert depth.dtype == np.uint16
            np.testing.assert_allclose(depth / 1e3, frame.depth, atol=1e-6)
