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
