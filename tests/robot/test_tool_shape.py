"""Thickness, width and overhangs against the sizes of the boxes that a tool is made of."""

import numpy as np
import pytest

from riseg_drake.robot.description import PandaDescription
from riseg_drake.robot.kinematics import PandaKinematics
from riseg_drake.robot.tool_shape import TIP_REACH, Overhang, ToolShape
from tests.robot.own_tools import CAMERA, STICK, TIP, box, sdf


@pytest.fixture
def shape(tmp_path):
    def measured(shapes, **options):
        file = tmp_path / "own.sdf"
        file.write_text(sdf(shapes, **options))
        return PandaKinematics(PandaDescription(tool=str(file))).tool

    return measured


def near(overhang):
    return pytest.approx([overhang.bottom, *overhang.x, *overhang.y], abs=1e-9)


def numbers(overhang):
    return [overhang.bottom, *overhang.x, *overhang.y]


def test_the_bar_is_20_by_30_mm_and_30_cm_long_with_its_plate_and_camera_above():
    tool = PandaKinematics().tool
    assert (tool.thickness, tool.width, tool.length) == (0.02, 0.03, 0.3)
    (above,) = tool.overhangs
    # The plate's collision box is 174 x 114 x 8 mm about x = 50 mm, and covers the camera.
    assert numbers(above) == near(Overhang(0.292, (-0.037, 0.137), (-0.057, 0.057)))


def test_the_hand_pushes_with_its_two_fingertips_side_by_side_and_has_fingers_hand_and_camera_above():
    tool = PandaKinematics(PandaDescription(tool="hand")).tool
    assert (tool.thickness, tool.width, tool.length) == (0.018, 2 * 0.0158, 0.1129)
    narrower, narrowing, fingers, hand, shoulders, camera, plug = tool.overhangs
    assert numbers(fingers) == near(Overhang(0.1129 - 0.0794, (-0.011, 0.011), (-0.0265, 0.0265)))
    assert numbers(hand) == near(Overhang(0.1129 - 0.066, (-0.023, 0.023), (-0.102, 0.102)))
    assert numbers(shoulders) == near(Overhang(0.1129 - 0.02, (-0.0315, 0.0315), (-0.104, 0.104)))
    assert numbers(camera) == near(Overhang(0.1129 - 0.006, (0.0316, 0.091), (-0.056, 0.056)))
    assert numbers(plug) == near(Overhang(0.1129 + 0.01, (-0.006, 0.006), (-0.105, -0.041)))
    assert tool.thickness / 2 == pytest.approx(narrower.x[1]) == pytest.approx(narrowing.x[1])
    assert tool.width < np.ptp(narrower.y) < np.ptp(narrowing.y) < np.ptp(fingers.y)


def test_what_is_within_15_mm_of_the_end_face_is_the_tip_and_what_is_above_hangs_over(shape):
    ring = (0.05, 0.06, 0.01)
    low = shape(STICK + box(ring, (0, 0, 0.2 - TIP_REACH + 0.004), "ring"))  # from 6 to 16 mm above E
    assert (low.thickness, low.width, low.overhangs) == (0.05, 0.06, ())
    high = shape(STICK + box(ring, (0, 0, 0.2 - TIP_REACH - 0.006), "ring"))  # from 16 to 26 mm
    assert (high.thickness, high.width) == (0.012, 0.026)
    (over,) = high.overhangs
    assert numbers(over) == near(Overhang(0.016, (-0.025, 0.025), (-0.03, 0.03)))


def test_a_round_tip_is_as_thick_as_its_diameter(shape):
    rod = (
        '<collision name="rod"><pose>0 0 0.1 0 0 0</pose><geometry><cylinder><radius>0.01</radius>'
        "<length>0.2</length></cylinder></geometry></collision>"
    )
    tool = shape(rod)
    assert (tool.thickness, tool.width, tool.overhangs) == (0.02, 0.02, ())


def test_a_ball_is_measured_up_to_where_the_tip_ends(shape):
    ball = (
        '<collision name="ball"><pose>0 0 0.17 0 0 0</pose><geometry><sphere><radius>0.03</radius></sphere>'
        "</geometry></collision>"
    )
    tool = shape(ball)
    # 15 mm above the lowest point of a ball of 30 mm its circle has the radius sqrt(30^2 - 15^2) mm; as a
    # polyhedron of 16 steps it has a little less.
    assert tool.thickness == pytest.approx(2 * np.sqrt(0.03**2 - 0.015**2), rel=0.01)
    assert tool.overhangs[-1].x[1] == pytest.approx(0.03, rel=0.01)


def test_a_tilted_stick_is_as_wide_as_its_shadow(shape):
    # 12 x 26 mm turned by 90 degrees about the vertical is 26 x 12 mm.
    turned = STICK.replace("0 0 0</pose>", "0 0 1.5707963267948966</pose>")
    tool = shape(turned)
    assert (tool.thickness, tool.width) == (0.026, 0.012)


def test_the_frame_tip_says_which_way_is_along_the_push(shape):
    turned = TIP.replace("0 0 0</pose>", "0 0 1.5707963267948966</pose>")
    tool = shape(STICK, frames=turned + CAMERA)
    assert (tool.thickness, tool.width) == (0.026, 0.012)


def test_a_tool_that_widens_evenly_hangs_over_in_steps_each_no_higher_than_it_is(shape):
    # A box of 40 mm turned by 45 degrees about y stands on an edge. At any height it is twice as thick as it is
    # high, so 30 mm where the tip ends.
    wedge = box((0.04, 0.03, 0.04), (0, 0, 0.2 - 0.02 * np.sqrt(2))).replace(
        "0 0 0</pose>", "0 0.7853981633974483 0</pose>"
    )
    tool = shape(wedge)
    assert tool.thickness == pytest.approx(2 * TIP_REACH, abs=1e-6)
    for over in tool.overhangs:
        z = min(over.bottom + 0.01, 0.02 * np.sqrt(2))
        assert np.ptp(over.x) == pytest.approx(2 * z, abs=1e-6)


def test_a_tool_that_is_turned_has_ahead_and_to_the_right_what_it_had_behind_and_to_the_left():
    one_sided = ToolShape(0.02, 0.03, 0.1, (Overhang(0.04, (-0.02, 0.09), (-0.01, 0.05)),))
    assert one_sided.turned() == ToolShape(0.02, 0.03, 0.1, (Overhang(0.04, (-0.09, 0.02), (-0.05, 0.01)),))
    assert one_sided.turned().turned() == one_sided
