import json

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from riseg_drake.recording.bop_scene import read_bop_scene
from riseg_drake.recording.layout import RecordingError, pose_from_numbers

K = [570.0, 0.0, 31.5, 0.0, 571.0, 23.5, 0.0, 0.0, 1.0]
R = Rotation.from_rotvec([0.3, -0.2, 0.5]).as_matrix()


def camera(**changed):
    given = {
        "cam_K": K,
        "depth_scale": 0.1,
        "cam_R_w2c": R.ravel().tolist(),
        "cam_t_w2c": [100.0, -50.0, 800.0],
    }
    return {**given, **changed}


def read(folder, content, rate=5.0):
    cv2.imwrite(str(folder / "0.png"), np.zeros((48, 64, 3), np.uint8))
    (folder / "scene_camera.json").write_text(json.dumps(content))
    return read_bop_scene(folder, folder / "0.png", rate, None)


def test_a_scenes_camera_is_a_pinhole_of_the_images_size_and_its_unit_that_of_a_tenth_of_a_millimetre(tmp_path):
    scene = read(tmp_path, {"0": camera()})
    k = scene.registration.intrinsics
    assert (k.width, k.height, k.fx, k.fy, k.cx, k.cy) == (64, 48, 570.0, 571.0, 31.5, 23.5)
    assert scene.depth_scale == pytest.approx(10_000)
    without = camera()
    del without["depth_scale"]
    assert read(tmp_path, {"0": without}).depth_scale == pytest.approx(1000)


def test_poses_are_those_of_the_camera_in_the_world_in_metres_in_the_order_of_their_numbers(tmp_path):
    scene = read(tmp_path, {"10": camera(cam_t_w2c=[0.0, 0.0, 1000.0]), "2": camera()})
    np.testing.assert_allclose(scene.poses.times, [0.4, 2.0])
    for values, p_CW in zip(scene.poses.values, ([0.1, -0.05, 0.8], [0.0, 0.0, 1.0]), strict=True):
        X_WC = pose_from_numbers(values)
        np.testing.assert_allclose(X_WC[:3, :3], R.T, atol=1e-9)
        np.testing.assert_allclose(X_WC[:3, 3], -R.T @ p_CW, atol=1e-9)


def test_without_a_pose_for_each_image_there_are_none(tmp_path):
    without = camera()
    del without["cam_R_w2c"]
    assert read(tmp_path, {"0": camera(), "1": without}).poses is None


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ({"0": camera(), "1": camera(depth_scale=1.0)}, "differs between images"),
        ({"0": camera(), "1": camera(cam_K=[571.0, *K[1:]])}, "differs between images"),
        ({"0": camera(depth_scale=0)}, "a number above 0"),
        ({"0": camera(depth_scale=-1)}, "a number above 0"),
        ({"0": camera(cam_K=K[:8])}, '"cam_K" must hold 9 numbers'),
        ({"0": camera(cam_t_w2c=[0, 0])}, '"cam_t_w2c" must hold 3 numbers'),
        ({"0": camera(cam_t_w2c=[0, 0, 1e9])}, '"cam_t_w2c" must hold 3 numbers'),
        ({"0": camera(cam_R_w2c=(-R).ravel().tolist())}, "no rotation"),
        ({"0": camera(cam_R_w2c=(1.01 * R).ravel().tolist())}, "no rotation"),
        ({"first": camera()}, "a camera for each image's number"),
        ({}, "a camera for each image's number"),
        ([camera()], "a camera for each image's number"),
    ],
)
def test_what_is_wrong_with_it_is_said(tmp_path, content, said):
    with pytest.raises(RecordingError, match=said):
        read(tmp_path, content)
