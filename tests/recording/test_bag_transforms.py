"""A tree of frames, against poses chained by hand."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from riseg_drake.geometry.se3 import inverse
from riseg_drake.recording.bag_transforms import TransformTree, stamped_table

LIMIT = 0.5


def pose(seed):
    """[tx, ty, tz, qx, qy, qz, qw] and the matrix that it is."""
    rng = np.random.default_rng(seed)
    R = Rotation.from_rotvec(rng.normal(size=3))
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = R.as_matrix(), rng.normal(size=3)
    return [*X[:3, 3], *R.as_quat()], X


@pytest.fixture
def tree():
    """world - base - arm (moves) - hand - camera; base - table; and a frame apart."""
    tree, X = TransformTree(), {}
    for seed, (parent, child) in enumerate(
        [("world", "base"), ("arm", "hand"), ("hand", "camera"), ("base", "table"), ("moon", "crater")]
    ):
        numbers, X[child] = pose(seed)
        tree.add(parent, child, 0.0, numbers, static=True)
    for time in (2.0, 1.0):
        numbers, X[f"arm {time:.0f}"] = pose(10 + int(time))
        tree.add("base", "arm", time, numbers, static=False)
    return tree, X


@pytest.mark.parametrize("time", [1.0, 2.0])
def test_poses_are_chained_up_and_down_to_where_both_hang(tree, time):
    tree, X = tree
    arm = X[f"arm {time:.0f}"]
    camera = arm @ X["hand"] @ X["camera"]
    expected = {
        ("world", "camera"): X["base"] @ camera,
        ("camera", "world"): inverse(X["base"] @ camera),
        ("table", "camera"): inverse(X["table"]) @ camera,
        ("camera", "table"): inverse(camera) @ X["table"],
        ("hand", "camera"): X["camera"],
        ("camera", "camera"): np.eye(4),
        ("world", "base"): X["base"],
    }
    for (a, b), X_AB in expected.items():
        np.testing.assert_allclose(tree.X_AB(a, b, time, LIMIT), X_AB, atol=1e-9)


def test_between_two_moments_a_frame_is_between_its_poses_and_too_far_from_one_it_has_none(tree):
    tree, X = tree
    middle = tree.X_AB("base", "arm", 1.5, 2.0)
    np.testing.assert_allclose(middle[:3, 3], (X["arm 1"][:3, 3] + X["arm 2"][:3, 3]) / 2, atol=1e-9)
    for a, b in (("world", "camera"), ("camera", "world")):
        assert tree.X_AB(a, b, 3.0, LIMIT) is None
    assert tree.X_AB("world", "table", 99.0, LIMIT) is not None
    # What comes in later counts, though it was asked before.
    numbers, X_later = pose(77)
    tree.add("base", "arm", 3.0, numbers, static=False)
    np.testing.assert_allclose(tree.X_AB("base", "arm", 3.0, LIMIT), X_later, atol=1e-9)


def test_the_tree_knows_its_frames_who_moves_and_what_hangs_together(tree):
    tree, _ = tree
    assert tree.frames() == {"world", "base", "arm", "hand", "camera", "table", "moon", "crater"}
    assert tree.ancestors("camera") == ["camera", "hand", "arm", "base", "world"]
    assert tree.moving("camera", "table") == ["arm"]
    assert tree.moving("table", "camera") == ["arm"]
    assert tree.moving("world", "table") == []
    assert tree.connected("camera", "table")
    assert not tree.connected("camera", "crater")


def test_a_circle_of_frames_ends():
    tree = TransformTree()
    tree.add("a", "b", 0.0, pose(0)[0], static=True)
    tree.add("b", "a", 0.0, pose(1)[0], static=True)
    assert tree.ancestors("a") == ["a", "b"]


def test_rows_are_sorted_by_time_and_of_one_time_the_first_counts():
    table = stamped_table("joints", [3.0, 1.0, 3.0, 2.0], [30, 31, 10, 11, 32, 33, 20, 21], ["a", "b"])
    np.testing.assert_array_equal(table.times, [1, 2, 3])
    np.testing.assert_array_equal(table.values, [[10, 11], [20, 21], [30, 31]])
    assert table.names == ["a", "b"]
