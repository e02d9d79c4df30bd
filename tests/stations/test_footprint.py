"""Shapes from above, against closed forms and against convex programs that know nothing of edges."""

import numpy as np
import pytest
from pydrake.geometry import (
    Box,
    SceneGraph,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import CoulombFriction, MultibodyPlant
from pydrake.solvers import MathematicalProgram, Solve
from scipy.optimize import linprog
from scipy.spatial import ConvexHull

from riseg_drake.stations.footprint import Footprint, footprint, separation, travel

RIGHT = np.array([1.0, 0.0])


def rectangle(left, right, low, high):
    return np.array([[left, low], [right, low], [right, high], [left, high]], float)


def of(*pieces):
    return Footprint(pieces, 0.0)


SQUARE = of(rectangle(0, 1, 0, 1))


def drawn(rng, pieces, scale=1.0):
    """A footprint of convex polygons of 3 to 7 corners."""
    clouds = [scale * rng.normal(size=(8, 2)) for _ in range(pieces)]
    return of(*(cloud[ConvexHull(cloud).vertices] for cloud in clouds))


def seen(shapes, X_WB=None):
    """The footprint of a body of shapes with their poses X_BG."""
    plant, scene_graph = MultibodyPlant(0.001), SceneGraph()
    plant.RegisterAsSourceForSceneGraph(scene_graph)
    geometries = [
        plant.RegisterCollisionGeometry(plant.world_body(), X_BG, shape, f"c{k}", CoulombFriction(1, 1))
        for k, (X_BG, shape) in enumerate(shapes)
    ]
    plant.Finalize()
    return footprint(scene_graph.model_inspector(), geometries, X_WB or RigidTransform())


def as_set(points):
    return {tuple(point) for point in np.round(points, 9) + 0.0}


def area(polygon):
    """Positive where it is counterclockwise."""
    x, y = polygon.T
    return 0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)


def test_a_body_is_seen_as_it_is_turned_and_its_shapes_as_they_lie_in_it():
    X_BG = RigidTransform(RotationMatrix.MakeZRotation(np.pi / 2), [0.5, 0.0, 1.0])  # 4 x 2 x 6 about there
    X_WB = RigidTransform(RotationMatrix.MakeXRotation(np.pi / 2), [10, 20, 30])  # its z goes to -y
    outline = seen([(X_BG, Box(2, 4, 6))], X_WB)
    assert as_set(outline.corners()) == as_set(rectangle(8.5, 12.5, 16, 22))
    assert area(outline.pieces[0]) == pytest.approx(24)  # counterclockwise
    assert outline.bottom == pytest.approx(29)


def test_the_bottom_is_that_of_the_lowest_shape():
    outline = seen([(RigidTransform([x, 0, z]), Box(1, 1, 1)) for x, z in ((0, 0.3), (2, -0.4), (4, 0.1))])
    assert outline.bottom == pytest.approx(-0.9)
    assert len(outline.pieces) == 3


def at(x, y, size):
    return RigidTransform([x, y, 0.0]), Box(size, size, 1.0)


@pytest.mark.parametrize(
    ("shapes", "kept"),
    [
        ([at(0, 0, 1), at(0.2, 0.3, 0.4)], [0]),  # its edge lies on the other's
        ([at(0.2, 0.2, 0.4), at(0, 0, 1)], [1]),
        ([at(0, 0, 1), at(0.2, 0.31, 0.4)], [0, 1]),
        ([at(0, 0, 1), at(0, 0, 1)], [1]),
        ([at(0, 0, 1)], [0]),
        ([at(0, 0, 1), at(0.6, 0, 1), at(0.3, 0, 0.9)], [0, 1]),  # between two
    ],
)
def test_a_shape_that_lies_within_others_is_left_out(shapes, kept):
    alone = [as_set(seen([shape]).corners()) for shape in shapes]
    assert [as_set(piece) for piece in seen(shapes).pieces] == [alone[k] for k in kept]


def test_of_shapes_that_hide_each_other_the_largest_is_left():
    def bar(left, right):
        return RigidTransform([(left + right) / 2, 0.5, 0.0]), Box(right - left, 1.0, 1.0)

    outline = seen([bar(0, 3), bar(0, 2), bar(1, 3)])
    assert [as_set(piece) for piece in outline.pieces] == [as_set(rectangle(0, 3, 0, 1))]


