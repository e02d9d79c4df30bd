from dataclasses import replace

import numpy as np
import pytest

from riseg_drake.pushing.clusters import Cluster
from riseg_drake.pushing.decision import Criterion, Ending, PathStage
from riseg_drake.pushing.find_action import (
    FindActionParameters,
    find_action,
    stays_in_work_area,
    touching,
    valid_pushes,
)
from riseg_drake.pushing.push import NO_PUSH
from riseg_drake.pushing.tried_pushes import KnownScene, TriedPush
from riseg_drake.robot.tool_shape import Overhang, ToolShape
from tests.pushing.bar import BAR


def decide(table, seed=0, tried=(), heading_W=None, **options):
    return find_action(KnownScene(table, tried, heading_W), np.random.default_rng(seed), BAR, **options)


def act(table, seed=0, **options):
    """The push, or None."""
    push = decide(table, seed, **options).push
    return None if push is NO_PUSH else push


def cluttered(drawn):
    drawn.box(0.45, 0.0, 0.06, 0.04, yaw=0.3).disc(0.5, 0.05, 0.02, height=0.02)
    return drawn.box(0.52, -0.02, 0.05, 0.05, yaw=0.8).disc(0.45, -0.08, 0.03)


def test_segmented_scene_is_null_because_nothing_is_left(drawn):
    decision = decide(drawn.box(0.5, 0.0, 0.05, 0.05, segmented=True).map())
    assert decision.push is NO_PUSH
    assert decision.ending is Ending.NOTHING_LEFT
    assert decision.unsettled_area == 0.0


def test_empty_table_is_null_because_nothing_is_left(drawn):
    assert decide(drawn.map()).ending is Ending.NOTHING_LEFT


def test_a_push_comes_with_the_area_that_is_yet_to_be_segmented(drawn):
    drawn.box(0.5, 0.0, 0.05, 0.04).box(0.4, 0.1, 0.05, 0.05, segmented=True)
    decision = decide(drawn.map())
    assert decision.push is not NO_PUSH
    assert decision.ending is None
    assert decision.unsettled_area == pytest.approx(0.05 * 0.04, rel=0.1)  # cells of 2 mm


def test_boxed_in_object_is_null_because_the_pusher_has_no_room(drawn):
    drawn.box(0.5, 0.0, 0.13, 0.13, segmented=True)
    drawn.put((np.abs(drawn.centres() - [0.5, 0.0]) <= 0.05).all(-1), 0.05, False)
    drawn.objects[(np.abs(drawn.centres() - [0.5, 0.0]) <= 0.045).all(-1)] = False
    drawn.box(0.5, 0.0, 0.04, 0.04)  # 2.5 cm of room all around: too little for the bar
    drawn.segmented[(np.abs(drawn.centres() - [0.5, 0.0]) > 0.03).any(-1)] = True
    decision = decide(drawn.map())
    assert decision.push is NO_PUSH
    assert decision.ending is Ending.NOTHING_VALID
    assert decision.fails_most is Criterion.ACCESSIBLE
    assert decision.failed[Criterion.ACCESSIBLE] == decision.candidates > 40
    assert Criterion.HIGH_ENOUGH not in decision.failed
    assert decision.unsettled_area == pytest.approx(0.04**2, rel=0.1)
    assert "16 cm^2 are left to find: the area that the end effector needs is not free" in decision.why


def test_thing_too_flat_for_the_bar_is_null_because_of_its_height(drawn):
    decision = decide(drawn.box(0.5, 0.0, 0.04, 0.04, height=0.003).map())
    assert decision.ending is Ending.NOTHING_VALID
    assert decision.fails_most is Criterion.HIGH_ENOUGH


