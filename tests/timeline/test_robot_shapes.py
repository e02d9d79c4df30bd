import numpy as np
import pytest

from riseg_drake.robot.kinematics import READY, PandaKinematics
from riseg_drake.timeline.robot_shapes import RobotShapes


@pytest.fixture(scope="module")
def panda():
    kinematics = PandaKinematics()
    return kinematics, RobotShapes(kinematics)


def test_every_link_with_a_shape_is_where_drake_has_it(panda):
    kinematics, robot = panda
    poses = robot.poses(READY)
    assert set(poses) == {piece.body for piece in robot.pieces}
    assert {f"panda/panda_link{k}" for k in range(8)} <= set(poses)
    link = kinematics.plant.GetFrameByName("panda_link5")
    np.testing.assert_allclose(poses["panda/panda_link5"], kinematics.X_WA(READY, link))


def test_a_shape_is_closed_and_seen_from_outside(panda):
    for piece in panda[1].pieces:
        a, b, c = (piece.corners[piece.triangles[:, k]] for k in range(3))
        volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6  # by the divergence theorem
        assert volume > 0, piece.name
        edges = np.sort(np.concatenate([piece.triangles[:, [k, (k + 1) % 3]] for k in range(3)]), axis=1)
        assert set(np.unique(edges, axis=0, return_counts=True)[1]) == {2}