def test_a_moved_shape_is_turned_about_its_origin_and_then_shifted():
    moved = Footprint((rectangle(1, 2, 0, 4), rectangle(-1, 0, 0, 1)), -0.2).moved(
        np.pi / 2, np.array([10, 20])
    )
    assert as_set(moved.pieces[0]) == as_set(rectangle(6, 10, 21, 22))
    assert as_set(moved.corners()) == as_set(np.vstack([rectangle(6, 10, 21, 22), rectangle(9, 10, 19, 20)]))
    assert moved.bottom == -0.2


def least_travel(p, q, direction):
    """The least d >= 0 for which p, d further on, has a point in common with q: a linear program; or inf."""
    equal = np.block(
        [
            [p.T, -q.T, direction[:, None]],
            [np.ones((1, len(p))), np.zeros((1, len(q) + 1))],
            [np.zeros((1, len(p))), np.ones((1, len(q))), np.zeros((1, 1))],
        ]
    )
    found = linprog(np.eye(equal.shape[1])[-1], A_eq=equal, b_eq=[0, 0, 1, 1])
    return found.fun if found.success else np.inf


def least_distance(p, q):
    """Between points of p and points of q: a quadratic program."""
    program = MathematicalProgram()
    a, b = program.NewContinuousVariables(len(p)), program.NewContinuousVariables(len(q))
    for weights in (a, b):
        program.AddBoundingBoxConstraint(0, 1, weights)
        program.AddLinearEqualityConstraint(np.ones((1, len(weights))), [1.0], weights)
    corners = np.hstack([p.T, -q.T])
    program.Add2NormSquaredCost(corners, np.zeros(2), np.concatenate([a, b]))
    found = Solve(program)
    assert found.is_success()
    return np.sqrt(max(found.get_optimal_cost(), 0.0))


@pytest.mark.parametrize("seed", range(12))
def test_travel_and_separation_are_those_of_the_nearest_points_of_any_two_pieces(seed):
    rng = np.random.default_rng(seed)
    heading, side = rng.uniform(-np.pi, np.pi), rng.uniform(-2, 2)
    direction = np.array([np.cos(heading), np.sin(heading)])
    moving, fixed = drawn(rng, 2), drawn(rng, 3)
    moving = moving.moved(0.0, -8 * direction + side * np.array([-direction[1], direction[0]]))
    pairs = [(p, q) for p in moving.pieces for q in fixed.pieces]
    expected = min(least_travel(p, q, direction) for p, q in pairs)
    assert travel(moving, fixed, direction) == pytest.approx(expected, abs=1e-8)
    apart = min(least_distance(p, q) for p, q in pairs)
    assert separation(moving, fixed) == pytest.approx(apart, abs=1e-5)
    assert separation(fixed, moving) == pytest.approx(apart, abs=1e-5)


def test_what_lies_behind_or_beside_the_way_is_not_met():
    for place in ([-3.0, 0.0], [3.0, 1.5], [3.0, -1.5]):
        assert travel(SQUARE, SQUARE.moved(0.0, np.array(place)), RIGHT) == np.inf


def test_a_corner_meets_a_corner_and_what_touches_already_goes_nowhere():
    tip = of(np.array([[1, 0], [0, 1], [-1, 0], [0, -1.0]]))
    assert travel(tip, tip.moved(0.0, np.array([5.0, 0.0])), RIGHT) == pytest.approx(3.0)
    assert travel(SQUARE, SQUARE.moved(0.0, RIGHT), RIGHT) == 0.0


def test_shapes_overlap_where_neither_has_a_corner_in_the_other():
    lying, standing = of(rectangle(-2, 2, -0.1, 0.1)), of(rectangle(-0.1, 0.1, -2, 2))
    assert separation(lying, standing) == 0.0
    assert separation(SQUARE, of(rectangle(0.4, 0.5, 0.4, 0.5))) == 0.0
    assert separation(of(rectangle(0.4, 0.5, 0.4, 0.5)), SQUARE) == 0.0


def test_one_piece_that_overlaps_is_enough():
    assert separation(of(rectangle(5, 6, 0, 1), rectangle(0, 1, 0, 1)), SQUARE.moved(0.3, RIGHT / 3)) == 0.0


def test_things_of_a_few_centimetres_stand_apart_as_well():
    assert separation(of(rectangle(0, 0.05, 0, 0.04)), of(rectangle(0.06, 0.1, 0, 0.04))) == pytest.approx(0.01)
