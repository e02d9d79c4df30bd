import numpy as np
import pytest

from riseg_drake.pushing.tried_pushes import TriedPush, novelty, times_pushed

AHEAD = np.array([1.0, 0.0])


def test_a_thing_was_pushed_by_what_ended_at_it(drawn):
    table = drawn.box(0.5, 0.0, 0.04, 0.04).map()
    at_it = TriedPush(np.array([0.46, 0.0, 0.02]), AHEAD, changed=True)  # ended at its edge, 0.48
    elsewhere = TriedPush(np.array([0.46, 0.05, 0.02]), AHEAD, changed=True)
    assert times_pushed(table.objects, table, [at_it, elsewhere, at_it], 0.02) == 2


def test_a_push_is_new_from_the_other_side_or_from_afar(drawn):
    made = [TriedPush(np.array([0.46, 0.0, 0.02]), AHEAD, changed=True)]
    b_W = np.array([[0.46, 0.0], [0.46, 0.0], [0.46, 0.0], [0.49, 0.0], [0.46, 0.1]])
    direction_W = np.array([AHEAD, [0.0, 1.0], -AHEAD, AHEAD, AHEAD])
    new = novelty(b_W, direction_W, made, 0.03)[:, 0]
    assert new == pytest.approx([0.0, 0.5, 1.0, 1 - np.exp(-0.5), 1.0], abs=0.005)


def test_without_pushes_there_is_nothing_to_be_like():
    assert novelty(np.zeros((4, 2)), np.tile(AHEAD, (4, 1)), [], 0.03).shape == (4, 0)
