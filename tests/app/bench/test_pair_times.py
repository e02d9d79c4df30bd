"""Times of image pairs, in those of the flow that they need."""

import numpy as np
import pytest

from riseg_drake.app.bench.pair_times import FLOW, MOVING, STILL, PairTimes


@pytest.fixture
def times() -> PairTimes:
    times = PairTimes(flow=[0.010, 0.020, 0.030])
    for seconds in (0.030, 0.040, 0.050, 0.060, 0.080):
        times.book(seconds, moves=True)
    times.book(0.010, moves=False)
    return times


def test_a_ratio_is_to_the_median_of_the_flow_s_times(times):
    figures = times.figures()
    assert figures[MOVING] == {
        "calls": 5,
        "median_ms": 50.0,
        "p95_ms": pytest.approx(76.0),  # between 60 and 80, four fifths of the way
        "longest_ms": 80.0,
        "median_ratio": 2.5,
        "p95_ratio": 3.8,
        "longest_ratio": 4.0,
    }
    assert figures[STILL]["calls"] == 1
    assert figures[STILL]["median_ratio"] == 0.5
    assert figures[FLOW]["median_ratio"] == 1.0


def test_each_kind_of_pair_that_there_is_has_a_line(times):
    of_flow = "times the flow of the whole images (median, 95th percentile, longest of"
    assert times.said() == [
        f"{MOVING}: 2.5, 3.8 and 4.0 {of_flow} 5)",
        f"{STILL}: 0.5, 0.5 and 0.5 {of_flow} 1)",
    ]
    times.still.clear()
    assert len(times.said()) == 1


def test_the_flow_of_a_pair_of_images_is_timed():
    times = PairTimes()
    times.measure_flow(*np.random.default_rng(0).integers(0, 256, (2, 64, 64, 3)).astype(np.uint8))
    (seconds,) = times.flow
    assert seconds > 0
