"""A robot that is only looked at: what it would touch, or lacks for that, does not decide."""

from pathlib import Path

import numpy as np
import pytest

from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.robot.own_robot import OwnRobot, OwnRobotError
from riseg_drake.robot.silhouette import RobotSilhouette

K = Intrinsics(160, 120, 154.1, 153.9, 79.2, 59.4)
BOX = '<box size="0.02 0.02 0.02"/>'
CUBE = "\n".join(
    [
        *(f"v {x} {y} {z}" for z in (-0.01, 0.01) for y in (-0.01, 0.01) for x in (-0.01, 0.01)),
        *("f 1 3 4 2", "f 5 6 8 7", "f 1 2 6 5", "f 3 7 8 4", "f 1 5 7 3", "f 2 4 8 6"),
    ]
)


def gantry(folder: Path, visual: str = BOX, collision: str = "") -> Path:
    """A hand with a camera that looks at it from 0.35 m."""
    touched = f"<collision><geometry>{collision}</geometry></collision>" if collision else ""
    (folder / "gantry.urdf").write_text(
        f"""<robot name="gantry"><link name="base"/><link name="hand"><visual><origin xyz="0 -0.1 0.1"/>
<geometry>{visual}</geometry></visual>{touched}</link>
<joint name="x" type="prismatic"><parent link="base"/><child link="hand"/><axis xyz="1 0 0"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
<link name="eye"/><joint name="mount" type="fixed"><parent link="hand"/><child link="eye"/>
<origin xyz="0 0 0.45" rpy="3.14159265 0 0"/></joint></robot>"""
    )
    return folder / "gantry.urdf"


def seen(file):
    robot = OwnRobot(file, "eye", ["x"])
    return RobotSilhouette(robot, K).mask(np.zeros(1)), robot.X_WC(np.array([0.2]))


@pytest.mark.parametrize("mesh", ["part.stl", "part.dae", "gone.obj"])
def test_collision_meshes_do_not_decide_whether_a_robot_is_seen(tmp_path, mesh):
    mask, X_WC = seen(gantry(tmp_path))
    assert mask.any()
    (tmp_path / "part.stl").write_bytes(b"\0" * 84)
    (tmp_path / "part.dae").write_text("<COLLADA/>")
    other_mask, other_X_WC = seen(gantry(tmp_path, collision=f'<mesh filename="{mesh}"/>'))
    np.testing.assert_array_equal(other_mask, mask)
    np.testing.assert_array_equal(other_X_WC, X_WC)


@pytest.mark.parametrize("collision", ["", '<mesh filename="part.stl"/>'])
@pytest.mark.parametrize("url", ["", "package://arm/", "model://arm/"])
def test_visual_meshes_are_found_beside_the_file(tmp_path, url, collision):
    folder = tmp_path / "arm"
    folder.mkdir()
    (folder / "cube.obj").write_text(CUBE)
    (folder / "part.stl").write_bytes(b"\0" * 84)
    mask, _ = seen(gantry(folder))
    of_mesh, _ = seen(gantry(folder, f'<mesh filename="{url}cube.obj"/>', collision))
    np.testing.assert_array_equal(of_mesh, mask)


def test_what_else_is_wrong_with_a_robot_is_said_in_the_words_of_the_file(tmp_path):
    file = gantry(tmp_path, '<mesh filename="gone.obj"/>', '<mesh filename="gone.stl"/>')
    with pytest.raises(OwnRobotError, match=r"gantry\.urdf: .*gone\.obj.*does not exist"):
        OwnRobot(file, "eye", ["x"])


TWO_JOINTS = """<robot name="crane"><link name="base"/><link name="mast"/><link name="arm"/>
<joint name="turn" type="revolute"><parent link="base"/><child link="mast"/><axis xyz="0 0 1"/>
<limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
<joint name="reach" type="prismatic"><parent link="mast"/><child link="arm"/><axis xyz="1 0 0"/>
<origin xyz="0.1 0 0.4"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>"""


@pytest.fixture
def crane(tmp_path):
    (tmp_path / "crane.urdf").write_text(TWO_JOINTS)
    return tmp_path / "crane.urdf"


@pytest.mark.parametrize(
    ("joints", "q"),
    [(["turn", "reach"], [0.5, 0.2]), (["reach", "turn"], [0.2, 0.5]), (["a", "b"], [0.5, 0.2])],
)
def test_joints_go_by_their_names_and_by_the_files_order_where_the_names_are_others(crane, joints, q):
    X_WC = OwnRobot(crane, "arm", joints).X_WC(np.array(q))
    c, s = np.cos(0.5), np.sin(0.5)
    expected = [[c, -s, 0, 0.3 * c], [s, c, 0, 0.3 * s], [0, 0, 1, 0.4], [0, 0, 0, 1]]
    np.testing.assert_allclose(X_WC, expected, atol=1e-12)


def test_of_some_joints_by_name_the_others_stay_at_rest(crane):
    robot = OwnRobot(crane, "arm", ["reach"])
    np.testing.assert_allclose(robot.X_WC(np.array([0.2]))[:3, 3], [0.3, 0, 0.4], atol=1e-12)
    # Asked again it is by the new angles alone, and of any frame.
    np.testing.assert_allclose(robot.X_WC(np.array([-0.1]))[:3, 3], [0.0, 0, 0.4], atol=1e-12)
    mast = robot.plant.GetFrameByName("mast")
    np.testing.assert_allclose(robot.X_WA(np.array([0.7]), mast), np.eye(4), atol=1e-12)


def test_its_base_is_bolted_to_the_origin_and_all_of_it_is_the_robots(crane):
    robot = OwnRobot(crane, "base", ["turn", "reach"])
    np.testing.assert_allclose(robot.X_WC(np.array([1.0, 0.3])), np.eye(4), atol=1e-12)
    assert robot.plant.num_positions() == 2
    assert [robot.plant.GetModelInstanceName(model) for model in robot.models] == ["crane"]


def test_too_few_or_too_many_joints_are_named_with_those_of_the_file(crane):
    for joints in (["a"], ["a", "b", "c"], ["turn", "b", "reach"]):
        with pytest.raises(OwnRobotError, match=rf"2 movable joints \(turn, reach\).* has {len(joints)};"):
            OwnRobot(crane, "arm", joints)


def test_a_camera_frame_that_is_not_there_is_named_with_those_that_are(crane):
    with pytest.raises(OwnRobotError, match=r"no frame 'eye'; it has .*base.*mast.*arm"):
        OwnRobot(crane, "eye", ["turn", "reach"])
    with pytest.raises(OwnRobotError, match="is not there"):
        OwnRobot(crane.with_name("gone.urdf"), "eye", [])
