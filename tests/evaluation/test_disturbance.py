import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from riseg_drake.evaluation.disturbance import (
    Disturbance,
    ObjectMotion,
    disturbance_of_all,
    disturbance_of_steps,
    motion_between,
    object_at,
)
from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.geometry.rgbd import Frame


def turned(X_WB, axis, degrees):
    out = X_WB.copy()
    out[:3, :3] = Rotation.from_euler(axis, degrees, degrees=True).as_matrix() @ X_WB[:3, :3]
    return out


def moved(X_WB, *p):
    out = X_WB.copy()
    out[:3, 3] += p
    return out


def test_turning_on_the_table_is_no_tilt_and_leaning_is():
    X_WB0 = moved(turned(turned(np.eye(4), "x", 17), "y", -11), 0.5, -0.2, 0.1)
    before = {"a": X_WB0, "b": X_WB0}
    after = {"a": moved(turned(X_WB0, "z", 70), 0.03, 0.04, 0), "b": turned(X_WB0, "y", 10)}
    motions = motion_between(before, before, after, {})
    assert motions["a"].moved_m == pytest.approx(0.05)
    assert motions["a"].tilted_deg == pytest.approx(0, abs=1e-5)
    assert motions["b"].tilted_deg == pytest.approx(10)


def test_small_tilts_add_up_to_one_since_the_start():
    start = {"a": np.eye(4)}
    before = {"a": turned(np.eye(4), "x", 15)}
    motion = motion_between(start, before, {"a": turned(np.eye(4), "x", 25)}, {})["a"]
    assert motion.tilted_deg == pytest.approx(10)
    assert motion.tilted_in_all_deg == pytest.approx(25)


STANDING = moved(turned(np.eye(4), "z", 20), 0.5, 0.1, 0.056)
"""X_WBcm of a can of radius 30 and height 112 mm, its axis B's z."""
LYING = moved(turned(turned(np.eye(4), "y", 90), "z", 35), 0.5, 0.1, 0.030)
CUBE = moved(np.eye(4), 0.5, 0.1, 0.025)
AXIS = np.array([[0.0, 0.0, 1.0]])
BALL = np.eye(3)
NOT_ROUND = np.zeros((0, 3))
ROLLED = moved(turned(turned(turned(LYING, "z", -35), "x", 90), "z", 35), 0.03 * np.pi / 2, 0, 0)


@pytest.mark.parametrize(
    ("before", "after", "axes", "tilt", "verdict"),
    [
        (LYING, ROLLED, AXIS, 0.0, ""),
        (LYING, moved(turned(ROLLED, "z", 64), 0.1, -0.1, 0), AXIS, 0.0, ""),
        (LYING, ROLLED, NOT_ROUND, 90.0, "toppled"),
        (STANDING, LYING, AXIS, 90.0, "toppled"),
        (LYING, STANDING, AXIS, 90.0, "toppled"),
        (STANDING, turned(STANDING, "x", 180), AXIS, 180.0, "toppled"),
        (STANDING, turned(STANDING, "z", 120), AXIS, 0.0, ""),
        (STANDING, turned(STANDING, "x", 35), AXIS, 35.0, "toppled"),
        (CUBE, turned(CUBE, "y", 90), NOT_ROUND, 90.0, "toppled"),
        (CUBE, turned(CUBE, "y", 35), NOT_ROUND, 35.0, "toppled"),
        (CUBE, turned(CUBE, "y", 15), NOT_ROUND, 15.0, ""),
        (CUBE, turned(turned(CUBE, "y", 75), "x", 110), BALL, 0.0, ""),
        (moved(CUBE, 0, 0, 0.04), CUBE, NOT_ROUND, 0.0, "fell"),
        (moved(LYING, 0, 0, 0.04), ROLLED, AXIS, 0.0, "fell"),
        (moved(CUBE, 0, 0, 0.04), turned(CUBE, "x", -90), NOT_ROUND, 90.0, "toppled"),
        (CUBE, moved(CUBE, 0, 0, 0.04), NOT_ROUND, 0.0, ""),
        (moved(CUBE, 0, 0, 0.0099), CUBE, NOT_ROUND, 0.0, ""),
        (moved(CUBE, 0, 0, 0.0101), CUBE, NOT_ROUND, 0.0, "fell"),
    ],
    ids=[
        "a can rolls by a quarter",
        "it rolls and turns on the table",
        "what is not round does not roll",
        "a can that stood lies",
        "one that lay stands",
        "one stands on its head",
        "one spins where it stands",
        "one leans by 35 degrees",
        "a cube lies on another face, as high as before",
        "a box leans by 35 degrees",
        "one leans a little",
        "a ball rolls anyhow",
        "a box slides off another",
        "a can rolls off one",
        "a box falls off one and turns over",
        "a box is pushed onto another",
        "a thing comes down from a sheet",
        "one comes down from a board",
    ],
)
def test_what_topples_has_turned_over_and_what_falls_has_come_down_without(before, after, axes, tilt, verdict):
    motion = motion_between({"a": before}, {"a": before}, {"a": after}, {"a": axes})["a"]
    assert motion.tilted_in_all_deg == pytest.approx(tilt, abs=1e-6)
    assert motion.came_down_m == pytest.approx(before[2, 3] - after[2, 3])
    assert [name for name in ("toppled", "fell", "left_table") if getattr(motion, name)] == verdict.split()


