import pytest

from riseg_drake.app.evaluate.progress import time_left


@pytest.mark.parametrize(
    ("completed", "finished_before", "last_at", "elapsed", "words"),
    [
        (2, 2, 0, 75, "1 min 15 s so far, time left is known after the next scene"),
        (4, 2, 120, 120, "about 6 min 00 s left"),
        (4, 2, 120, 150, "about 5 min 30 s left"),
        (5, 4, 4000, 4000, "about 5 h 33 min left"),
        (9, 4, 50, 100, "about 0 s left"),
        (10, 4, 59, 60, "done in 1 min 00 s"),
    ],
)
def test_the_time_left_is_that_of_the_scenes_left_at_the_pace_of_this_session(
    completed, finished_before, last_at, elapsed, words
):
    assert time_left(10, completed, finished_before, last_at, elapsed) == words
