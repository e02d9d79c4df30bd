import json

import cv2
import numpy as np
import pytest

from riseg_drake.export.bop import BopExport
from riseg_drake.geometry.se3 import move_points
from tests.export.segmented_frames import CAMERA, FRAMES


@pytest.fixture
def folder(tmp_path):
    export = BopExport(tmp_path / "bop")
    for frame in FRAMES:
        export.take(frame)
    assert export.finish() == []
    return tmp_path / "bop"


def read(path):
    return cv2.imread(str(path), cv2.IMREAD_UNCHANGED)


def index(folder, name):
    return json.loads((folder / "test" / "000000" / f"{name}.json").read_text())


def test_masks_are_those_of_the_ids_that_scene_gt_lists_in_its_order(folder):
    objects, info = index(folder, "scene_gt"), index(folder, "scene_gt_info")
    assert list(objects) == list(info) == [str(frame.number) for frame in FRAMES]
    written = 0
    for frame in FRAMES:
        mask = np.zeros_like(frame.mask)
        for k, (line, more) in enumerate(zip(objects[str(frame.number)], info[str(frame.number)], strict=True)):
            visible = read(folder / "test/000000/mask_visib" / f"{frame.number:06d}_{k:06d}.png")
            assert set(np.unique(visible)) == {0, 255}
            mask[visible > 0] = line["obj_id"]
            x, y, width, height = cv2.boundingRect((visible > 0).astype(np.uint8))
            assert more == {
                "bbox_visib": [x, y, width, height],
                "px_count_visib": np.count_nonzero(visible),
            }
            written += 1
        np.testing.assert_array_equal(mask, frame.mask)
    assert len(list((folder / "test/000000/mask_visib").iterdir())) == written


def test_depth_times_its_scale_is_in_millimetres_and_colour_is_as_it_was(folder):
    for frame in FRAMES:
        scale = index(folder, "scene_camera")[str(frame.number)]["depth_scale"]
        depth = read(folder / "test/000000/depth" / f"{frame.number:06d}.png")
        np.testing.assert_allclose(depth * scale, frame.depth * 1000, atol=1e-4)
        color = read(folder / "test/000000/rgb" / f"{frame.number:06d}.png")
        np.testing.assert_array_equal(color[..., ::-1], frame.color)


def test_a_point_of_the_world_goes_through_the_camera_as_bop_says_to_its_pixel(folder):
    frame = FRAMES[3]
    camera = index(folder, "scene_camera")["3"]
    K, R = (np.reshape(camera[key], (3, 3)) for key in ("cam_K", "cam_R_w2c"))
    z = 700.0
    p_CQ = np.array([(50 - CAMERA.cx) / CAMERA.fx, (12 - CAMERA.cy) / CAMERA.fy, 1]) * z / 1000
    p_WQ = move_points(frame.X_WC, p_CQ)
    image = K @ (R @ (1000 * p_WQ) + camera["cam_t_w2c"])
    np.testing.assert_allclose(image, [50 * z, 12 * z, z], rtol=1e-9)


def test_the_camera_of_the_data_set_has_the_keys_that_bop_reads(folder):
    assert json.loads((folder / "camera.json").read_text()) == {
        "width": 64, "height": 48, "fx": 61.25, "fy": 60.75, "cx": 31.5, "cy": 23.25, "depth_scale": 1.0
    }  # fmt: skip
