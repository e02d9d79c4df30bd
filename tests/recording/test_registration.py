import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.recording.layout import RecordingError
from riseg_drake.recording.registration import lens_of, registration_from_json

K = Intrinsics(64, 48, 60.0, 61.0, 31.0, 23.0)
DEPTH = {"width": 40, "height": 36, "fx": 30.0, "fy": 30.5, "cx": 19.5, "cy": 17.5}
QUATERNION = Rotation.from_rotvec([0.0, 0.0, 0.1]).as_quat().tolist()


def read(**content):
    return registration_from_json({"depth_scale": 1000, **content}, K)


def test_a_camera_alone_has_its_own_lens_and_depth_is_aligned_to_it():
    registration = read(distortion=[0.1, 0.0, 0.0, 0.0])
    assert registration.intrinsics == K
    assert registration.depth is None
    assert registration.depth_shape == (48, 64)
    assert tuple(registration.color.distortion) == (0.1, 0.0, 0.0, 0.0)
    assert not registration.color.fisheye


def test_a_depth_camera_of_its_own_has_its_lens_and_its_pose_in_the_colour_camera():
    registration = read(depth={**DEPTH, "X_CD": [0.015, 0.0, -0.002, *QUATERNION], "fisheye": True})
    assert registration.depth_shape == (36, 40)
    assert registration.depth.intrinsics.fy == 30.5
    assert registration.depth.fisheye
    assert not registration.color.fisheye
    c, s = np.cos(0.1), np.sin(0.1)
    expected = [[c, -s, 0, 0.015], [s, c, 0, 0], [0, 0, 1, -0.002], [0, 0, 0, 1]]
    np.testing.assert_allclose(registration.X_CD, expected, atol=1e-12)


def test_depth_of_a_wall_beside_the_colour_camera_is_the_wall_s_and_of_an_aligned_one_is_kept():
    apart = read(depth={**DEPTH, "X_CD": [0.0, 0.0, -0.05, 0.0, 0.0, 0.0, 1.0]})
    seen = apart.registered_depth(np.full((36, 40), 0.8, np.float32))
    assert seen.shape == (48, 64)
    assert seen[24, 32] == pytest.approx(0.75)
    depth = np.random.default_rng(0).uniform(0.3, 1.0, K.shape).astype(np.float32)
    np.testing.assert_array_equal(read().registered_depth(depth), depth)
    ids = np.arange(48 * 64, dtype=np.uint16).reshape(K.shape)
    np.testing.assert_array_equal(read().registered_mask(ids), ids)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ({"distortion": [0.1, 0.2]}, "holds 2 numbers"),
        ({"distortion": [0.1] * 5, "fisheye": True}, "holds 5 numbers; OpenCV knows 0, 4"),
        ({"distortion": [True, 0, 0, 0]}, "must be a list of numbers"),
        ({"distortion": "none"}, "must be a list of numbers"),
        ({"distortion": [1e9, 0, 0, 0]}, "must be a list of numbers"),
        ({"depth": 3}, "must be an object"),
        ({"depth": DEPTH}, '"X_CD" must be a list of numbers'),
        ({"depth": {**DEPTH, "X_CD": [0, 0, 0, 0, 0, 1]}}, '"X_CD" of "depth" must hold'),
        ({"depth": {**DEPTH, "X_CD": [0, 0, 0, 0, 0, 0, 1.02]}}, '"X_CD" of "depth" must hold'),
        (
            {"depth": {**DEPTH, "distortion": [1.0], "X_CD": [0, 0, 0, 0, 0, 0, 1]}},
            '"depth": "distortion" holds 1',
        ),
    ],
)
def test_what_is_wrong_with_it_is_said(content, said):
    with pytest.raises(RecordingError, match=said):
        read(**content)


def test_a_fisheye_has_four_coefficients_and_another_lens_the_numbers_that_opencv_knows():
    assert lens_of(K, (), fisheye=True).fisheye
    for count in (0, 4, 5, 8):
        assert len(lens_of(K, (0.0,) * count).distortion) == count
