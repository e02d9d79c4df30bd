"""Where things come to stand, for ways in that are given and not drawn."""

import cv2
import numpy as np
import pytest
from scipy.spatial import ConvexHull

from riseg_drake.stations import layouts
from riseg_drake.stations.footprint import Footprint, separation
from riseg_drake.stations.layouts import Habit, centred, lay_out, main_direction

LOOSE, SQUARED, SLIDING = Habit(), Habit(right_angles=True), Habit(slides=True)
GAP = 0.002


def rectangle(width, depth, yaw=0.0):
    half = np.array([width, depth]) / 2
    piece = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * half
    return Footprint((piece,), 0.0).moved(yaw, np.zeros(2))


SMALL, CUBE = rectangle(0.02, 0.02), rectangle(0.1, 0.1)


class Chosen:
    """In place of a generator: gives what was chosen, as shares of the range that is asked for."""

    def __init__(self, *shares):
        self.shares = list(shares)

    def _next(self, size):
        count = 1 if size is None else size
        taken, self.shares = self.shares[:count], self.shares[count:]
        assert len(taken) == count
        return taken[0] if size is None else np.array(taken)

    def uniform(self, low, high, size=None):
        return low + self._next(size) * (high - low)

    def integers(self, low, high, size=None):
        return np.floor(self.uniform(low, high, size)).astype(int)


BACK, DOWN, AHEAD, UP = 0.0, 0.25, 0.5, 0.75
"""Ways towards -x, -y, +x, +y, as shares of a turn from -pi."""


def way(heading, x=0.0, y=0.0):
    """A way in, unturned; x and y are how far the middle is missed, of -1 to 1."""
    return [0.5, heading, (x + 1) / 2, (y + 1) / 2]


def places(shapes, ways, habit=LOOSE, gap=GAP):
    """Where things come to lie, the first unturned; `ways` are those of each after it."""
    rng = Chosen(0.5, *np.ravel([[*given, *[given[-1]] * (24 - len(given))] for given in ways]))
    spots = lay_out(shapes, [gap] * len(shapes), habit, rng)
    if spots is None:
        return None
    assert rng.shares == []
    assert [yaw for yaw, _ in spots] == [0.0] * len(shapes)
    return [xy for _, xy in spots]


@pytest.mark.parametrize(
    ("heading", "place"),
    [(AHEAD, (-1, 0)), (UP, (0, -1)), (BACK, (1, 0)), (DOWN, (0, 1))],
)
def test_the_first_stands_in_the_middle_and_the_next_a_gap_from_it_on_the_side_it_comes_from(heading, place):
    first, second = places([CUBE, CUBE], [[way(heading)]])
    np.testing.assert_array_equal(first, [0, 0])
    assert second == pytest.approx((0.1 + GAP) * np.array(place), abs=1e-12)


def test_a_way_in_misses_the_middle_by_up_to_three_centimetres():
    for y in (-1.0, 0.3, 1.0):
        _, second = places([CUBE, CUBE], [[way(AHEAD, 0.7, y)]])
        assert second == pytest.approx([-0.1 - GAP, 0.03 * y])


def test_things_laid_flush_start_a_tenth_of_a_millimetre_apart():
    _, second = places([CUBE, CUBE], [[way(AHEAD)]], gap=0.0)
    assert second == pytest.approx([-0.1 - 1e-4, 0], abs=1e-12)


def test_the_middle_is_that_of_all_that_lies_there():
    ways = [[way(BACK)], [way(DOWN)]]
    spots = places([rectangle(0.3, 0.1), CUBE, CUBE], ways)
    assert spots[1] == pytest.approx([0.2 + GAP, 0], abs=1e-12)
    assert spots[2] == pytest.approx([(0.2 + GAP) / 2, 0.1 + GAP])


