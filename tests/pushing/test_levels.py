"""What lies on other things is pushed at its own height."""

from dataclasses import replace

import numpy as np
import pytest

from riseg_drake.pushing.clusters import ClustersParameters, find_clusters
from riseg_drake.pushing.decision import Criterion
from riseg_drake.pushing.find_action import FindActionParameters, find_action, overhang, valid_pushes
from riseg_drake.pushing.gain import GainParameters
from riseg_drake.pushing.levels import LevelsParameters, raised
from riseg_drake.pushing.push import NO_PUSH
from riseg_drake.pushing.tried_pushes import KnownScene
from tests.pushing.bar import BAR


def stack(drawn, lower=0.04, upper=0.08):
    """A small box on a large one, which have moved as one."""
    drawn.box(0.5, 0.0, 0.12, 0.10, height=lower, doubtful=1)
    return drawn.box(0.52, 0.01, 0.05, 0.05, height=upper, doubtful=1)


def levels(drawn):
    table = drawn.map()
    return list(raised(table, table.doubtful, 3e-4, LevelsParameters()))


def test_above_the_lower_box_the_map_holds_the_upper_one_alone(drawn):
    [(upper, above)] = levels(stack(drawn))
    assert np.array_equal(upper, drawn.height > 0.05)
    assert np.array_equal(above.objects, upper)
    assert not above.segmented.any()
    # 4 mm above what the bar passes over.
    assert above.height[upper] == pytest.approx(0.08 - 0.044, abs=1e-6)
    assert above.ground(np.array([[0.5, 0.0]])) == pytest.approx(0.044, abs=1e-6)


def test_the_level_follows_a_table_that_is_not_at_zero_height(drawn):
    stack(drawn)
    table = replace(drawn.map(), plane_W=np.array([0.0, 0.0, 1.0, 0.1]))
    [(_, above)] = raised(table, table.doubtful, 3e-4, LevelsParameters())
    assert above.ground(np.array([[0.5, 0.0]])) == pytest.approx(-0.1 + 0.044, abs=1e-6)


def test_the_upper_box_is_pushed_just_above_the_lower_one(drawn):
    push = find_action(KnownScene(stack(drawn).map()), np.random.default_rng(0), BAR).push
    assert push.tip_height == pytest.approx(0.008)
    assert push.p_WE[2] == pytest.approx(0.044 + 0.008, abs=1e-6)
    assert np.abs(push.cluster_W - [0.52, 0.01]).max() <= 0.026
    # The tip is lowered behind the upper box, above the lower one.
    assert np.linalg.norm(push.p_WE[:2] - [0.52, 0.01]) < 0.06


def test_of_two_levels_the_lower_comes_first_though_the_edge_at_the_higher_is_longer(drawn):
    # At the large box's corner only half of what stands there rises from the same thing.
    drawn.box(0.5, 0.0, 0.12, 0.10, height=0.04, doubtful=1)
    drawn.box(0.535, 0.025, 0.05, 0.05, height=0.08, doubtful=1)
    drawn.box(0.535, 0.025, 0.04, 0.04, height=0.12, doubtful=1)
    found = [(float(above.ground(np.array([[0.5, 0.0]]))[0]), upper.sum()) for upper, above in levels(drawn)]
    assert found == [
        (pytest.approx(0.044, abs=1e-6), (drawn.height > 0.05).sum()),
        (pytest.approx(0.084, abs=1e-6), (drawn.height > 0.09).sum()),
    ]


def test_what_lies_on_another_thing_is_pushed_above_that_one(drawn):
    # A box that moved with a far part of it lies on a known one: no step from one part to the other.
    drawn.box(0.42, 0.0, 0.05, 0.05, height=0.02, doubtful=1)
    drawn.box(0.52, 0.0, 0.12, 0.10, height=0.04, segmented=True)
    drawn.box(0.53, 0.0, 0.05, 0.05, height=0.08, doubtful=1)
    [(upper, above)] = levels(drawn)
    assert above.ground(np.array([[0.5, 0.0]])) == pytest.approx(0.044, abs=1e-6)
    assert np.array_equal(upper, drawn.height > 0.05)


def test_a_step_shorter_than_the_smallest_object_makes_no_level(drawn):
    stack(drawn).box(0.46, -0.03, 0.004, 0.004, height=0.03, doubtful=1)  # a hole, 1.6 cm around
    [(_, above)] = levels(drawn)
    assert above.ground(np.array([[0.5, 0.0]])) == pytest.approx(0.044, abs=1e-6)


