"""`riseg bench --run`: all time is told once, and by the room that caused it."""

import json

import pytest

from riseg_drake.app.bench.whole_run import DRAWING, REST, STEPPING, seconds_by_room
from riseg_drake.app.cli import main

FIT = ("/site/riseg_drake/segmentation/fit.py", 1, "fit")
PUSH = ("/site/riseg_drake/pushing/push.py", 7, "push")
MEAN = ("/site/numpy/mean.py", 3, "mean")
REDUCE = ("~", 0, "<method 'reduce' of 'numpy.ufunc' objects>")
ADVANCE = ("~", 0, "<built-in method pydrake.systems.analysis.AdvanceTo>")
EVAL = ("~", 0, "<built-in method pydrake.systems.framework.Eval>")
MAIN = ("/usr/lib/runpy.py", 1, "main")


def test_what_a_library_takes_counts_for_the_rooms_that_called_it_in_proportion():
    rooms = seconds_by_room(
        {
            FIT: (1, 1, 1.0, 4.0, {ADVANCE: (1, 1, 1.0, 4.0)}),
            PUSH: (1, 1, 0.25, 1.25, {ADVANCE: (1, 1, 0.25, 1.25)}),
            # Three quarters of the mean's time are the fit's; and so of what the mean calls.
            MEAN: (4, 4, 0.5, 4.0, {FIT: (3, 3, 0.375, 3.0), PUSH: (1, 1, 0.125, 1.0)}),
            REDUCE: (4, 4, 3.5, 3.5, {MEAN: (4, 4, 3.5, 3.5)}),
            ADVANCE: (1, 1, 2.0, 7.25, {MAIN: (1, 1, 2.0, 7.25)}),
            EVAL: (1, 1, 6.0, 6.0, {FIT: (1, 1, 6.0, 6.0)}),
            MAIN: (1, 1, 0.125, 8.0, {}),
        }
    )
    assert rooms == {DRAWING: 6.0, "segmentation": 4.0, STEPPING: 2.0, "pushing": 1.25, REST: 0.125}
    assert list(rooms) == [DRAWING, "segmentation", STEPPING, "pushing", REST]


def test_library_functions_that_call_each_other_count_for_who_called_the_first():
    again = ("/site/numpy/again.py", 1, "again")
    rooms = seconds_by_room(
        {
            FIT: (1, 1, 0.0, 3.0, {}),
            MEAN: (2, 2, 1.0, 3.0, {FIT: (1, 1, 0.5, 3.0), again: (1, 1, 0.5, 1.0)}),
            again: (1, 1, 2.0, 2.5, {MEAN: (1, 1, 2.0, 2.5)}),
        }
    )
    assert rooms == {"segmentation": pytest.approx(3.0)}


def test_where_drake_is_in_no_profile_its_time_is_that_of_who_steps_and_of_who_takes_pictures():
    step = ("/site/riseg_drake/stations/physics.py", 10, "advance")
    take = ("/site/riseg_drake/stations/wrist_camera.py", 119, "_take")
    noise = ("/site/riseg_drake/stations/sensor_noise.py", 9, "noisy_depth")
    rooms = seconds_by_room({f: (1, 1, own, own, {}) for f, own in ((step, 4.0), (take, 2.0), (noise, 1.0))})
    assert rooms == {STEPPING: 4.0, DRAWING: 2.0, "stations": 1.0}


@pytest.mark.renders
def test_a_run_is_told_room_by_room_and_adds_up(small_scenario, tmp_path, capsys):
    file = tmp_path / "run.json"
    assert main(["bench", str(small_scenario), "--seed", "1", "--run", "--json", str(file)]) == 0
    told, printed = json.loads(file.read_text()), capsys.readouterr().out
    assert told["interactions"] == 1
    assert {"segmentation", "pushing", "robot", "stations", STEPPING, DRAWING} <= set(told["rooms_s"])
    # A profiler's clock misses what it takes itself, and nothing else.
    assert 0.5 * told["processor_s"] < sum(told["rooms_s"].values()) <= told["processor_s"]
    for name, seconds in told["rooms_s"].items():
        assert f"{name} " in printed
        assert f" {seconds:.1f} " in printed
