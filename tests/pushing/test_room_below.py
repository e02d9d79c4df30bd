"""Things beneath what of the tool is beside its tip: the heights that just fit, by the tool's own numbers."""

import numpy as np
import pytest

from riseg_drake.pushing.arm_path import PushPath
from riseg_drake.pushing.decision import Criterion, Ending
from riseg_drake.pushing.find_action import FindActionParameters, find_action
from riseg_drake.pushing.push import NO_PUSH
from riseg_drake.pushing.push_path import PushPathParameters, plan_push_path
from riseg_drake.pushing.pusher import Pusher
from riseg_drake.pushing.room_below import room_below_the_tool
from riseg_drake.pushing.tried_pushes import KnownScene
from riseg_drake.pushing.validity import ValidityParameters
from riseg_drake.robot.description import PandaDescription
from riseg_drake.robot.kinematics import PandaKinematics, observation_posture
from riseg_drake.robot.tool_shape import Overhang, ToolShape

ALONG_X = np.array([[1.0, 0.0]])
ROOF = ToolShape(0.02, 0.03, 0.1, (Overhang(0.04, (-0.03, 0.05), (-0.06, 0.06)),))
"""A tip of 20 x 30 mm, and 40 mm above its end face a roof 30 mm behind, 50 mm ahead, 60 mm to each side."""
ROOM = 0.008 + 0.04 - 0.005
"""What fits below: the tip's height and the roof's above it, without the margin, m."""


@pytest.fixture(scope="module")
def hand():
    return PandaKinematics(PandaDescription(tool="hand"))


def fits(drawn, pushed_height=0.03, tool=ROOF, tip_height=0.008):
    """Whether there is room for a push along x with the contact at (0.5, 0), of a box that begins there."""
    pushed = np.zeros_like(drawn.objects)
    pushed[(np.abs(drawn.centres() - [0.52, 0.0]) < [0.02, 0.015]).all(-1)] = True
    drawn.put(pushed, pushed_height, False)
    contact = np.array([[0.5, 0.0]])
    free = room_below_the_tool(
        contact, ALONG_X, np.array([tip_height]), pushed, drawn.map(), Pusher(tool), ValidityParameters()
    )
    return bool(free[0])


@pytest.mark.parametrize(("height", "is_free"), [(ROOM - 1e-3, True), (ROOM + 1e-3, False)])
def test_what_stands_below_must_be_lower_than_the_roof_by_the_margin(drawn, height, is_free):
    assert fits(drawn.box(0.5, 0.05, 0.02, 0.02, height=height)) is is_free


@pytest.mark.parametrize(("height", "is_free"), [(ROOM - 1e-3, True), (ROOM + 1e-3, False)])
def test_what_is_pushed_must_fit_below_what_reaches_over_it(drawn, height, is_free):
    assert fits(drawn, pushed_height=height) is is_free


def test_a_higher_tip_leaves_more_room(drawn):
    drawn.box(0.5, 0.05, 0.02, 0.02, height=ROOM + 1e-3)
    assert not fits(drawn, tip_height=0.008)
    assert fits(drawn, tip_height=0.010)


# E goes from 10 mm behind the contact and half the tip (10 mm) to 20 mm beyond it less that half: the roof from
# x = 0.5 - 0.01 - 0.01 - 0.03 to 0.5 + 0.02 - 0.01 + 0.05, and y = +-0.06; with 5 mm of margin around.
@pytest.mark.parametrize(
    ("x", "y", "is_free"),
    [
        (0.445 - 0.013, 0.03, True),
        (0.445 - 0.007, 0.03, False),
        (0.565 + 0.013, 0.03, True),
        (0.565 + 0.007, 0.03, False),
        (0.5, 0.065 + 0.013, True),
        (0.5, 0.065 + 0.007, False),
        (0.5, -0.065 - 0.013, True),
        (0.5, -0.065 - 0.007, False),
    ],
)
def test_the_roof_passes_over_what_is_below_it_from_the_descent_to_the_end_of_the_push(drawn, x, y, is_free):
    assert fits(drawn.box(x, y, 0.02, 0.02, height=0.06)) is is_free