@pytest.mark.parametrize(
    "draw",
    [
        lambda t: t.box(0.5, 0.0, 0.1, 0.1, height=0.05, doubtful=1),  # no step
        lambda t: stack(t, 0.04, 0.049),  # too low a step for the bar
        lambda t: t.box(0.5, 0, 0.1, 0.038, doubtful=1).box(
            0.5, 0, 0.05, 0.03, height=0.08, doubtful=1
        ),  # narrow
        lambda t: t.box(0.5, 0.0, 0.1, 0.1, doubtful=1).box(0.5, 0.0, 0.014, 0.02, height=0.08, doubtful=1),
        lambda t: t.box(0.5, 0.0, 0.1, 0.1).box(0.5, 0.0, 0.05, 0.05, height=0.08),  # not in doubt
        lambda t: t.box(0.45, 0.0, 0.05, 0.05, doubtful=1).box(0.5, 0.0, 0.05, 0.05, height=0.09, doubtful=2),
    ],
)
def test_a_thing_without_a_step_to_speak_of_has_no_level(drawn, draw):
    assert levels(draw(drawn)) == []


@pytest.mark.parametrize(("height", "slides"), [(0.094, True), (0.098, False)])
def test_what_would_tilt_if_it_were_one_is_not_pushed_near_its_top(drawn, height, slides):
    # With a friction of 0.5 what is 10 cm wide slides if it is pushed no higher than at 10 cm; 4 mm of them
    # are between what the tip passes over and the level.
    assert len(levels(stack(drawn, height, height + 0.03))) == slides


def test_another_known_thing_at_that_height_is_in_the_way(drawn):
    stack(drawn).box(0.575, 0.01, 0.03, 0.12, height=0.09, segmented=True)
    [(upper, above)] = levels(drawn)
    assert above.segmented.sum() == pytest.approx(15 * 60, abs=80)
    assert not (above.segmented & upper).any()
    push = find_action(KnownScene(drawn.map()), np.random.default_rng(0), BAR).push
    assert push is not NO_PUSH
    assert push.direction_W[0] < 0.9


@pytest.mark.parametrize(("way", "share"), [([-1.0, 0.0], 0.0), ([1.0, 0.0], 0.4), ([0.0, 1.0], 0.2)])
def test_the_overhang_is_what_the_push_takes_beyond_the_edge_of_what_carries(drawn, way, share):
    # The upper box, 5 cm wide, stands at the right edge and 1 cm from the upper one; it is pushed by 2 cm.
    drawn.box(0.5, 0.0, 0.12, 0.10, height=0.04, doubtful=1)
    drawn.box(0.535, 0.015, 0.05, 0.05, height=0.08, doubtful=1)
    [(upper, above)] = levels(drawn)
    assert overhang(np.array([way]), upper, above, 0.02) == pytest.approx(share, abs=0.05)


def test_on_the_table_nothing_hangs_over(drawn):
    table = drawn.box(0.5, 0.0, 0.12, 0.10).map()
    assert overhang(np.array([[1.0, 0.0]]), table.objects, table, 0.02) == 0


def test_nothing_is_pushed_off_what_it_lies_on(drawn):
    drawn.box(0.5, 0.0, 0.09, 0.05, height=0.04, doubtful=1)
    drawn.box(0.52, 0.0, 0.05, 0.05, height=0.08, doubtful=1)
    found = []
    for upper, above in levels(drawn):
        for each in find_clusters(upper, above, ClustersParameters(), np.random.default_rng(0)):
            pushes, failed = valid_pushes(each, KnownScene(above), BAR, FindActionParameters())
            assert failed[Criterion.STAYS_ON_TOP].any()
            found += pushes
    # Of its 5 cm, 30 % may hang over: of a push by 2 cm 1.5 cm to a side, and nothing at the near edge.
    assert found
    assert all(abs(push.direction_W[1]) <= 0.75 + 0.1 and push.direction_W[0] < 0 for push in found)


def test_what_lies_on_another_is_left_alone_where_too_little_is_to_be_expected(drawn):
    # With no more to expect above the lower box than `least`, one of its own sides is pushed.
    table = stack(drawn).map()
    push = find_action(KnownScene(table), np.random.default_rng(0), BAR).push
    assert push.p_WE[2] > 0.044
    for least, above in ((0.9 * (1 - push.cost), True), (1.1 * (1 - push.cost), False)):
        parameters = FindActionParameters(gain=GainParameters(least=least))
        decision = find_action(KnownScene(table), np.random.default_rng(0), BAR, parameters)
        assert (decision.push.p_WE[2] > 0.044) == above
