"""Which force at the tip explains torques: exact where it can, least squares where it cannot."""

import numpy as np
import pytest
from scipy.linalg import qr

from riseg_drake.robot.kinematics import READY, PandaKinematics
from riseg_drake.robot.tip_geometry import TipGeometry

Q = np.array(READY)


@pytest.fixture(scope="module")
def panda():
    return PandaKinematics()


def of(J):
    return TipGeometry(position=lambda q: np.zeros(3), jacobian=lambda q: J)


@pytest.mark.parametrize("force", [[10.0, 0.0, 0.0], [0.0, -3.0, 4.0], [1.0, 2.0, 2.0]])
@pytest.mark.parametrize("moment", [[0.0, 0.0, 0.0], [2.0, -1.0, 0.5]])
def test_a_force_on_the_pandas_tip_is_felt_with_its_size_whatever_moment_comes_with_it(panda, force, moment):
    # Principle of virtual work: torques = J^T F; J by differences of the arm's own poses.
    def numeric(q):
        J = np.empty((6, 7))
        R = panda.X_WE(q)[:3, :3]
        for k, step in enumerate(1e-6 * np.eye(7)):
            ahead, back = panda.X_WE(q + step), panda.X_WE(q - step)
            J[3:, k] = (ahead[:3, 3] - back[:3, 3]) / 2e-6
            W = (ahead[:3, :3] - back[:3, :3]) / 2e-6 @ R.T
            J[:3, k] = [W[2, 1], W[0, 2], W[1, 0]]
        return J

    tip = TipGeometry(position=lambda q: panda.X_WE(q)[:3, 3], jacobian=numeric)
    torque = numeric(Q).T @ np.concatenate([moment, force])
    assert tip.force(Q, torque) == pytest.approx(np.linalg.norm(force), rel=1e-3)


def test_the_wrench_is_moment_first_and_of_it_the_force_is_told():
    J = np.hstack([np.eye(6), np.zeros((6, 1))])
    assert of(J).force(Q, np.array([7.0, 7.0, 7.0, 2.0, 3.0, 6.0, 100.0])) == pytest.approx(7.0)


def test_directions_in_which_the_arm_is_nearly_singular_tell_nothing():
    axes = qr(np.random.default_rng(0).normal(size=(7, 7)))[0][:6]
    for weakest, seen in ((0.021, True), (0.019, False)):
        J = np.diag([1.0, 1.0, 1.0, 1.0, 1.0, weakest]) @ axes
        torque = J.T @ np.array([0.0, 0.0, 0.0, 3.0, 0.0, 4.0])
        assert of(J).force(Q, torque) == pytest.approx(5.0 if seen else 3.0)
