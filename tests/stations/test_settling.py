"""Coming to rest, and what is a pile: by bodies whose contacts and heights are worked out by hand."""

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw

from riseg_drake.stations import settling
from riseg_drake.stations.object_models import find_model
from riseg_drake.stations.placed_object import PlacedObject
from riseg_drake.stations.settling import SettlingTable, is_pile

SIZE = np.array([0.06, 0.04, 0.02])


@pytest.fixture(scope="module")
def brick(tmp_path_factory):
    folder = tmp_path_factory.mktemp("models")
    box = f"<geometry><box><size>{SIZE[0]} {SIZE[1]} {SIZE[2]}</size></box></geometry>"
    inertia = "<inertia><ixx>4e-5</ixx><iyy>8e-5</iyy><izz>9e-5</izz></inertia>"
    (folder / "brick.sdf").write_text(
        "<sdf version='1.6'><model name='brick'><link name='link'>"
        f"<inertial><mass>0.2</mass>{inertia}</inertial>"
        f"<visual name='v'>{box}</visual><collision name='c'>{box}</collision></link></model></sdf>"
    )
    return find_model(str(folder / "brick.sdf"))


def at(brick, *p_W, yaw=0.0):
    return PlacedObject(brick, RigidTransform(RollPitchYaw(0, 0, yaw), p_W))


def pairs(*said):
    return {frozenset(pair) for pair in said}


@pytest.mark.parametrize(
    ("touching", "count", "pile"),
    [
        (pairs((0, 1), (1, 2)), 2, True),
        (pairs((0, 1), (0, 2)), 2, False),  # side by side
        (pairs((0, 1), (0, 2), (1, 2)), 2, False),  # leaning, both on the table
        (pairs((0, 1), (1, 2), (0, 3), (0, 4)), 4, True),  # a half of them touch
        (pairs((0, 1), (1, 2), (0, 3), (0, 4), (0, 5)), 5, False),  # less than a half
        (pairs((0, 1), (0, 2), (1, 3), (2, 3)), 3, True),  # a bridge
        (set(), 2, False),
    ],
)
def test_a_pile_is_what_touches_and_has_one_that_lies_on_others_alone(touching, count, pile):
    assert is_pile(touching, count) is pile


def test_the_middle_of_what_things_cover_is_moved_to_the_centre_and_nothing_else_changes(brick):
    placed = [at(brick, 1.0, 2.0, 0.01), at(brick, 1.3, 2.1, 0.05, yaw=np.pi / 2)]
    moved = settling._centred(placed, [0.5, -0.1])
    # From 0.97 to 1.32 along x, from 1.98 to 2.13 along y.
    shift = np.array([0.5 - 1.145, -0.1 - 2.055, 0.0])
    for before, after in zip(placed, moved, strict=True):
        np.testing.assert_allclose(after.X_WB.translation(), before.X_WB.translation() + shift, atol=1e-12)
        np.testing.assert_array_equal(after.X_WB.rotation().matrix(), before.X_WB.rotation().matrix())


@pytest.mark.parametrize(
    ("x", "y", "z"),
    [(0.0, 0.0, 0.044), (0.059, 0.0, 0.044), (0.061, 0.0, 0.014), (0.0, 0.039, 0.044), (0.0, -0.041, 0.014)],
)
def test_a_thing_is_let_go_4_mm_above_what_is_under_it_or_above_the_table(brick, x, y, z):
    under = [at(brick, 0.0, 0.0, 0.02)]  # its top is at 3 cm
    height = settling._height_below(under, RigidTransform([x, y, 0.0]), brick)
    assert height == pytest.approx(z)


def test_of_several_things_under_it_the_highest_counts_and_a_turned_one_by_its_lowest_corner(brick):
    under = [at(brick, 0.0, 0.0, 0.05), at(brick, 0.02, 0.0, 0.02)]
    on_edge = RigidTransform(RollPitchYaw(np.pi / 2, 0, 0), [0.0, 0.0, 0.0])
    assert settling._height_below(under, on_edge, brick) == pytest.approx(0.06 + 0.004 + 0.02)


def test_what_is_slower_in_both_ways_is_slower_and_all_must_be(brick):
    table = SettlingTable([at(brick, 0, 0, 0.01), at(brick, 0.2, 0, 0.01)], [0.0, 0.0])
    plant, context = table._plant, table._context

    def slower(omega, v):
        body = table._bodies[1]
        plant.SetVelocities(context, body.model_instance(), np.array([0, omega, 0, 0, 0, v]))
        return settling.are_slower(table._bodies, context, (1e-3, 1e-2))

    assert slower(0.0, 0.0)
    assert slower(0.009, 0.0009)
    assert not slower(0.011, 0.0)
    assert not slower(0.0, 0.0011)


def test_a_box_that_is_let_go_comes_to_rest_on_its_face_where_it_was(brick):
    table = SettlingTable([at(brick, 0.5, 0.1, 0.013)], [0.5, 0.0])
    assert table.settle(3.0)
    (rest,) = table.objects()
    np.testing.assert_allclose(rest.X_WB.translation(), [0.5, 0.1, 0.01], atol=2e-4)
    assert table.touching() == pairs((0, 1))
    assert table.stay(0.3)


def test_a_box_laid_on_another_is_a_pile_and_laid_aside_it_is_none(brick):
    table = SettlingTable([at(brick, 0.5, 0.0, 0.01), at(brick, 0.5, 0.0, 0.032, yaw=0.4)], [0.5, 0.0])
    assert table.settle(3.0)
    assert table.touching() == pairs((0, 1), (1, 2))
    assert is_pile(table.touching(), 2)
    table.lay(1, RigidTransform([0.8, 0.0, 0.0105]))
    assert table.settle(3.0)
    assert table.touching() == pairs((0, 1), (0, 2))
    assert table.objects()[1].X_WB.translation()[0] == pytest.approx(0.8, abs=1e-3)


def test_what_still_falls_is_not_at_rest_and_does_not_stay(brick):
    table = SettlingTable([at(brick, 0.5, 0.0, 1.5)], [0.5, 0.0])
    assert not table.settle(0.45)
    assert not table.stay(0.2)
