import pytest

from riseg_drake.plausibility.limits import PlausibilityLimits
from riseg_drake.plausibility.lists import doubts_about_names, doubts_about_rate

LIMITS = PlausibilityLimits()


@pytest.mark.parametrize("rate", [0.5, 5.0, 15.0, 30.0, 90.0])
@pytest.mark.parametrize(
    ("times", "unit"), [(1e3, "milliseconds"), (1e6, "microseconds"), (1e9, "nanoseconds")]
)
def test_stamps_in_other_units_are_called_by_their_unit(rate, times, unit):
    (line,) = doubts_about_rate(rate / times, 10, LIMITS)
    assert f"they look like {unit}" in line


@pytest.mark.parametrize("rate", [0.5, 5.0, 15.0, 90.0, 1000.0])
def test_stamps_in_seconds_are_believed(rate):
    assert doubts_about_rate(rate, 10, LIMITS) == []


def test_a_single_frame_has_no_rate():
    assert doubts_about_rate(1e-3, 1, LIMITS) == []


def test_folders_that_are_there_and_not_used_are_named():
    lines = doubts_about_names(20, {"robot": 0, "label": 3}, {"masks": "1.png"}, "000000.jpg")
    assert lines == [
        "robot/ is not used: no file in it is named as a colour image, as 000000.jpg is",
        "masks/ (with 1.png) is not used; robot/ holds the robot's own pixels, label/ true object ids",
    ]
    assert doubts_about_names(20, {"robot": 20, "label": 1}, {}, "000000.png") == []