def test_a_push_that_would_be_the_same_again_is_null_because_it_was_in_vain(drawn):
    table = drawn.disc(0.5, 0.0, 0.03).map()
    angles = np.arange(0, 2 * np.pi, 0.2)
    tried = [
        TriedPush(np.array([0.5 - 0.03 * c, -0.03 * s, 0.02]), np.array([c, s]), changed=False)
        for c, s in zip(np.cos(angles), np.sin(angles), strict=True)
    ]
    decision = decide(table, tried=tried)
    assert decision.ending is Ending.NOTHING_VALID
    assert decision.fails_most is Criterion.NOT_IN_VAIN
    assert decision.failed[Criterion.NOT_IN_VAIN] == decision.candidates


def test_push_goes_through_the_center_of_a_lone_object(drawn):
    push = act(drawn.box(0.5, 0.05, 0.05, 0.03, yaw=0.5).map())
    offset = push.center_W - push.p_WE[:2]
    assert np.linalg.det([offset, push.direction_W]) == pytest.approx(0.0, abs=1e-9)
    assert push.center_W == pytest.approx([0.5, 0.05], abs=0.001)
    assert offset @ push.direction_W > 0
    assert np.linalg.norm(push.direction_W) == pytest.approx(1.0)


def test_tip_starts_a_clearance_and_half_a_bar_behind_the_contact(drawn):
    push = act(drawn.disc(0.5, 0.0, 0.03).map())
    assert np.linalg.norm(push.p_WB[:2] - push.p_WE[:2]) == pytest.approx(0.01 + 0.01)
    assert push.length == pytest.approx(0.01 + 0.02)
    assert np.linalg.norm(push.p_WB[:2] - push.center_W) == pytest.approx(0.03, abs=0.003)


def test_object_is_not_pushed_into_its_neighbour(drawn):
    drawn.box(0.5, 0.0, 0.04, 0.04)
    push = act(drawn.box(0.5, 0.042, 0.1, 0.04, segmented=True).map())
    assert push.center_W == pytest.approx([0.5, 0.0], abs=0.003)
    assert push.direction_W[1] < 0.1


def test_two_things_that_touch_are_pushed_across_their_contact(drawn):
    push = act(drawn.disc(0.47, 0.0, 0.03).disc(0.53, 0.0, 0.03).map())
    # The centers lie on x: a push along x would move both alike, one across x moves one of them.
    assert abs(push.direction_W[0]) < 0.6 or (push.center_W[0] - 0.5) * push.direction_W[0] > 0


def test_wedged_in_object_is_pushed_after_all_unless_the_paper_is_taken_literally(drawn):
    drawn.box(0.5, 0.0, 0.04, 0.04)
    drawn.box(0.535, 0.0, 0.02, 0.03, segmented=True).box(0.5, 0.031, 0.038, 0.02, segmented=True)
    drawn.box(0.465, 0.01, 0.02, 0.06, segmented=True)
    table = drawn.box(0.53, 0.03, 0.02, 0.02, segmented=True).map()
    literal = FindActionParameters()
    literal.validity.with_others = False
    assert act(table, parameters=literal) is None
    assert act(table) is not None


def test_same_seed_gives_the_same_push(drawn):
    table = cluttered(drawn).map()
    first, second = act(table, seed=4), act(table, seed=4)
    assert np.array_equal(first.p_WE, second.p_WE)
    assert first.cost == second.cost


def test_push_that_changed_nothing_is_not_repeated(drawn):
    table = drawn.disc(0.5, 0.0, 0.03).map()
    tried = []
    for _ in range(3):
        push = act(table, tried=tried)
        for earlier in tried:
            far = np.linalg.norm(push.p_WB[:2] - earlier.p_WB[:2]) > 0.015
            assert far or push.direction_W @ earlier.direction_W < np.cos(0.5)
        tried.append(TriedPush(push.p_WB, push.direction_W, changed=False))


def test_nothing_is_driven_off_the_work_area(drawn):
    drawn.work_area = (0.25, 0.75, -0.28, 0.28)
    push = act(drawn.disc(0.72, 0.0, 0.028).map(), heading_W=np.array([1.0, 0.0]))
    assert (push.cluster_W + push.d_push * push.direction_W)[:, 0].max() <= 0.75
    inwards = act(drawn.disc(0.745, 0.2, 0.03).map())
    assert inwards is not None


