"""The kernel beside numpy: sorted by nearness, the nearest drawn last."""

import numpy as np
import pytest

from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.geometry.se3 import exp_se3
from riseg_drake.kernels.drawing import drawn_labels
from riseg_drake.segmentation.expected_flow import pixel_projection

CAMERA = Intrinsics(40, 30, 38.0, 37.0, 19.5, 14.5)
STILL = pixel_projection(np.eye(4), CAMERA)


def drawn(u, v, z, label, motion, M, shape=CAMERA.shape):
    u, v, z = (np.asarray(x, np.float32) for x in (u, v, z))
    pixel = np.stack([u, v, np.ones_like(z), 1 / z])
    return drawn_labels(pixel, np.asarray(label, np.uint16), np.asarray(motion, np.intp), np.asarray(M), shape)


def test_what_is_nearest_is_on_top_whichever_comes_first():
    for order in ([0, 1], [1, 0]):
        z, label = np.array([0.5, 0.4])[order], np.array([3, 7])[order]
        out, per_depth = drawn([12, 12], [9, 9], z, label, [0, 0], [STILL])
        assert out[9, 12] == 7
        assert per_depth[9, 12] == pytest.approx(2.5)
        assert np.count_nonzero(out) == 1


def test_each_pixel_goes_by_its_own_motion():
    # 1 m away, 2 / 38 m to the right are two pixels.
    X = np.eye(4)
    X[0, 3] = 2 / CAMERA.fx
    out, _ = drawn([5, 20], [6, 6], [1, 1], [1, 2], [0, 1], [STILL, pixel_projection(X, CAMERA)])
    np.testing.assert_array_equal(np.argwhere(out), [[6, 5], [6, 22]])


def test_what_is_behind_the_camera_or_outside_the_image_is_not_drawn():
    behind = np.diag([1.0, 1.0, 1.0, 1.0])
    behind[2, 3] = -2
    out, per_depth = drawn(
        [5, -1, 40, 3, 3], [6, 3, 3, -1, 30], np.ones(5), np.ones(5), [1, 0, 0, 0, 0],
        [STILL, pixel_projection(behind, CAMERA)],
    )  # fmt: skip
    assert not out.any()
    assert not per_depth.any()


def test_it_draws_what_sorting_by_nearness_draws():
    rng = np.random.default_rng(0)
    count = 3000
    u, v, z = rng.uniform(0, 40, count), rng.uniform(0, 30, count), rng.uniform(0.3, 0.9, count)
    label, motion = rng.integers(1, 50, count), rng.integers(0, 2, count)
    X = [np.eye(4), exp_se3(np.array([0.05, -0.1, 0.2, 0.03, -0.02, 0.05]))]
    M = np.array([pixel_projection(each, CAMERA) for each in X])
    out, per_depth = drawn(u, v, z, label, motion, M)
    homogeneous = np.stack([u, v, np.ones(count), 1 / z])
    a, b, c = np.einsum("nij,jn->in", M[motion], homogeneous)
    j, i = np.rint(a / c).astype(int), np.rint(b / c).astype(int)
    inside = np.flatnonzero((i >= 0) & (j >= 0) & (i < 30) & (j < 40))
    inside = inside[np.argsort(1 / (z * c)[inside])]
    expected, nearness = np.zeros((30, 40), int), np.zeros((30, 40))
    expected[i[inside], j[inside]] = label[inside]
    nearness[i[inside], j[inside]] = 1 / (z * c)[inside]
    np.testing.assert_array_equal(out, expected)
    np.testing.assert_allclose(per_depth, nearness, rtol=1e-5)
