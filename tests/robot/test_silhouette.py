import numpy as np
import pytest
from pydrake.geometry import (
    Box,
    ClippingRange,
    DepthRange,
    DepthRenderCamera,
    Mesh,
    RenderCameraCore,
    RenderEngineVtkParams,
)
from pydrake.math import RigidTransform
from pydrake.planning import RobotDiagramBuilder
from pydrake.systems.sensors import CameraInfo, RgbdSensor
from scipy.spatial import ConvexHull

from riseg_drake.app.segmentation_block import FIXED_MARGIN_M, FIXED_MARGIN_PX
from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.robot.description import PandaDescription, add_panda
from riseg_drake.robot.kinematics import READY, PandaKinematics, observe_pose, tip_pointing_down
from riseg_drake.robot.silhouette import NEAR, RobotSilhouette, UnknownShapeError, _grown, hull_corners
from riseg_drake.stations.render_engine import make_render_engine

D415 = Intrinsics(640, 480, 616.285, 615.778, 301.418, 232.864)
D405 = Intrinsics(640, 480, 433.0, 433.0, 319.5, 239.5)


@pytest.fixture(scope="module")
def rendered_robot():
    """A function q -> bool [H, W]: where Drake's label image shows the robot."""
    return renderer_of_robot()


@pytest.fixture(scope="module")
def hand():
    return PandaKinematics(PandaDescription(tool="hand"))


def renderer_of_robot(X_WC=None, tool="bar", camera=D415):
    """The same, for a camera fixed to the world at X_WC, for another tool, and for another camera."""
    builder = RobotDiagramBuilder(time_step=0.0)
    plant, scene_graph = builder.plant(), builder.scene_graph()
    frame = add_panda(plant, PandaDescription(tool=tool), X_WC).camera_frame
    plant.Finalize()
    scene_graph.AddRenderer("vtk", make_render_engine(RenderEngineVtkParams()))
    k = camera
    core = RenderCameraCore(
        "vtk",
        CameraInfo(k.width, k.height, k.fx, k.fy, k.cx, k.cy),
        ClippingRange(NEAR, 5.0),
        RigidTransform(),
    )
    sensor = builder.builder().AddSystem(
        RgbdSensor(
            plant.GetBodyFrameIdOrThrow(frame.body().index()),
            frame.GetFixedPoseInBodyFrame(),
            DepthRenderCamera(core, DepthRange(0.1, 4.0)),
        )
    )
    builder.builder().Connect(scene_graph.get_query_output_port(), sensor.query_object_input_port())
    diagram = builder.Build()
    root = diagram.CreateDefaultContext()

    def draw(q):
        plant.SetPositions(diagram.mutable_plant_context(root), q)
        image = sensor.label_image_output_port().Eval(sensor.GetMyContextFromRoot(root))
        return image.data[..., 0] < 32766

    return draw


def postures(panda):
    poses = [
        observe_pose([0.5, 0, 0], 0.5, panda.X_EC),
        tip_pointing_down([0.55, 0.0, 0.01], 1.0),
        tip_pointing_down([0.36, 0.1, 0.2], 2.6),
        tip_pointing_down([0.38, 0.0, 0.3], -2.4),
    ]
    return [panda.solve_ik(X_WE) for X_WE in poses]


@pytest.mark.renders
def test_without_margin_the_silhouette_is_what_drake_renders(panda, rendered_robot):
    silhouette = RobotSilhouette(panda, D415, margin_m=0.0, margin_px=0.0)
    for q in postures(panda):
        drawn, true = silhouette.mask(q), rendered_robot(q)
        assert true.any()
        assert (drawn & true).sum() / (drawn | true).sum() > 0.96


@pytest.mark.renders
def test_with_margin_the_silhouette_covers_every_rendered_pixel_and_little_else(panda, rendered_robot):
    silhouette = RobotSilhouette(panda, D415)
    for q in postures(panda):
        drawn, true = silhouette.mask(q), rendered_robot(q)
        assert (drawn & true).sum() == true.sum()
        assert (drawn & true).sum() / (drawn | true).sum() > 0.75


@pytest.mark.renders
def test_the_hand_is_drawn_where_drake_renders_it(hand):
    rendered = renderer_of_robot(tool="hand", camera=D405)
    bare, wide = RobotSilhouette(hand, D405, 0.0, 0.0), RobotSilhouette(hand, D405)
    for q in postures(hand):
        true = rendered(q)
        assert true.any()
        assert (bare.mask(q) & true).sum() / (bare.mask(q) | true).sum() > 0.96
        assert (wide.mask(q) & true).sum() == true.sum()


@pytest.mark.renders
def test_a_fixed_camera_sees_the_whole_arm_and_every_link_of_it_is_drawn():
    # 2 m ahead of the base, at 0.5 m, looking back at the arm: x is W's y, y points down.
    X_WC = np.array([[0, 0, -1, 2.0], [1, 0, 0, 0], [0, -1, 0, 0.5], [0, 0, 0, 1]])
    fixed, rendered = PandaKinematics(PandaDescription(), X_WC), renderer_of_robot(X_WC)
    for q in (
        READY,
        READY + np.array([0.8, 0.3, -0.5, 0.4, 1.0, -0.5, 0.7]),
        np.array([0, 0.9, 0, -1.0, 0, 1.9, 0]),
    ):
        drawn, true = RobotSilhouette(fixed, D415, 0.0, 0.0).mask(q), rendered(q)
        assert true.sum() > 10_000
        assert (drawn & true).sum() / (drawn | true).sum() > 0.96
        widely = RobotSilhouette(fixed, D415, FIXED_MARGIN_M, FIXED_MARGIN_PX).mask(q)
        assert (widely & true).sum() == true.sum()
        assert (widely & true).sum() / widely.sum() > 0.7


