"""The tools there are, and how one of somebody's own is read and welded to the flange."""

import numpy as np
import pytest
from pydrake.geometry import Role

from riseg_drake.robot.description import PandaDescription, check_tool
from riseg_drake.robot.kinematics import PandaKinematics, observation_posture
from riseg_drake.robot.tool import ToolError
from tests.robot.own_tools import CAMERA, STICK, TIP, URDF, box, frame, joint, link, sdf

STAND = np.array([[0, 0, -1, 2.0], [1, 0, 0, 0], [0, -1, 0, 0.5], [0, 0, 0, 1]])
"""X_WC of a camera ahead of the arm that looks back at it."""


@pytest.fixture
def own(tmp_path):
    """Called with a text, the arm with that tool."""

    def arm(text, X_WC=None, ending="sdf", **options):
        file = tmp_path / f"own.{ending}"
        file.write_text(text)
        return PandaKinematics(PandaDescription(tool=str(file), **options), X_WC)

    return arm


@pytest.fixture
def refusal(tmp_path):
    """Called with a text, what is said about that tool."""

    def said(text, X_WC=None, **options):
        file = tmp_path / "own.sdf"
        file.write_text(text)
        with pytest.raises(ToolError) as error:
            check_tool(PandaDescription(tool=str(file), **options), X_WC)
        words = str(error.value)
        assert words.startswith(f"{file}: ")
        assert "\n" not in words
        return words.removeprefix(f"{file}: ")

    return said


def test_the_hand_is_bolted_on_by_45_degrees_and_its_tip_is_between_the_closed_fingertips():
    arm = PandaKinematics(PandaDescription(tool="hand"))
    X_FE = np.linalg.inv(arm.X_EF)
    r = np.sqrt(0.5)
    np.testing.assert_allclose(X_FE[:3, :3], [[r, r, 0], [-r, r, 0], [0, 0, 1]], atol=1e-12)
    # Fingers begin 58.4 mm from the flange and are 54.5 mm long.
    np.testing.assert_allclose(X_FE[:3, 3], [0, 0, 0.0584 + 0.0545], atol=1e-12)


def test_the_hands_camera_is_ahead_of_it_and_its_upper_image_edge_points_along_the_push():
    arm = PandaKinematics(PandaDescription(tool="hand"))
    expected = [[0, -1, 0, 0.07], [1, 0, 0, 0], [0, 0, 1, -0.1329], [0, 0, 0, 1]]
    np.testing.assert_allclose(arm.X_EC, expected, atol=1e-12)


def test_the_hand_weighs_what_its_data_sheet_says_and_more_with_bracket_and_camera():
    for X_WC, mass in ((STAND, 0.73), (None, 0.73 + 0.05 + 0.06)):
        arm = PandaKinematics(PandaDescription(tool="hand"), X_WC)
        plant = arm.plant
        assert plant.CalcTotalMass(plant.CreateDefaultContext(), [arm.parts.tool]) == pytest.approx(mass)


@pytest.mark.parametrize("tool", ["bar", "hand"])
def test_where_the_camera_is_on_a_stand_the_tool_carries_none(tool):
    bare, full = (PandaKinematics(PandaDescription(tool=tool), X_WC) for X_WC in (STAND, None))
    np.testing.assert_array_equal(bare.X_EF, full.X_EF)
    shapes = [len(arm.inspector.GetAllGeometryIds(Role.kPerception)) for arm in (bare, full)]
    assert shapes[0] < shapes[1]
    np.testing.assert_array_equal(bare.X_WC(bare.ready), STAND)


@pytest.mark.parametrize("tool", ["bar", "hand"])
def test_with_each_tool_a_search_starts_with_the_tool_ahead(tool):
    arm = PandaKinematics(PandaDescription(tool=tool))
    ahead_W = arm.X_WE(arm.ready)[:3, 0]
    assert ahead_W[1] == pytest.approx(0.0, abs=1e-12)
    assert ahead_W[0] > 0.9


def test_from_where_it_looks_the_hands_camera_sees_the_middle_from_straight_above():
    arm = PandaKinematics(PandaDescription(tool="hand"))
    X_WC = arm.X_WC(observation_posture(arm, [0.5, 0.05], 0.36))
    expected = [[0, -1, 0, 0.5], [-1, 0, 0, 0.05], [0, 0, -1, 0.36], [0, 0, 0, 1]]
    np.testing.assert_allclose(X_WC, expected, atol=1e-6)


def test_the_base_of_an_own_tool_lies_on_the_flange_turned_by_tool_yaw(own):
    arm = own(sdf(), tool_yaw=0.5)
    expected = np.eye(4)
    expected[:2, :2] = [[np.cos(0.5), -np.sin(0.5)], [np.sin(0.5), np.cos(0.5)]]
    expected[2, 3] = 0.2
    np.testing.assert_allclose(np.linalg.inv(arm.X_EF), expected, atol=1e-12)
    np.testing.assert_allclose(arm.X_EC[:3, 3], [0.1, 0, -0.25], atol=1e-12)


