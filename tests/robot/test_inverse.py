import numpy as np

from riseg_drake.robot.inverse import panda_postures
from riseg_drake.robot.limits import PANDA_LIMITS


def flange_pose(panda, q):
    return panda.X_WA(q, panda.plant.GetFrameByName("panda_link8"))


def drawn_postures(count):
    upper = PANDA_LIMITS.position_upper.copy()
    upper[3] = -0.5  # nearer to a straight elbow a second branch of the triangle begins
    return np.random.default_rng(3).uniform(PANDA_LIMITS.position_lower, upper, (count, 7))


def test_every_posture_returned_brings_the_flange_to_the_pose(panda):
    for q in drawn_postures(100):
        X_WF = flange_pose(panda, q)
        found = panda_postures(X_WF, np.array([q[6], q[6] + 0.2]))
        assert len(found) >= 1
        for posture in found:
            np.testing.assert_allclose(flange_pose(panda, posture), X_WF, atol=1e-9)


def test_the_posture_a_pose_came_from_is_among_those_found(panda):
    for q in drawn_postures(100):
        found = panda_postures(flange_pose(panda, q), q[6])
        apart = np.abs((found - q + np.pi) % (2 * np.pi) - np.pi).max(axis=1)
        assert apart.min() < 1e-6


def test_a_pose_out_of_reach_has_no_posture():
    X_WF = np.eye(4)
    X_WF[:3, 3] = [1.5, 0, 0.5]
    assert panda_postures(X_WF, np.linspace(-2, 2, 9)).shape == (0, 7)