@pytest.mark.parametrize(("share", "quarters"), [(0.0, 0), (0.3, 1), (0.74, 2), (0.99, 3)])
def test_put_away_things_come_in_along_a_grid_turned_by_quarters_against_each_other(share, quarters):
    wedge = Footprint((np.array([[0, 0], [0.1, 0], [0, 0.05]]),), 0.0)
    grid = 0.5 + 0.2 / (2 * np.pi)
    unturned, turned = (
        lay_out([CUBE, wedge], [GAP] * 2, SQUARED, Chosen(grid, *[k, 0.0, 0.5, 0.5] * 24))[1][0]
        for k in (0.0, share)
    )
    assert turned - unturned == pytest.approx(quarters * np.pi / 2)
    (_, second) = lay_out([CUBE, CUBE], [GAP] * 2, SQUARED, Chosen(grid, *[0.0, share, 0.5, 0.5] * 24))
    heading = 0.2 + quarters * np.pi / 2
    assert second[1] == pytest.approx(-(0.1 + GAP) * np.array([np.cos(heading), np.sin(heading)]))


@pytest.mark.parametrize("habit", [SQUARED, Habit(right_angles=True, slides=True)])
def test_put_away_things_have_parallel_sides_and_faces_a_gap_apart_however_they_were_modelled(habit):
    shapes = [rectangle(0.10, 0.05, 0.3), rectangle(0.04, 0.08, -0.7), rectangle(0.06, 0.05, 2.0), CUBE]
    spots = lay_out(shapes, [GAP] * 4, habit, np.random.default_rng(3))
    laid = [shape.moved(*spot) for shape, spot in zip(shapes, spots, strict=True)]
    sides = np.vstack([np.roll(each.corners(), -1, axis=0) - each.corners() for each in laid])
    angles = np.arctan2(*sides.T[::-1])
    np.testing.assert_allclose(np.sin(2 * (angles - angles[0])), 0, atol=1e-9)
    assert [min(separation(a, b) for b in laid[:k]) for k, a in enumerate(laid) if k] == pytest.approx(
        [GAP] * 3
    )


def test_without_a_grid_yaw_and_way_are_any():
    # 36 degrees for the first, then a yaw of 72 degrees and a way towards +x - to where a corner is met.
    rng = Chosen(0.6, *[0.7, 0.5, 0.5, 0.5] * 24)
    (yaw, _), (next_yaw, second) = lay_out([CUBE, rectangle(0.5, 0.5)], [0.0, 0.0], Habit(), rng)
    assert yaw == pytest.approx(np.radians(36))
    assert next_yaw == pytest.approx(np.radians(72))
    # Along x the big square's side, 18 degrees from upright, meets the small one's corner at 36 + 135 degrees.
    lean, corner = np.radians(72), 0.05 * np.sqrt(2) * np.array([-np.cos(np.radians(9)), np.sin(np.radians(9))])
    outward = np.array([np.cos(lean - np.pi / 2), np.sin(lean - np.pi / 2)])
    reach = (corner @ outward - 0.25) / outward[0]
    assert second == pytest.approx([reach - 1e-4, 0], abs=1e-9)


@pytest.mark.parametrize("number", [0, 11, 23])
def test_of_all_ways_in_the_one_that_ends_nearest_to_the_middle_is_taken(number):
    ways = [way(AHEAD)] * 24
    ways[number] = way(UP)
    _, second = places([rectangle(0.4, 0.1), CUBE], [ways])
    assert second == pytest.approx([0, -0.1 - GAP], abs=1e-12)


def test_nearest_is_told_by_the_farthest_corner():
    # Modelled from its left end on: with that end 3 cm off the middle, the other is 3 cm nearer.
    long = rectangle(0.2, 0.02).moved(0.0, np.array([0.1, 0.0]))
    _, second = places([CUBE, long], [[way(UP), way(UP, x=-1), way(UP)]])
    assert second == pytest.approx([-0.03, -0.06 - GAP])


