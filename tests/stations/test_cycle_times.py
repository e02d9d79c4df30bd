import numpy as np
import pytest

from riseg_drake.stations.cycle_times import MOST, RESOLUTION, CycleTimes


def test_percentiles_are_those_of_all_times_to_a_hundredth_of_a_millisecond():
    seconds = np.random.default_rng(0).gamma(3.0, 5e-5, 20_000)
    times = CycleTimes()
    for one in seconds:
        times.add(float(one))
    assert times.count == 20_000
    assert times.longest == seconds.max()
    for percent in (1, 50, 99, 99.9):
        exact = np.percentile(seconds, percent, method="inverted_cdf")
        assert 0 <= times.percentile(percent) - exact <= RESOLUTION


def test_the_line_says_median_99_9_percent_and_the_longest_of_times_that_are_known():
    times = CycleTimes()
    for seconds in [1.05e-4] * 998 + [4.05e-4] * 1 + [2.5e-3] * 1:
        times.add(seconds)
    assert times.told() == "0.11 ms (median), 0.41 ms (99.9 % take no longer), 2.50 ms (longest) in 1000 cycles"


def test_memory_stays_what_it_is_whatever_comes_in():
    times = CycleTimes()
    assert (times.percentile(50), times.longest) == (0.0, 0.0)
    size = len(times._bins)
    for seconds in (0.0, MOST, 50.0):
        times.add(seconds)
    assert len(times._bins) == size
    assert times.percentile(100) == pytest.approx(MOST, abs=2 * RESOLUTION)
    assert times.longest == 50.0