def test_candidate_that_the_arm_cannot_do_is_passed_over(drawn):
    asked = []

    def plan_path(push):
        asked.append(push)
        return "a path" if len(asked) == 3 else PathStage.POSTURE

    push = act(drawn.disc(0.5, 0.0, 0.03).map(), plan_path=plan_path)
    assert push.path == "a path"
    assert push.direction_W is asked[2].direction_W
    assert [p.cost for p in asked] == sorted(p.cost for p in asked)


def test_without_any_reachable_candidate_the_action_is_null_because_there_is_no_path(drawn):
    asked = []

    def plan_path(push):
        asked.append(push)
        return PathStage.STROKE if len(asked) > 1 else PathStage.CROSSING

    decision = decide(drawn.disc(0.5, 0.0, 0.03).map(), plan_path=plan_path)
    assert decision.push is NO_PUSH
    assert decision.ending is Ending.NO_PATH
    assert decision.failed == {PathStage.CROSSING: 1, PathStage.STROKE: len(asked) - 1}
    assert decision.candidates == len(asked)
    assert decision.fails_most is PathStage.STROKE
    # Nobody is asked again about as good as the same push, whichever clustering it came from.
    turned = [push.turned for push in asked]
    assert turned.count(False) == turned.count(True) == FindActionParameters().paths
    for n, push in enumerate(asked):
        for other in asked[:n]:
            far = np.linalg.norm(push.p_WE[:2] - other.p_WE[:2]) >= 0.01
            unlike = push.direction_W @ other.direction_W <= np.cos(0.2)
            assert far or unlike or push.turned != other.turned


def test_the_back_of_the_tool_pushes_where_the_arm_cannot_with_its_front_and_only_there(drawn):
    table, asked = drawn.disc(0.5, 0.0, 0.03).map(), []

    def plan_path(push):
        asked.append(push.turned)
        return (np.zeros(7), "a path") if push.turned else PathStage.POSTURE

    push = decide(table, plan_path=plan_path).push
    assert push.turned
    assert push.path[1] == "a path"
    # All that could be pushed with its front was asked before.
    assert asked[-1]
    assert asked.index(True) == len(asked) - 1 > 10
    assert push.yaw == pytest.approx(np.arctan2(*-push.direction_W[::-1]))
    ahead = decide(table, plan_path=lambda push: (np.zeros(7), "a path")).push
    assert not ahead.turned
    assert ahead.yaw == pytest.approx(np.arctan2(*ahead.direction_W[::-1]))


def test_half_of_a_thing_pushed_in_view_comes_before_all_of_it_pushed_beside_the_view(drawn):
    table = drawn.disc(0.5, 0.0, 0.03).map()

    def plan_path(push):
        halved = np.linalg.norm(push.center_W - [0.5, 0.0]) > 0.005
        return (np.zeros(7), "a path") if push.turned or halved else PathStage.POSTURE

    push = decide(table, plan_path=plan_path, parameters=FindActionParameters(paths=100)).push
    assert not push.turned
    assert np.linalg.norm(push.center_W - [0.5, 0.0]) > 0.005


@pytest.mark.parametrize(("reaches", "turned"), [((-0.02, 0.09), [True]), ((-0.09, 0.02), [False])])
def test_what_reaches_over_one_side_of_the_tip_may_be_kept_away_from_a_tall_thing(new_table, reaches, turned):
    """A low box before a wall: what is 30 mm above the tip has no room on that side."""
    drawn = new_table().box(0.5, 0.0, 0.04, 0.30, height=0.02)
    drawn.box(0.57, 0.0, 0.06, 0.36, height=0.08, segmented=True)
    tool = ToolShape(0.02, 0.03, 0.1, (Overhang(0.03, reaches, (-0.02, 0.02)),))
    pushes, _ = valid_pushes(
        [Cluster(np.array([0.5, 0.0]), drawn.objects & ~drawn.segmented)],
        KnownScene(drawn.map()),
        tool,
        FindActionParameters(),
        alone=False,
    )
    along_x = [push.turned for push in pushes if push.direction_W[0] > 0.95]
    assert along_x
    assert set(along_x) == set(turned)


