import numpy as np
import pytest
from pydrake.multibody.plant import MultibodyPlant

from riseg_drake.robot.description import JOINT_NAMES, PandaDescription, add_panda
from riseg_drake.robot.kinematics import LIMIT_MARGIN, READY, PandaKinematics
from riseg_drake.robot.limits import FR3_LIMITS, PANDA_LIMITS, ROBOTS

OFFICIAL_URL = "package://drake_models/franka_description/urdf/panda_arm.urdf"


def plant_of(description):
    plant = MultibodyPlant(0.0)
    parts = add_panda(plant, description)
    plant.Finalize()
    return plant, parts


@pytest.fixture(scope="module")
def ours():
    return plant_of(PandaDescription())


@pytest.fixture(scope="module")
def official(official_models):
    return plant_of(PandaDescription(arm_url=OFFICIAL_URL, drake_models=official_models))


def test_camera_stands_ahead_of_the_tip_and_its_upper_image_edge_points_along_the_push(ours):
    plant, parts = ours
    X_EC = parts.camera_frame.CalcPose(plant.CreateDefaultContext(), parts.tip_frame)
    np.testing.assert_allclose(X_EC.translation(), [0.12, 0, -0.35], atol=1e-12)
    R_EC_columns = np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1.0]])
    np.testing.assert_allclose(X_EC.rotation().matrix().T, R_EC_columns, atol=1e-12)


def test_tip_is_30_cm_from_the_flange(ours):
    plant, parts = ours
    flange = plant.GetFrameByName("panda_link8", parts.arm)
    X_FE = parts.tip_frame.CalcPose(plant.CreateDefaultContext(), flange)
    np.testing.assert_allclose(X_FE.translation(), [0, 0, 0.3], atol=1e-12)


def test_tool_yaw_turns_the_tip_about_the_flange():
    plant, parts = plant_of(PandaDescription(tool_yaw=0.5))
    flange = plant.GetFrameByName("panda_link8", parts.arm)
    R_FE = parts.tip_frame.CalcPose(plant.CreateDefaultContext(), flange).rotation()
    assert R_FE.ToRollPitchYaw().yaw_angle() == pytest.approx(0.5)


def test_limits_in_the_model_are_the_published_ones(ours):
    plant, parts = ours
    for i, name in enumerate(JOINT_NAMES):
        joint = plant.GetJointByName(name, parts.arm)
        assert joint.position_lower_limit() == PANDA_LIMITS.position_lower[i]
        assert joint.position_upper_limit() == PANDA_LIMITS.position_upper[i]
        assert joint.velocity_upper_limit() == PANDA_LIMITS.velocity[i]
        assert joint.acceleration_upper_limit() == PANDA_LIMITS.acceleration[i]
        actuator = plant.GetJointActuatorByName(f"panda_motor{i + 1}")
        assert actuator.effort_limit() == PANDA_LIMITS.effort[i]


def test_forward_kinematics_agree_with_the_official_description(ours, official):
    rng = np.random.default_rng(1)
    contexts = [plant.CreateDefaultContext() for plant, _ in (ours, official)]
    for q in rng.uniform(PANDA_LIMITS.position_lower, PANDA_LIMITS.position_upper, (50, 7)):
        for link in range(9):
            poses = []
            for (plant, _), context in zip((ours, official), contexts, strict=True):
                plant.SetPositions(context, q)
                frame = plant.GetFrameByName(f"panda_link{link}")
                poses.append(frame.CalcPoseInWorld(context).GetAsMatrix4())
            np.testing.assert_allclose(*poses, atol=1e-9)


def test_limits_and_actuators_agree_with_the_official_description(ours, official):
    for name in ("position_lower", "position_upper", "velocity_upper", "acceleration_upper"):
        rows = [
            [getattr(plant.GetJointByName(j), f"{name}_limit")() for j in JOINT_NAMES]
            for plant, _ in (ours, official)
        ]
        assert rows[0] == rows[1]
    for i in range(1, 8):
        motors = [plant.GetJointActuatorByName(f"panda_motor{i}") for plant, _ in (ours, official)]
        assert motors[0].effort_limit() == motors[1].effort_limit()
        assert motors[0].default_reflected_inertia() == pytest.approx(motors[1].default_reflected_inertia())


def test_masses_and_inertias_agree_with_the_official_description(ours, official):
    for link in range(8):
        inertias = []
        for plant, _ in (ours, official):
            body = plant.GetBodyByName(f"panda_link{link}")
            inertias.append(body.CalcSpatialInertiaInBodyFrame(plant.CreateDefaultContext()))
        np.testing.assert_allclose(inertias[0].CopyToFullMatrix6(), inertias[1].CopyToFullMatrix6(), atol=1e-12)


def test_a_missing_folder_of_official_models_is_named():
    with pytest.raises(ValueError, match=r"no/such/folder has no package\.xml"):
        plant_of(PandaDescription(arm_url=OFFICIAL_URL, drake_models="no/such/folder"))


def test_pusher_and_camera_are_as_heavy_as_stated(ours):
    plant, parts = ours
    masses = [plant.get_body(b).default_mass() for b in plant.GetBodyIndices(parts.tool)]
    assert sorted(masses) == [0.075, 0.25]


def test_a_calibrated_camera_is_where_the_calibration_says():
    plant, parts = plant_of(PandaDescription(X_EC=[0.1, 0.02, -0.3, 0.1, 0.2, 1.5]))
    X_EC = parts.camera_frame.CalcPose(plant.CreateDefaultContext(), parts.tip_frame)
    np.testing.assert_allclose(X_EC.translation(), [0.1, 0.02, -0.3], atol=1e-12)
    np.testing.assert_allclose(X_EC.rotation().ToRollPitchYaw().vector(), [0.1, 0.2, 1.5], atol=1e-12)


def test_half_a_calibration_is_refused():
    with pytest.raises(ValueError, match="expected 6"):
        plant_of(PandaDescription(X_EC=[0.1, 0.0, 0.0]))


@pytest.mark.parametrize("name", ["panda", "fr3"])
def test_the_joints_have_the_limits_of_the_robot_that_is_named(name):
    kinematics = PandaKinematics(PandaDescription(robot=name))
    plant, limits = kinematics.plant, ROBOTS[name]
    assert kinematics.limits is limits
    np.testing.assert_array_equal(plant.GetPositionLowerLimits(), limits.position_lower)
    np.testing.assert_array_equal(plant.GetPositionUpperLimits(), limits.position_upper)
    np.testing.assert_array_equal(plant.GetVelocityUpperLimits(), limits.velocity)
    np.testing.assert_array_equal(plant.GetAccelerationUpperLimits(), limits.acceleration)


def test_postures_of_an_fr3_keep_to_its_own_ranges():
    X_WE = PandaKinematics().X_WE(READY)
    panda, fr3 = (PandaKinematics(PandaDescription(robot=name)) for name in ("panda", "fr3"))
    assert (FR3_LIMITS.room(fr3.postures(X_WE)) >= LIMIT_MARGIN).all()
    assert not (FR3_LIMITS.room(panda.postures(X_WE)) >= LIMIT_MARGIN).all()
    assert fr3.solve_ik(X_WE) is not None
