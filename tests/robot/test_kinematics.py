import numpy as np
import pytest
from pydrake.math import RotationMatrix

from riseg_drake.robot.kinematics import (
    LIMIT_MARGIN,
    MIN_CLEARANCE,
    OBSERVING_CLEARANCE,
    READY,
    observation_posture,
    observe_pose,
    pose_error,
    tip_pointing_down,
)
from riseg_drake.robot.limits import PANDA_LIMITS


@pytest.mark.parametrize("yaw", [-3.0, -1.2, 0.0, 0.7])
def test_the_tip_pointing_down_pushes_along_its_yaw(yaw):
    X_WE = tip_pointing_down([0.5, 0.1, 0.02], yaw)
    np.testing.assert_allclose(X_WE[:3, 0], [np.cos(yaw), np.sin(yaw), 0])
    np.testing.assert_allclose(X_WE[:3, 2], [0, 0, -1])
    RotationMatrix(X_WE[:3, :3])  # raises for anything but a rotation


def test_observing_looks_straight_down_at_the_point_from_the_height(panda):
    X_WE = observe_pose([0.5, 0.0, 0.0], 0.5, panda.X_EC)
    q = panda.solve_ik(X_WE)
    X_WC = panda.X_WC(q)
    np.testing.assert_allclose(X_WC[:3, 3], [0.5, 0, 0.5], atol=1e-9)
    np.testing.assert_allclose(X_WC[:3, 2], [0, 0, -1], atol=1e-9)
    assert panda.X_WE(q)[2, 3] == pytest.approx(0.15)


@pytest.mark.parametrize("pitch", [0.5, np.pi / 4, -np.pi / 4])
def test_a_view_leans_by_its_pitch_and_still_meets_the_point(panda, pitch):
    X_WC = observe_pose([0.5, 0.1, 0.0], 0.6, panda.X_EC, yaw=0.7, pitch=pitch) @ panda.X_EC
    up, level = np.array([np.cos(0.7), np.sin(0.7), 0]), [-np.sin(0.7), np.cos(0.7), 0]
    np.testing.assert_allclose(X_WC[:3, 2], np.sin(pitch) * up + [0, 0, -np.cos(pitch)], atol=1e-12)
    np.testing.assert_allclose(X_WC[:3, 3] + 0.6 * X_WC[:3, 2], [0.5, 0.1, 0.0], atol=1e-12)
    assert X_WC[:3, 0] @ level == pytest.approx(-1.0)  # the image's horizontal axis stays horizontal


def test_the_arm_observes_at_45_degrees_with_room_around_it(panda):
    q = observation_posture(panda, [0.5, 0.0], 0.5, pitch=np.pi / 4)
    X_WC = panda.X_WC(q)
    assert X_WC[2, 2] == pytest.approx(-np.cos(np.pi / 4))
    np.testing.assert_allclose(X_WC[:3, 3] + 0.5 * X_WC[:3, 2], [0.5, 0.0, 0.0], atol=1e-9)
    assert PANDA_LIMITS.room(q).min() > 1.0
    assert panda.clearance(q) >= OBSERVING_CLEARANCE


def test_a_view_that_leans_too_far_is_refused_in_one_line(panda):
    with pytest.raises(ValueError, match=r"no posture looks at .* leaning by observe_pitch: 1.5 rad"):
        observation_posture(panda, [0.5, 0.0], 1.4, pitch=1.5)


def test_solutions_reach_the_pose_within_limits_and_free_of_collision(panda):
    rng = np.random.default_rng(5)
    found = 0
    for _ in range(40):
        p_WE = rng.uniform([0.35, -0.2, 0.005], [0.65, 0.2, 0.35])
        X_WE = tip_pointing_down(p_WE, rng.uniform(-np.pi, np.pi))
        q = panda.solve_ik(X_WE)
        if q is None:
            continue
        found += 1
        np.testing.assert_allclose(panda.X_WE(q), X_WE, atol=1e-9)
        assert PANDA_LIMITS.contains(q, LIMIT_MARGIN)
        assert panda.clearance(q) >= MIN_CLEARANCE
    assert found >= 30  # towards the robot's own base the camera meets the wrist


def test_a_pose_below_the_table_or_far_away_has_no_solution(panda):
    assert panda.solve_ik(tip_pointing_down([0.5, 0, -0.02], 0.0)) is None
    assert panda.solve_ik(tip_pointing_down([1.2, 0, 0.1], 0.0)) is None


def test_the_solution_nearest_to_a_posture_is_that_posture(panda):
    q = panda.solve_ik(tip_pointing_down([0.5, 0.1, 0.1], 0.6))
    again = panda.solve_ik(panda.X_WE(q), q_near=q)
    np.testing.assert_allclose(again, q, atol=0.05)


def test_a_traced_path_is_exact_and_never_jumps(panda):
    path = [tip_pointing_down([0.42 + 0.1 * s, 0.05 * s, 0.01], 0.5 + s) for s in np.linspace(0, 1, 21)]
    traced = panda.trace_ik(path, panda.solve_ik(path[0]))
    for q, X_WE in zip(traced, path, strict=True):
        np.testing.assert_allclose(panda.X_WE(q), X_WE, atol=1e-5)
    assert np.abs(np.diff(traced, axis=0)).max() < 0.15


def test_a_path_into_the_table_is_refused(panda):
    path = [tip_pointing_down([0.5, 0, z], 0.0) for z in np.linspace(0.03, -0.01, 9)]
    assert panda.trace_ik(path, panda.solve_ik(path[0])) is None


def test_clearance_above_the_table_is_the_height_of_the_tip(panda):
    q = panda.solve_ik(tip_pointing_down([0.5, 0, 0.02], 0.0))
    assert panda.clearance(q) == pytest.approx(0.02, abs=1e-6)
    below = panda.solve_ik(tip_pointing_down([0.5, 0, -0.01], 0.0), min_clearance=-1.0)
    assert panda.clearance(below) == pytest.approx(-0.01, abs=1e-6)


def test_clearance_sees_the_arm_run_into_itself(panda):
    folded = READY.copy()
    folded[3] = PANDA_LIMITS.position_lower[3]
    folded[5] = PANDA_LIMITS.position_lower[5]
    assert panda.clearance(folded) < 0 < panda.clearance(READY)


def test_the_jacobian_is_the_derivative_of_the_tip(panda):
    q, dq = READY, 1e-6 * np.arange(1, 8)
    V_WE = pose_error(panda.X_WE(q - dq / 2), panda.X_WE(q + dq / 2))
    np.testing.assert_allclose(panda.tip_jacobian(q) @ dq, V_WE, atol=1e-11)


def test_the_free_postures_of_a_pose_are_the_nearest_first_and_each_unlike_all_before(panda):
    X_WE = tip_pointing_down([0.5, 0.1, 0.1], 0.7)
    near = panda.ready + 0.1
    found = list(panda.free_postures(X_WE, near, apart=0.4))
    assert len(found) > 3
    np.testing.assert_array_equal(found[0], panda.solve_ik(X_WE, near))
    for n, q in enumerate(found):
        np.testing.assert_allclose(panda.X_WE(q), X_WE, atol=1e-9)
        assert panda.clearance(q) >= 0.003
        for before in found[:n]:
            assert np.abs(q - before).max() >= 0.4
    # Nothing that is unlike them is left out.
    for q in panda.postures(X_WE):
        assert panda.clearance(q) < 0.003 or min(np.abs(q - each).max() for each in found) < 0.4
