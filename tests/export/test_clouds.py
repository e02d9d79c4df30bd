from dataclasses import replace

import numpy as np
import pytest
import trimesh
from pydrake.math import RigidTransform, RollPitchYaw

from riseg_drake.export.clouds import CloudExport, CloudParameters, VoxelCloud
from riseg_drake.geometry.camera import project
from riseg_drake.geometry.se3 import inverse, move_points
from tests.export.segmented_frames import CAMERA, FRAMES

FINE = CloudParameters(voxel=1e-6)
"""No two pixels fall into one voxel."""
MOVED = RigidTransform(RollPitchYaw(0.1, -0.2, 0.7), [0.05, -0.02, 0.01]).GetAsMatrix4()
STILL = np.eye(4)


def read(folder, object_id):
    cloud = trimesh.load(folder / f"object_{object_id}.ply")
    return np.asarray(cloud.vertices), np.asarray(cloud.colors)[:, :3]


def seen_by(frame, object_id):
    """Pixels (v, u) of an object with depth."""
    return np.nonzero((frame.mask == object_id) & (frame.depth > 0))


def points_of(frame, object_id):
    """p_WQ by the pinhole's own formula."""
    v, u = seen_by(frame, object_id)
    z = frame.depth[v, u].astype(float)
    p_CQ = np.stack([(u - CAMERA.cx) / CAMERA.fx * z, (v - CAMERA.cy) / CAMERA.fy * z, z], axis=-1)
    return move_points(frame.X_WC, p_CQ)


def same_points(a, b, atol=2e-6):
    """Whether two clouds are one but for their order."""
    assert len(a) == len(b)
    a, b = (x[np.lexsort(np.rint(x / 1e-5).T)] for x in (a, b))
    np.testing.assert_allclose(a, b, atol=atol)


def test_trimesh_reads_points_that_project_into_the_very_pixels_of_the_mask_with_their_colours(tmp_path):
    frame = FRAMES[3]
    export = CloudExport(tmp_path, FINE)
    export.take(frame, {2: STILL, 300: STILL}, 1.5)
    assert export.finish([2, 300]) == []
    for object_id in (2, 300):
        points, colors = read(tmp_path, object_id)
        uv = project(move_points(inverse(frame.X_WC), points), CAMERA)
        u, v = np.rint(uv).astype(int).T
        np.testing.assert_allclose(uv, np.stack([u, v], axis=-1), atol=1e-3)
        drawn = np.zeros(CAMERA.shape, bool)
        drawn[v, u] = True
        np.testing.assert_array_equal(drawn, (frame.mask == object_id) & (frame.depth > 0))
        np.testing.assert_array_equal(colors, frame.color[v, u])


def test_what_was_seen_before_a_push_is_found_where_the_push_took_it():
    first, then = FRAMES[0], FRAMES[3]
    export = CloudExport(None, FINE)
    export.take(first, {2: STILL}, 1.0)
    export.take(then, {2: MOVED}, 2.0)
    moved = move_points(MOVED, points_of(first, 2))
    same_points(export.clouds()[2][0], np.concatenate([moved, points_of(then, 2)]))


def test_a_cloud_follows_its_object_that_is_pushed_on_while_nobody_sees_it():
    export = CloudExport(None, FINE)
    export.take(FRAMES[0], {2: STILL}, 1.0)
    export.take(FRAMES[1], {2: MOVED}, None)
    same_points(export.clouds()[2][0], move_points(MOVED, points_of(FRAMES[0], 2)))


def test_of_a_motion_that_is_not_known_only_the_last_rest_is_fused():
    export = CloudExport(None, FINE)
    for frame, rest in ((FRAMES[0], 1.0), (FRAMES[2], 2.0), (FRAMES[3], 2.0)):
        export.take(frame, {}, rest)
    expected = np.concatenate([points_of(FRAMES[2], 2), points_of(FRAMES[3], 2)])
    same_points(export.clouds()[2][0], expected)


def test_in_motion_nothing_is_fused_unless_there_is_nothing_else():
    export = CloudExport(None, FINE)
    export.take(FRAMES[0], {2: STILL}, None)
    export.take(FRAMES[2], {2: STILL}, None)
    same_points(export.clouds()[2][0], points_of(FRAMES[2], 2))
    export.take(FRAMES[3], {2: STILL}, 2.0)
    export.take(FRAMES[0], {2: STILL}, None)
    same_points(export.clouds()[2][0], points_of(FRAMES[3], 2))


def test_a_voxel_holds_the_mean_of_what_fell_into_it_in_any_number_of_frames():
    cloud = VoxelCloud(0.01)
    cloud.add(
        np.array([[0.001, 0.001, 0.001], [-0.001, 0.001, 0.001]]), np.array([[0, 10, 20], [1, 2, 3]], np.uint8)
    )
    cloud.add(np.array([[0.003, 0.001, 0.005]]), np.array([[100, 10, 40]], np.uint8))
    np.testing.assert_allclose(cloud.points, [[-0.001, 0.001, 0.001], [0.002, 0.001, 0.003]])
    np.testing.assert_array_equal(cloud.colors, [[1, 2, 3], [50, 10, 30]])


def test_an_object_without_depth_has_no_file_and_a_line_and_one_that_is_no_longer_known_has_neither(tmp_path):
    export = CloudExport(tmp_path / "clouds")
    export.take(replace(FRAMES[0], depth=np.where(FRAMES[0].mask == 2, 0, FRAMES[0].depth)), {}, 1.0)
    assert export.finish([2]) == ["clouds: no file for object 2: no pixel of it has depth"]
    assert not (tmp_path / "clouds").exists()
    with pytest.raises(KeyError):
        export.clouds()[2]