@pytest.mark.parametrize("habit", [LOOSE, SLIDING])
def test_nearest_is_meant_from_the_middle_of_all_and_not_of_the_first(habit):
    # Onto two cubes side by side: amid them, and not 3 cm to the side of the first.
    ways = [[way(BACK)], [way(DOWN), way(DOWN, x=-1)]]
    assert places([CUBE] * 3, ways, habit)[2] == pytest.approx([0.05 + GAP / 2, 0.1 + GAP])


def test_each_keeps_off_the_one_before_it():
    row = places([CUBE] * 4, [[way(BACK)]] * 3)
    np.testing.assert_allclose(row, [[k * (0.1 + GAP), 0] for k in range(4)], atol=1e-12)


def test_ways_that_meet_nothing_are_none():
    assert places([SMALL, SMALL], [[way(AHEAD, y=1.0)]]) is None
    _, second = places([SMALL, SMALL], [[way(AHEAD, y=1.0)] * 5 + [way(AHEAD)]])
    assert second == pytest.approx([-0.02 - GAP, 0], abs=1e-12)


@pytest.mark.parametrize("habit", [LOOSE, SLIDING])
@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("heading", [UP, DOWN])
def test_what_slides_goes_on_to_the_next_thing_on_the_side_of_the_middle(habit, side, heading):
    # A low wall, a high one at its end, and a cube that comes down on the low one, 3 cm from the high one.
    shapes, low = [rectangle(0.3, 0.1), rectangle(0.1, 0.4), CUBE], 1 if heading == DOWN else -1
    spots = places(shapes, [[way(BACK if side > 0 else AHEAD)], [way(heading, x=-side)]], habit)
    # Its middle is that of both, 0.1 + GAP / 2; less 3 cm it lands there, and slid it stands GAP from the wall.
    x = 0.07 + GAP / 2 if habit is LOOSE else 0.1
    assert spots[1] == pytest.approx([side * (0.2 + GAP), 0], abs=1e-12)
    assert spots[2] == pytest.approx([side * x, low * (0.1 + GAP)])


def test_what_came_in_beyond_the_middle_slides_back_to_it():
    # It lands between the high wall on the left and the middle, and goes away from the wall: nothing is there.
    shapes = [rectangle(0.3, 0.1), rectangle(0.1, 0.4), SMALL]
    spots = places(shapes, [[way(AHEAD)], [way(DOWN, x=-1)]], SLIDING)
    assert spots[2] == pytest.approx([-0.13 - GAP / 2, 0.06 + GAP])


def test_what_finds_no_second_contact_stays_where_it_touched():
    _, second = places([CUBE, CUBE], [[way(AHEAD, y=1.0)]], SLIDING)
    assert second == pytest.approx([-0.1 - GAP, 0.03])


@pytest.mark.parametrize(("width", "x"), [(0.144, 0.08), (0.12, 0.09)])
def test_what_stands_near_enough_to_a_second_thing_does_not_slide(width, x):
    # As above, with 2 cm: it lands at 0.11 less 3 cm, and the wall is at 0.17: 1.8 cm or 3 cm are left.
    shapes = [rectangle(0.3, 0.1), rectangle(0.1, 0.4), rectangle(width, 0.1)]
    spots = places(shapes, [[way(BACK)], [way(DOWN, x=-1)]], SLIDING, gap=0.02)
    assert spots[2] == pytest.approx([x, 0.12])


def test_of_those_that_slid_the_nearest_then_is_taken():
    # Its farthest corner is 16.5 cm from the middle if it comes from below, where nothing stops a slide; from
    # above 16.7 cm at first, and 15.6 cm where it has slid up to the wall.
    shapes = [rectangle(0.3, 0.1), rectangle(0.1, 0.12), CUBE]
    ways = [[way(BACK, y=1 / 3)], [*[way(UP)] * 5, way(DOWN, x=-1)]]
    spots = places(shapes, ways, SLIDING)
    assert spots[2] == pytest.approx([0.1, 0.1 + GAP])


