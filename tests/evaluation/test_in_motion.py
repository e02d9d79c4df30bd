"""Masks while things move, on masks drawn by hand."""

import numpy as np
import pytest

from riseg_drake.evaluation.in_motion import (
    InMotion,
    in_motion,
    in_motion_of_steps,
    mean_over_scenes,
    moved_objects,
    overlap_f_of,
    pooled,
)
from riseg_drake.evaluation.scores import overlap_f_by_object, score

NAN = float("nan")


def at(x, y=0.0):
    X_WB = np.eye(4)
    X_WB[:2, 3] = [x, y]
    return X_WB


def columns(**spans):
    """A label image [10, 100] with object `_k` in the columns of a span."""
    labels = np.zeros((10, 100), np.uint16)
    for name, (start, stop) in spans.items():
        labels[:, start:stop] = int(name[1:])
    return labels


def test_an_object_counts_from_one_centimetre_of_motion_on():
    before = {"a": at(0.5), "b": at(0.5), "c": at(0.5)}
    now = {"a": at(0.5099), "b": at(0.506, 0.008), "c": at(0.52)}
    assert moved_objects(before, now, {1: "a", 2: "b", 3: "c"}) == {2, 3}
    assert moved_objects({}, now, {1: "a", 2: "b", 3: "c"}) == set()  # before the first interaction


def test_each_object_has_the_f_of_the_mask_assigned_to_it():
    truth = columns(_1=(0, 20), _2=(20, 40), _3=(60, 70))
    mask = columns(_7=(10, 40))  # covers 10 of 20 columns of 1, all of 2: P = 20 / 30, R = 1 for 2
    assert overlap_f_by_object(mask, truth) == {1: 0.0, 2: pytest.approx(0.8), 3: 0.0}
    assert overlap_f_by_object(np.zeros_like(mask), truth) == {1: 0.0, 2: 0.0, 3: 0.0}


def test_the_f_by_object_is_that_of_the_fields_protocol_where_there_is_one_object():
    truth, mask = columns(_1=(10, 40)), columns(_5=(20, 45))
    assert overlap_f_by_object(mask, truth)[1] == pytest.approx(score(mask, truth).overlap_f)


def test_only_moved_objects_in_sight_count():
    truth, mask = columns(_1=(0, 20), _2=(20, 40)), columns(_7=(10, 40), _8=(0, 5))
    assert overlap_f_of({2}, mask, truth) == pytest.approx(0.8)
    assert overlap_f_of({1, 2, 9}, mask, truth) == pytest.approx((0.8 + 0.4) / 2)  # P = 1, R = 1 / 4
    assert np.isnan(overlap_f_of({9}, mask, truth))


def test_an_interaction_is_the_mean_over_its_frames():
    assert in_motion([0.5, NAN, 0.7], 0.9) == InMotion(2, pytest.approx(0.6), 0.9)
    assert in_motion([NAN], 0.9) is None
    assert in_motion([], NAN) is None


def test_a_scene_weighs_by_frames_and_scenes_weigh_alike():
    a, b = InMotion(10, 0.5, 0.6), InMotion(30, 0.9, 0.8)
    assert pooled([a, None, b]) == InMotion(40, pytest.approx(0.8), pytest.approx(0.75))
    assert pooled([None]) is None
    assert pooled([a, InMotion(30, 0.9, NAN)]).at_rest_f == 0.6
    assert mean_over_scenes([[a, b], [InMotion(1, 0.2, 0.35)], [None]]) == (
        2,
        InMotion(41, pytest.approx(0.5), pytest.approx(0.55)),
    )
    assert in_motion_of_steps([[a, b], [b]], 3) == [
        (2, InMotion(40, pytest.approx(0.7), pytest.approx(0.7))),
        (1, b),
        (0, None),
    ]