def test_the_link_that_hangs_on_no_joint_is_the_base_whatever_the_order(own):
    arm = own(sdf(frames=TIP + CAMERA + link("lens"), more=joint("fixed", "base", "lens")))
    np.testing.assert_allclose(np.linalg.inv(arm.X_EF)[:3, 3], [0, 0, 0.2], atol=1e-12)


def test_a_urdf_is_a_tool_where_the_camera_is_elsewhere_or_calibrated(own):
    on_stand = own(URDF, STAND, "urdf")
    assert (on_stand.tool.thickness, on_stand.tool.width, on_stand.tool.length) == (0.012, 0.026, 0.2)
    calibrated = own(URDF, None, "urdf", X_EC=[0.1, 0.0, -0.3, 0.0, 0.0, 1.5])
    np.testing.assert_allclose(calibrated.X_EC[:3, 3], [0.1, 0, -0.3], atol=1e-12)


def test_without_the_frame_camera_all_but_the_camera_is_known(own, refusal):
    arm = own(sdf(frames=TIP))
    assert arm.X_WE(arm.ready).shape == (4, 4)
    with pytest.raises(ToolError, match="no frame `camera`"):
        _ = arm.X_EC
    with pytest.raises(ToolError, match="no frame `camera`"):
        arm.X_WC(arm.ready)
    assert refusal(sdf(frames=TIP)).startswith("no frame `camera`")


def test_a_file_that_is_not_there_is_named_with_what_a_tool_can_be(tmp_path):
    for tool, what in (("hnad", "no SDF or URDF file"), (str(tmp_path / "gone.sdf"), "no file")):
        with pytest.raises(ToolError) as error:
            check_tool(PandaDescription(tool=tool))
        assert str(error.value) == f"{tool}: {what}; a tool is bar, hand or an .sdf or .urdf file"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (sdf(frames=CAMERA), "no frame `tip`"),
        (sdf(shapes=""), "no collision geometry"),
        (sdf(shapes=box((0.012, 0.026, 0.2), (0, 0, 0.1), kinds=["collision"])), "no visual geometry"),
        (sdf(more=link("finger") + joint("prismatic", "base", "finger")), "its joint 'hinge' can move"),
        (sdf(more=link("beside")), "its links base, beside hang together by no joint"),
        (sdf(more=joint("fixed", "world", "base")), "it is fixed to the world"),
        (sdf(shapes=box((0.012, 0.026, 0.19), (0, 0, 0.095))), "its collision geometry ends 10.0 mm above"),
        (sdf(shapes=box((0.012, 0.026, 0.2), (0, 0, 0.105))), "its collision geometry ends 5.0 mm below"),
        (sdf(shapes=box((0.012, 0.026, 0.2), (0.004, 0, 0.1))), "the middle of its tip is 4.0 mm along x"),
        (sdf(shapes=box((0.0004, 0.026, 0.2), (0, 0, 0.1))), "its tip is 0.4 x 26.0 mm"),
        ("<sdf", "cannot be read: it is not whole XML"),
        (sdf().replace("</model>", '</model><model name="b">' + link("l") + "</model>"), "cannot be read"),
    ],
)
def test_what_is_no_tool_is_refused_in_one_line(refusal, text, words):
    assert refusal(text).startswith(words)


def test_frames_need_no_mounting_on_the_base(own):
    hung = STICK + "</link>" + link("lens").removesuffix("</link>")
    arm = own(
        sdf(shapes=hung, frames=TIP + frame("camera", (0, 0, 0, 0, 0, 0)), more=joint("fixed", "base", "lens"))
    )
    np.testing.assert_allclose(arm.X_EC[:3, 3], [0, 0, -0.2], atol=1e-12)


@pytest.mark.parametrize(
    ("text", "where"),
    [
        (
            sdf(
                shapes=box((0.012, 0.026, 200.0), (0, 0, 100.0)),
                frames=frame("tip", (0, 0, 200, 0, 0, 0)) + frame("camera", (0.1, 0, 199.0, 0, 0, 0)),
            ),
            "The tip is 200.00 m from the flange, the camera 1.00 m from the tip, looking 0 degrees off",
        ),
        (
            sdf(frames=TIP + frame("camera", (0.1, 0, -0.05, np.pi, 0, 0))),
            "The tip is 0.20 m from the flange, the camera 0.27 m from the tip, looking 180 degrees off",
        ),
    ],
)
def test_where_no_posture_looks_down_it_is_said_where_tip_and_camera_are(own, text, where):
    with pytest.raises(ValueError, match=f"no posture looks at .*{where}"):
        observation_posture(own(text), [0.5, 0.0], 0.5)
