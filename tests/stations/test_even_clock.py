import numpy as np
import pytest

from riseg_drake.stations.even_clock import SET, EvenClock

WALL, STEADY = 1_700_000_000.0, 5000.0


class Computer:
    """Two clocks; the one may be set, and a program may be kept from running between two looks."""

    def __init__(self):
        self.now, self.set_by, self.nap = 0.0, 0.0, 0.0
        self.clock = EvenClock(self.wall, self.steady)

    def wall(self):
        self.now += self.nap
        return WALL + self.now + self.set_by

    def steady(self):
        return STEADY + self.now


@pytest.mark.parametrize("step", [-3600.0, -1.0, -0.05, 0.05, 1.0])
def test_it_goes_on_evenly_whatever_is_done_to_the_computers_clock(step):
    computer = Computer()
    start = computer.clock()
    assert start == pytest.approx(WALL, abs=1e-6)
    computer.now, computer.set_by = 10.0, step
    assert computer.clock() - start == pytest.approx(10.0, abs=1e-6)
    stamp = computer.wall()
    assert stamp + computer.clock.shift() == pytest.approx(computer.clock(), abs=1e-6)


def test_until_the_clock_is_set_stamps_are_not_changed_by_a_digit():
    computer = Computer()
    for computer.now in np.linspace(0, 1000, 50):
        assert computer.clock.shift() == 0.0


def test_a_program_that_sleeps_between_two_looks_is_no_clock_that_was_set():
    computer = Computer()
    computer.nap = 10 * SET
    for _ in range(10):
        assert computer.clock.shift() == 0.0