@pytest.mark.parametrize(("height", "left"), [(0.002, False), (-0.002, True), (-0.6, True)])
def test_what_has_its_centre_of_mass_below_the_top_has_left_the_table(height, left):
    start = {"a": moved(np.eye(4), 0, 0, 0.04)}
    after = {"a": moved(np.eye(4), 0, 0, height)}
    assert motion_between(start, start, after, {})["a"].left_table is left


def test_a_push_goes_for_the_object_whose_surface_is_nearest_to_the_contact():
    intrinsics = Intrinsics(64, 48, 60.0, 60.0, 31.5, 23.5)
    X_WC = np.diag([1.0, -1.0, -1.0, 1.0])  # looks down from half a metre
    X_WC[:3, 3] = [0.4, 0.1, 0.5]
    labels = np.zeros(intrinsics.shape, np.uint16)
    labels[10:20, 10:20] = 1
    labels[10:20, 30:60] = 2
    depth = np.full(intrinsics.shape, 0.45, np.float32)
    frame = Frame(0, 0.0, intrinsics, np.zeros((48, 64, 3), np.uint8), depth, X_WC, np.zeros((48, 64), bool))
    beside_two = np.array([0.4 + (28 - 31.5) / 60 * 0.45, 0.1 - (15 - 23.5) / 60 * 0.45, 0.01])
    beside_one = np.array([0.4 + (21 - 31.5) / 60 * 0.45, 0.1 - (15 - 23.5) / 60 * 0.45, 0.01])
    assert object_at(beside_two, frame, labels) == 2
    assert object_at(beside_one, frame, labels) == 1
    assert object_at(beside_one, frame, np.zeros_like(labels)) is None


def disturbance(pushed, **moved_mm):
    return Disturbance(pushed, {name: ObjectMotion(mm / 1000, 0.0) for name, mm in moved_mm.items()})


def test_pushed_objects_have_a_mean_and_the_others_a_median():
    scenes = [
        [disturbance("a", a=20, b=1, c=3)],
        [disturbance("b", a=90, b=10, c=2), disturbance("c", a=0, b=0, c=5)],
    ]
    first, second = disturbance_of_steps(scenes, last_step=2)
    assert (first.interactions, second.interactions) == (2, 1)
    assert first.pushed_mean_m == pytest.approx(0.015)
    assert first.others_median_m == pytest.approx(0.0025)
    assert second.pushed_mean_m == pytest.approx(0.005)
    everything = disturbance_of_all(scenes)
    assert everything.interactions == 3
    assert everything.pushed_mean_m == pytest.approx(0.035 / 3)
    assert everything.others_median_m == pytest.approx(0.0015)


def test_what_topples_or_falls_is_counted_once():
    def state(tilt, left):
        return Disturbance("a", {"a": ObjectMotion(0.01, 0.0, tilt, left), "b": ObjectMotion(0.0, 0.0, 3.0)})

    scene = [state(20.0, False), state(21.0, False), state(90.0, True), state(95.0, True)]
    steps = disturbance_of_steps([scene], last_step=4)
    assert [figures.toppled for figures in steps] == [0, 1, 0, 0]
    assert [figures.fell for figures in steps] == [0, 0, 0, 0]
    assert [figures.left_table for figures in steps] == [0, 0, 1, 0]
    assert disturbance_of_all([scene]).toppled == 1
    assert disturbance_of_all([scene]).tilt_max_deg == 95.0


def test_what_falls_counts_once_and_no_more_where_it_topples_then():
    def state(down, tilt=0.0, left=False):
        return Disturbance("a", {"a": ObjectMotion(0.01, 0.0, tilt, left, down)})

    def counts(*scene):
        return [(figures.fell, figures.toppled) for figures in disturbance_of_steps([scene], len(scene))]

    assert counts(state(0.01), state(0.03), state(0.05)) == [(0, 0), (1, 0), (0, 0)]
    assert counts(state(0.03), state(0.03, 30.0), state(0.03, 10.0)) == [(1, 0), (0, 1), (0, 0)]
    assert counts(state(0.03, 30.0), state(0.03, 30.0), state(0.03, 30.0)) == [(0, 1), (0, 0), (0, 0)]
    assert counts(state(0.7, left=True), state(0.7, left=True)) == [(0, 0), (0, 0)]


def test_where_nothing_was_done_there_are_no_figures():
    figures = disturbance_of_all([[], []])
    assert figures.interactions == 0
    assert math.isnan(figures.pushed_mean_m)
