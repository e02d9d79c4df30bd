import numpy as np
import pytest
from drake import lcmt_image_array, lcmt_viewer_draw
from pydrake.math import RigidTransform, RollPitchYaw

from riseg_drake.stations.ground_truth import decode_labels, decode_poses, encode_labels, encode_poses
from riseg_drake.stations.lcm_images import ImageError

STAMP = 1_700_000_000_123  # ms


def test_labels_come_back_exactly_with_the_pictures_stamp():
    labels = np.random.default_rng(0).integers(0, 40000, (20, 30)).astype(np.uint16)
    truth = decode_labels(lcmt_image_array.decode(encode_labels(labels, STAMP, 3).encode()))
    np.testing.assert_array_equal(truth.labels, labels)
    assert truth.time == 1_700_000_000.123


def test_poses_and_axes_come_back_by_object_id():
    poses = {
        1: RigidTransform(RollPitchYaw(0.1, -0.4, 2.0), [0.5, -0.1, 0.02]),
        2: RigidTransform(RollPitchYaw(3.0, 0.0, 0.0), [0.4, 0.2, 0.03]),
    }
    names = {1: "orange", 2: "leopard"}
    axes = {1: np.eye(3), 2: np.zeros((0, 3))}
    truth = decode_poses(lcmt_viewer_draw.decode(encode_poses(names, poses, axes, STAMP).encode()))
    assert truth.names == names
    assert truth.time == 1_700_000_000.123
    for object_id, X_WBcm in poses.items():
        np.testing.assert_allclose(truth.X_WBcm[object_id], X_WBcm.GetAsMatrix4(), atol=1e-6)
        np.testing.assert_array_equal(truth.axes[object_id], axes[object_id])


def test_a_message_without_labels_is_refused():
    with pytest.raises(ImageError, match="no labels: frames are none"):
        decode_labels(lcmt_image_array())