class Face:
    """A large thing whose side leans; what comes along x meets it, and a step back gives `slant` of itself."""

    def __init__(self, slant):
        normal = np.array([-slant, np.sqrt(1 - slant**2)])
        along = np.array([normal[1], -normal[0]])
        corners = [3 * along, -3 * along, -3 * along - 3 * normal, 3 * along - 3 * normal]
        self.print = Footprint((np.array(corners)[::-1],), 0.0)
        self.slant = slant

    def spot(self, gap):
        """Of a tiny thing that came to touch at the origin."""
        tiny = Footprint((1e-9 * np.array([[1, 0], [0, 1], [-1, -1.0]]),), 0.0)
        return layouts._step_back(tiny, [self.print], 0.0, np.zeros(2), np.array([1.0, 0.0]), gap)


@pytest.mark.parametrize(("slant", "steps"), [(1.0, 1), (0.81, 1), (0.79, 2), (0.6, 2), (0.5, 3), (0.13, 12)])
def test_a_slanting_contact_takes_more_steps_back(slant, steps):
    # Each takes the part of the gap that is wanting: after n of them 1 - (1 - slant)^n of it is there.
    spot = Face(slant).spot(0.01)
    assert spot == pytest.approx([-0.01 * (1 - (1 - slant) ** steps) / slant, 0], abs=1e-7)
    assert -spot[0] * slant >= 0.008


def test_what_would_take_more_than_a_dozen_steps_is_given_up():
    assert Face(0.12).spot(0.01) is None


def test_steps_back_are_a_tenth_of_a_millimetre_at_least():
    assert Face(0.5).spot(1e-4) == pytest.approx([-2e-4, 0], abs=1e-7)


def test_each_stands_off_by_a_gap_of_its_own():
    rng = Chosen(0.5, *way(AHEAD) * 24, *way(BACK) * 24)
    (_, second), (_, third) = lay_out([CUBE] * 3, iter([9.0, 0.001, 0.004]), LOOSE, rng)[1:]
    assert second == pytest.approx([-0.101, 0], abs=1e-12)
    assert third == pytest.approx([0.104, 0], abs=1e-12)


def test_laid_out_things_are_moved_into_the_middle_of_the_work_area_as_they_lie():
    spots = [(0.0, np.array([5.0, 1.0])), (np.pi / 2, np.array([6.0, 1.0]))]
    shapes = [rectangle(0.2, 0.2), rectangle(0.4, 0.6)]  # from 4.9 to 6.3, and from 0.8 to 1.2
    moved = centred(spots, shapes, [0.5, -0.3], radius=2.0)
    assert [yaw for yaw, _ in moved] == [0.0, np.pi / 2]
    np.testing.assert_allclose([xy for _, xy in moved], [[-0.1, -0.3], [0.9, -0.3]])


def test_a_millimetre_of_the_work_area_stays_free():
    spots, shapes = [(0.0, np.array([5.0, 1.0]))], [rectangle(0.06, 0.08)]
    assert centred(spots, shapes, [0.5, 0.0], radius=0.05 + 0.00101) is not None
    assert centred(spots, shapes, [0.5, 0.0], radius=0.05 + 0.00099) is None


@pytest.mark.parametrize("seed", range(8))
def test_the_main_direction_is_that_of_the_smallest_rectangle_around(seed):
    points = np.random.default_rng(seed).normal(size=(9, 2))
    pieces = tuple(p[ConvexHull(p).vertices] for p in (points[:5], points[4:]))
    shape = Footprint(pieces, 0.0)
    turned = shape.moved(-main_direction(shape), np.zeros(2)).corners()
    _, (width, depth), _ = cv2.minAreaRect(shape.corners().astype(np.float32))
    assert np.ptp(turned, axis=0).prod() == pytest.approx(width * depth, rel=1e-5)