def test_ring_is_pushed_though_its_center_is_empty(drawn):
    push = act(drawn.disc(0.5, 0.0, 0.05, hole=0.03).map())
    assert push is not None
    assert push.length == pytest.approx(0.03)


def test_tall_narrow_thing_is_pushed_along_its_longer_side(drawn):
    push = act(drawn.box(0.5, 0.0, 0.08, 0.02, height=0.12).map())
    assert abs(push.direction_W[0]) > 0.9


@pytest.mark.parametrize("method", ["k-means", "k-medoids", "mean-shift"])
def test_each_clustering_method_leads_to_a_push(drawn, method):
    parameters = FindActionParameters()
    parameters.clusters.clustering.method = method
    assert act(cluttered(drawn).map(), parameters=parameters) is not None


def test_what_has_never_moved_is_pushed_before_what_is_in_doubt_however_small_it_is(drawn):
    drawn.box(0.5, 0.1, 0.08, 0.06, doubtful=3).box(0.5, -0.1, 0.02, 0.03)
    decision = decide(drawn.map())
    assert decision.push.center_W == pytest.approx([0.5, -0.1], abs=0.003)
    assert decision.doubtful_area == pytest.approx(0.08 * 0.06, rel=0.1)
    assert decision.unsettled_area == pytest.approx(0.08 * 0.06 + 0.02 * 0.03, rel=0.1)


def test_what_is_in_doubt_is_pushed_beside_its_middle_so_that_two_would_move_differently(drawn):
    push = act(drawn.box(0.5, 0.0, 0.1, 0.05, doubtful=3).map())
    arm = np.linalg.det([push.direction_W, np.array([0.5, 0.0]) - push.p_WB[:2]])
    assert abs(arm) > 0.015  # m from the middle to the line of the push
    whole = act(drawn.box(0.5, 0.0, 0.1, 0.05).map())
    assert whole.center_W == pytest.approx([0.5, 0.0], abs=0.003)


def test_what_two_pushes_have_left_in_doubt_is_not_pushed_again_and_the_ending_says_so(drawn):
    table = drawn.box(0.5, 0.0, 0.06, 0.05, doubtful=3).map()
    # Each ended where the thing is now.
    sides = [(np.array([1.0, 0.0]), [0.45, 0.0, 0.02]), (np.array([0.0, 1.0]), [0.5, -0.045, 0.02])]
    tried = [TriedPush(np.array(p_WB), ahead_W, changed=True) for ahead_W, p_WB in sides]
    assert act(table, tried=tried[:1]) is not None
    decision = decide(table, tried=tried)
    assert decision.ending is Ending.NOTHING_VALID
    assert decision.failed[Criterion.NOT_IN_VAIN] == decision.candidates
    assert decision.why.startswith("no push is valid, 30 cm^2 are in doubt: too little is to be expected")


def test_a_rim_of_what_is_in_doubt_is_no_thing_that_never_moved(drawn):
    drawn.box(0.5, 0.0, 0.062, 0.062).box(0.5, 0.0, 0.054, 0.054, doubtful=3)
    decision = decide(drawn.map())
    assert decision.unsettled_area == decision.doubtful_area


def test_a_thing_behind_known_ones_is_pushed_by_way_of_them(drawn):
    drawn.box(0.5, 0.0, 0.12, 0.12, segmented=True).box(0.5, 0.0, 0.04, 0.04)
    push = act(drawn.map())
    assert push.center_W == pytest.approx([0.5, 0.0], abs=0.003)
    assert np.abs(push.p_WB[:2] - [0.5, 0.0]).max() == pytest.approx(0.06, abs=0.003)


