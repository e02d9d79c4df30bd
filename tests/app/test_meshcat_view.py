import numpy as np
from pydrake.geometry import Meshcat

from riseg_drake.app.meshcat_view import POINT_STRIDE, draw_arrow, object_cloud
from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.geometry.rgbd import Frame
from riseg_drake.pictures.object_colors import object_colors
from riseg_drake.pushing.push import Push

INTRINSICS = Intrinsics(30, 30, 30.0, 30.0, 15.0, 15.0)


def frame():
    """A camera 1 m above the table, looking straight down at a plane 0.5 m away."""
    X_WC = np.diag([1.0, -1.0, -1.0, 1.0])
    X_WC[:3, 3] = [0.3, 0.0, 1.0]
    robot = np.zeros((30, 30), bool)
    robot[27:] = True
    depth = np.full((30, 30), 0.5, np.float32)
    depth[:3] = 0
    return Frame(0, 0.0, INTRINSICS, np.full((30, 30, 3), 90, np.uint8), depth, X_WC, robot)


def test_points_lie_in_the_world_in_the_colours_of_their_objects():
    mask = np.zeros((30, 30), np.uint16)
    mask[15, 15] = 4
    cloud = object_cloud(frame(), mask)
    # 10 x 10 points, less a row without depth and a row on the robot.
    assert cloud.size() == (30 // POINT_STRIDE) ** 2 - 20
    np.testing.assert_allclose(cloud.xyzs()[2], 0.5, atol=1e-6)
    (middle,) = np.flatnonzero(np.linalg.norm(cloud.xyzs().T - [0.3, 0, 0.5], axis=1) < 1e-6)
    np.testing.assert_array_equal(cloud.rgbs()[:, middle], object_colors(np.array(4)))
    assert (np.delete(cloud.rgbs(), middle, axis=1) == 90).all()


def test_a_push_is_drawn_as_shaft_and_head():
    meshcat = Meshcat()
    push = Push(
        p_WE=np.zeros(3),
        tip_height=0.01,
        direction_W=np.array([0.6, 0.8]),
        p_WB=np.array([0.5, 0.0, 0.02]),
        length=0.03,
        d_push=0.02,
        center_W=np.zeros(2),
        cluster_W=np.zeros((0, 2)),
        tallest=0.03,
        cost=0.0,
    )
    draw_arrow(meshcat, "/push", push)
    assert meshcat.HasPath("/push/shaft")
    assert meshcat.HasPath("/push/head")