def test_what_is_hardly_ahead_of_the_tip_may_touch_what_is_pushed(drawn):
    tool = ToolShape(0.02, 0.03, 0.1, (Overhang(0.02, (-0.013, 0.013), (-0.03, 0.03)),))
    assert fits(drawn, pushed_height=0.05, tool=tool)
    farther = ToolShape(0.02, 0.03, 0.1, (Overhang(0.02, (-0.013, 0.018), (-0.03, 0.03)),))
    assert not fits(drawn, pushed_height=0.05, tool=farther)


def test_a_bar_has_room_beside_whatever_it_can_push(drawn):
    bar = PandaKinematics().tool
    assert fits(drawn.box(0.5, 0.05, 0.02, 0.02, height=0.25), pushed_height=0.25, tool=bar)


def test_between_walls_that_are_taller_than_its_fingers_the_hand_pushes_nothing_and_the_bar_does(
    new_table, hand
):
    """A low box between two walls of 60 mm, 120 mm apart: the tips fit, the hand of 204 mm does not."""
    for tool, ending in ((PandaKinematics().tool, None), (hand.tool, Ending.NOTHING_VALID)):
        drawn = new_table().box(0.5, 0.0, 0.04, 0.03, height=0.03)
        for y in (-0.09, 0.09):
            drawn.box(0.5, y, 0.3, 0.06, height=0.06, segmented=True)
        decision = find_action(KnownScene(drawn.map()), np.random.default_rng(0), tool)
        assert decision.ending is ending
        if ending is not None:
            assert decision.failed[Criterion.ROOM_BELOW_THE_TOOL] > 0


def test_a_plan_for_the_hand_keeps_its_margin_to_all_things_at_all_heights_on_all_of_its_way(new_table, hand):
    drawn = new_table().box(0.5, 0.0, 0.05, 0.04, yaw=0.3, height=0.03)
    drawn.box(0.5, 0.07, 0.05, 0.03, height=0.02, segmented=True).disc(
        0.44, -0.06, 0.015, height=0.04, segmented=True
    )
    table, parameters = drawn.map(), FindActionParameters()
    q_observe = observation_posture(hand, [0.5, 0.0], 0.36)
    push = find_action(
        KnownScene(table),
        np.random.default_rng(0),
        hand.tool,
        plan_path=lambda push: plan_push_path(push, hand, q_observe),
    ).push
    assert push is not NO_PUSH
    assert isinstance(push.path, PushPath)
    strangers = table.points(table.segmented)
    height = table.height[table.segmented]
    lowest_tip = PushPathParameters().crossing_height + table.height.max()
    for time in np.linspace(0, push.path.duration, 150):
        q = push.path.position(time)
        assert hand.clearance(q) >= 0.003 - 2e-4
        X_WE = hand.X_WE(q)
        p_EQ = (np.column_stack([strangers, height]) - X_WE[:3, 3]) @ X_WE[:3, :3]
        low = X_WE[2, 3] < lowest_tip - 1e-3
        tip = Overhang(
            0.0,
            (-hand.tool.thickness / 2, hand.tool.thickness / 2),
            (-hand.tool.width / 2, hand.tool.width / 2),
        )
        for part in (tip, *hand.tool.overhangs) if low else (tip,):
            beside = np.maximum(np.abs(p_EQ[:, 0] - np.mean(part.x)) - np.ptp(part.x) / 2, 0)
            beside = np.hypot(beside, np.maximum(np.abs(p_EQ[:, 1] - np.mean(part.y)) - np.ptp(part.y) / 2, 0))
            above = -p_EQ[:, 2] - part.bottom  # of the thing's top over the part's lowest point
            # Half the margin beside the tip during the stroke (contact.py), all of it above; cells are 2 mm.
            assert not ((beside < parameters.pusher.margin / 2 - 0.0015) & (above > -0.004)).any()
