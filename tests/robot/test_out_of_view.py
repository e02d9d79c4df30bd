import numpy as np
import pytest

from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.robot.description import PandaDescription
from riseg_drake.robot.kinematics import PandaKinematics, observation_posture, tip_pointing_down
from riseg_drake.robot.limits import PANDA_LIMITS
from riseg_drake.robot.out_of_view import posture_out_of_view
from riseg_drake.robot.silhouette import RobotSilhouette

CENTRE = [0.5, 0.0]
VIEW = Intrinsics(640, 480, 616.285, 615.778, 301.418, 232.864)


def looking(eye, at):
    """X_WC of a camera at `eye` that looks at `at`, its image upright."""
    z = np.subtract(at, eye) / np.linalg.norm(np.subtract(at, eye))
    x = np.cross(z, [0, 0, 1.0])
    x /= np.linalg.norm(x)
    X_WC = np.eye(4)
    X_WC[:3, :3], X_WC[:3, 3] = np.column_stack([x, np.cross(z, x), z]), eye
    return X_WC


IN_FRONT = looking([1.03, 0.0, 0.55], [0.5, 0.0, 0.02])
AT_THE_SIDE = looking([0.5, -0.7, 0.7], [0.5, 0.0, 0.02])


@pytest.fixture(scope="module", params=[IN_FRONT, AT_THE_SIDE], ids=["in front", "at the side"])
def watched(request):
    """An arm that a fixed camera looks at, and where it waits."""
    kinematics = PandaKinematics(PandaDescription(), request.param)
    return kinematics, posture_out_of_view(kinematics, CENTRE)


def test_the_waiting_arm_hides_nothing_of_the_things_on_the_table(watched):
    kinematics, q = watched
    hidden = RobotSilhouette(kinematics, VIEW).mask(q)
    X_CW = np.linalg.inv(kinematics.fixed_camera)
    for x, y, z in np.stack(np.meshgrid([0.35, 0.5, 0.65], [-0.15, 0, 0.15], [0, 0.1]), -1).reshape(-1, 3):
        p_CQ = (X_CW @ [x, y, z, 1.0])[:3]
        u, v = np.rint(p_CQ[:2] / p_CQ[2] * [VIEW.fx, VIEW.fy] + [VIEW.cx, VIEW.cy]).astype(int)
        assert not (0 <= v < 480 and 0 <= u < 640 and hidden[v, u])


def test_it_waits_within_its_limits_with_the_tool_upright_and_touches_nothing(watched):
    kinematics, q = watched
    assert PANDA_LIMITS.room(q).min() >= 0.05
    assert kinematics.clearance(q) >= 0.02
    np.testing.assert_allclose(kinematics.X_WE(q)[:3, 2], [0, 0, -1], atol=1e-9)


def test_a_fixed_camera_stands_still_while_the_arm_moves(watched):
    kinematics, q = watched
    for moved in (q, q + 0.3, np.array([0, 0, 0, -1.5, 0, 1.5, 0])):
        np.testing.assert_allclose(kinematics.X_WC(moved), kinematics.fixed_camera, atol=1e-12)


def test_the_arm_must_not_touch_the_camera():
    p_WE = np.array([0.6, 0.0, 0.1])
    X_WE = tip_pointing_down(p_WE, 0.0)
    free = PandaKinematics(PandaDescription(), IN_FRONT)
    q = free.solve_ik(X_WE)
    near = looking(p_WE + np.array([0.03, 0, 0.1]), p_WE - [0.1, 0, 0.1])
    assert free.clearance(q) > 0.01
    assert PandaKinematics(PandaDescription(), near).clearance(q) < 0


def test_with_a_fixed_camera_the_observation_posture_is_where_the_arm_waits(watched):
    kinematics, q = watched
    np.testing.assert_array_equal(observation_posture(kinematics, CENTRE, 0.5, pitch=0.3), q)
    given = observation_posture(kinematics, CENTRE, 0.5, [0, 0, 0, -2, 0, 2, 0])
    np.testing.assert_array_equal(given, [0, 0, 0, -2, 0, 2, 0])


@pytest.mark.parametrize(
    ("X_WC", "centre_W", "said"),
    [
        (looking([1.0, 0, 0.5], [2.0, 0, 0]), CENTRE, "X_WC: the camera does not look at the work area"),
        (IN_FRONT, [2.0, 0.0], r"centre_W: the arm does not reach"),
    ],
)
def test_where_the_camera_or_the_work_area_cannot_be_it_says_which(X_WC, centre_W, said):
    if centre_W != CENTRE:
        X_WC = looking([2.6, 0, 0.6], [2.0, 0, 0])
    with pytest.raises(ValueError, match=said):
        posture_out_of_view(PandaKinematics(PandaDescription(), X_WC), centre_W)


def test_a_camera_on_the_wrist_has_no_view_to_be_out_of(panda):
    with pytest.raises(ValueError, match="the camera is on the wrist"):
        posture_out_of_view(panda, CENTRE)