def test_alone_comes_before_with_others(drawn):
    drawn.box(0.45, 0.1, 0.12, 0.12, segmented=True).box(0.45, 0.1, 0.06, 0.06)
    push = act(drawn.box(0.6, -0.1, 0.02, 0.025).map())
    assert push.center_W == pytest.approx([0.6, -0.1], abs=0.003)


def test_what_is_in_doubt_is_left_alone_where_a_push_would_stir_more_than_it_settles(drawn):
    drawn.box(0.5, 0.0, 0.02, 0.02, doubtful=3)
    # Open on one side, towards which nothing can be pushed.
    for x, y in ((0.475, 0.0), (0.525, 0.0), (0.5, 0.025)):
        drawn.box(x, y, 0.028, 0.028, segmented=True)
    decision = decide(drawn.map())
    assert decision.ending is Ending.NOTHING_VALID
    assert decision.failed[Criterion.NOT_IN_VAIN] > decision.candidates / 2


@pytest.mark.parametrize("slope", [0.1, -0.1])
def test_on_a_sloped_table_the_tip_keeps_its_height_over_the_highest_ground_of_its_way(drawn, slope):
    # The table rises along x by `slope`; a push of 3 cm goes from a clearance before the contact on.
    table = replace(drawn.disc(0.5, 0.0, 0.03).map(), plane_W=np.array([-slope, 0.0, 1.0, 0.05]))
    push = act(table)
    way = push.p_WB[:2] + np.outer([-1, 1], push.length * push.direction_W)
    ground = (slope * way[:, 0] - 0.05).max()
    assert push.length == pytest.approx(0.03)
    assert push.p_WE[2] == pytest.approx(ground + push.tip_height)
    assert push.p_WB[2] == pytest.approx(ground + 0.05 / 2)


def test_a_push_is_all_that_was_found_of_it(drawn):
    drawn.disc(0.5, 0.0, 0.03, height=0.04).box(0.4, 0.15, 0.04, 0.04, height=0.11, segmented=True)
    decision = decide(drawn.map())
    push = decision.push
    assert push.tallest == pytest.approx(0.11)
    assert push.tip_height == pytest.approx(0.008)
    assert push.d_push == pytest.approx(0.02)
    # 28 cm^2: that it is an object, less what touching it with a part of the bar costs.
    area = np.count_nonzero(drawn.objects & ~drawn.segmented) * 4e-6
    assert decision.unsettled_area == pytest.approx(area)
    most = area / (area + 1e-3)
    assert 0.8 * most < 1 - push.cost <= most
    cells = drawn.centres()[drawn.objects & ~drawn.segmented]
    np.testing.assert_allclose(push.cluster_W, cells)


def test_what_hangs_together_is_what_touches_even_in_a_corner(drawn):
    one, corner, apart = np.zeros((3, *drawn.objects.shape), bool)
    one[100:110, 100:110] = corner[110:120, 110:120] = apart[121:130, 121:130] = True
    table = drawn.put(one | corner | apart, 0.05, False).map()
    np.testing.assert_array_equal(touching(one, table), one | corner)


def test_a_push_may_take_out_of_the_work_area_no_more_than_lies_there(drawn):
    # Two of ten columns of cells lie outside of x <= 0.75; a push of three more along y is as good as before.
    cells = np.zeros(drawn.objects.shape, bool)
    cells[140:150, 268:278] = True  # x from 0.736 to 0.754
    table = drawn.put(cells, 0.05, False).map()
    ways = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0]])
    assert stays_in_work_area(ways, cells, table, 0.006).tolist() == [False, True, True]
    drawn.work_area = (0.25, 0.75, -0.28, 0.003)
    cells = np.zeros(drawn.objects.shape, bool)
    cells[140:150, 100:110] = True  # y from -0.02 to -0.002
    upwards = np.array([[0.0, 1.0]])
    assert stays_in_work_area(upwards, cells, drawn.map(), 0.004).tolist() == [True]
    assert stays_in_work_area(upwards, cells, drawn.map(), 0.006).tolist() == [False]