def test_the_pusher_enters_only_at_the_lower_edge_and_hides_nothing_that_it_pushes(panda):
    q = panda.solve_ik(tip_pointing_down([0.5, 0.0, 0.01], 0.3))
    mask = RobotSilhouette(panda, D415).mask(q)
    p_CTip = np.linalg.inv(panda.X_EC)[:3, 3]
    v_front = D415.cy + D415.fy * (p_CTip[1] - 0.01) / p_CTip[2]
    rows, columns = np.nonzero(mask)
    assert rows.min() > v_front - 5
    assert columns.max() - columns.min() < 100


def test_a_hull_grows_by_the_margin_at_each_of_its_faces():
    box = np.array(np.meshgrid([-1, 1], [-2, 2], [-3, 3])).reshape(3, -1).T.astype(float)
    corners, edges = _grown(np.vstack([box, np.zeros((1, 3))]), 0.5)
    assert sorted(map(tuple, np.abs(corners))) == [pytest.approx((1.5, 2.5, 3.5))] * 8
    # 12 edges, and a diagonal of each face.
    assert len(edges) == 18
    # Two faces that are all but one (their normals differ by 0.02) go out by the margin.
    ridge = np.array([[x, y, -0.01 * abs(x) - (z < 0)] for x in (-1, 0, 1) for y in (-1, 1) for z in (0, -1)])
    top = _grown(ridge, 0.1)[0]
    at_ridge = top[(np.abs(top[:, 0]) < 0.5) & (top[:, 2] > -0.5)]
    assert at_ridge[:, 2] == pytest.approx([0.1, 0.1], abs=1e-4)
    assert np.abs(at_ridge[:, 1]) == pytest.approx([1.1, 1.1], abs=1e-4)


def test_a_margin_grows_the_silhouette_on_every_side(panda):
    q = panda.solve_ik(observe_pose([0.5, 0, 0], 0.5, panda.X_EC))
    bare = RobotSilhouette(panda, D415, 0.0, 0.0).mask(q)
    grown = RobotSilhouette(panda, D415, 0.0, 5.0).mask(q)
    assert not (bare & ~grown).any()
    rows, columns = (np.nonzero(m.any(axis=axis))[0] for m, axis in ((bare, 1), (bare, 0)))
    more_rows, more_columns = (np.nonzero(grown.any(axis=axis))[0] for axis in (1, 0))
    assert rows.min() - more_rows.min() == pytest.approx(5, abs=1)
    assert columns.min() - more_columns.min() == pytest.approx(5, abs=1)
    assert more_columns.max() - columns.max() == pytest.approx(5, abs=1)


def test_a_flat_mesh_is_a_millimetre_thick(tmp_path):
    """Three corners in a plane have no convex hull with a volume."""
    sticker = tmp_path / "sticker.obj"
    sticker.write_text("v 0 0 0.2\nv 0.1 0 0.2\nv 0.1 0.1 0.2\nv 0 0.1 0.2\nf 1 2 3\nf 1 3 4\n")
    for corners in (hull_corners(Mesh(str(sticker), 1.0)), hull_corners(Box(0.1, 0.1, 1e-12))):
        assert ConvexHull(corners).volume == pytest.approx(0.101 * 0.101 * 0.001, rel=1e-3)


def test_a_mesh_with_a_corner_that_is_nowhere_cannot_be_drawn(tmp_path):
    spike = tmp_path / "spike.obj"
    spike.write_text("v 0 0 0\nv 1e30 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n")
    with pytest.raises(UnknownShapeError, match="mesh"):
        hull_corners(Mesh(str(spike), 1.0))


def drawn_square(left, top, size, margin):
    """What is drawn of a square that stands at 2 m, whose corners are these pixels."""
    silhouette = RobotSilhouette.__new__(RobotSilhouette)
    silhouette._intrinsics, silhouette._margin_px = D415, margin
    uv = np.array([[left, top], [left + size, top], [left + size, top + size], [left, top + size]])
    z = 2.0
    p_CQ = [[(u - D415.cx) / D415.fx * z, (v - D415.cy) / D415.fy * z, z] for u, v in uv]
    image = np.zeros(D415.shape, np.uint8)
    silhouette._draw(image, np.array(p_CQ))
    return image


def test_a_margin_reaches_into_the_picture_from_what_lies_beside_it_on_any_side():
    # 3 pixels beside the picture, a margin of 5: three or four of it are left, and none from 8 beside it.
    height, width = D415.shape
    within = slice(200, 240)
    for beside in (3, 8):
        seen = [
            drawn_square(-40 - beside, 200, 40, 5.0)[within].any(0).sum(),
            drawn_square(width - 1 + beside, 200, 40, 5.0)[within].any(0).sum(),
            drawn_square(200, -40 - beside, 40, 5.0)[:, within].any(1).sum(),
            drawn_square(200, height - 1 + beside, 40, 5.0)[:, within].any(1).sum(),
        ]
        assert seen == pytest.approx([3.5 if beside == 3 else 0] * 4, abs=0.5)


def test_of_a_square_its_own_pixels_are_drawn_without_a_margin():
    rows, columns = np.nonzero(drawn_square(100, 50, 40, 0.0))
    assert (columns.min(), columns.max(), rows.min(), rows.max()) == (100, 140, 50, 90)
    assert len(rows) == 41 * 41
