from dataclasses import replace

import numpy as np
import pytest

from riseg_drake.plausibility.check import doubts
from riseg_drake.plausibility.limits import PlausibilityLimits
from riseg_drake.plausibility.scale import doubts_about_distance, doubts_about_scale, scene_scale
from riseg_drake.plausibility.views import small_view
from tests.plausibility.filmed import hand_held, reader

LIMITS = PlausibilityLimits()


@pytest.fixture(scope="module")
def film():
    return hand_held(2, still=True)


def views(film, factor=1.0):
    return [small_view(replace(frame, depth=frame.depth * np.float32(factor)), LIMITS.width) for frame in film]


def test_the_table_is_as_far_away_as_it_was_drawn(film):
    _, distance = scene_scale(views(film))
    assert distance == pytest.approx(0.45, abs=0.005)


@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_a_scene_grows_with_its_depth(film, factor):
    scale, distance = scene_scale(views(film))
    other_scale, other_distance = scene_scale(views(film, factor))
    assert other_scale / scale == pytest.approx(factor, rel=0.05)
    assert other_distance / distance == pytest.approx(factor, rel=0.01)


@pytest.mark.parametrize(("units", "factor"), [(200.0, 5.0), (100.0, 10.0), (5000.0, 0.2), (10000.0, 0.1)])
def test_depth_that_is_many_times_too_large_or_small_is_no_table_scene(film, units, factor):
    (line,) = doubts_about_scale(views(film, factor), units, LIMITS)
    distance = float(line.split("puts the table ")[1].split(" m away")[0])
    assert distance == pytest.approx(0.45 * factor, rel=0.03)
    assert f'"depth_scale" {units:g} (units per metre)' in line
    assert "times the size of a usual table scene" in line


@pytest.mark.parametrize("units", [500.0, 2000.0])
def test_units_that_no_camera_has_are_doubted_at_any_distance(film, units):
    (line,) = doubts_about_scale(views(film), units, LIMITS)
    assert "is the unit of no camera or data set that is known" in line


@pytest.mark.parametrize("units", [1000.0, 3999.9998, 5000.0, 10000.0])
def test_units_of_cameras_and_data_sets_are_believed_where_the_scene_is_right(film, units):
    assert doubts_about_scale(views(film), units, LIMITS) == []


def test_without_a_table_nothing_is_said_about_its_size(film):
    nothing = [replace(frame, depth=np.zeros_like(frame.depth)) for frame in film]
    assert scene_scale(views(nothing)) is None
    assert doubts_about_scale(views(nothing), 1000.0, LIMITS) == []


@pytest.mark.parametrize(
    ("metres", "odd"), [(0.09, True), (0.11, False), (9.9, False), (10.1, True), (0, False)]
)
def test_where_no_table_is_seen_the_median_depth_tells(metres, odd):
    depth = np.full((6, 8), metres, np.float32)
    depth[:2] = 0
    said = f'the median depth is {metres:g} m, which is unlikely; is "depth_scale" (units per metre) right?'
    assert doubts_about_distance([depth, np.zeros_like(depth), depth]) == ([said] if odd else [])
    assert doubts_about_distance([np.full_like(depth, 0.5), np.full_like(depth, 0.5), depth]) == []


@pytest.mark.parametrize(("table", "times"), [(True, 0.1), (True, 0.2), (True, 50.0), (False, 0.2)])
def test_a_wrong_unit_is_said_once_with_a_table_and_without(film, times, table):
    """Tenths of the distance are below 10 cm, too, and fifty times as far is beyond 10 m."""
    rough = np.random.default_rng(0).uniform(0.3, 0.6, film[0].depth.shape).astype(np.float32)
    wrong = [replace(f, depth=(f.depth if table else rough) * np.float32(times)) for f in film]
    lines = [line for line in doubts(reader(wrong), 2, 1000 / times, None) if "depth_scale" in line]
    assert len(lines) == 1
    assert ("puts the table" in lines[0]) == table


def test_a_single_frame_is_asked_how_far_away_things_are(film):
    far = [replace(film[0], depth=film[0].depth * np.float32(100))]
    one, distance = doubts(reader(far), 1, 10.0, None)
    assert one.startswith("there is one frame only")
    assert distance.startswith("the median depth is 45 m")
