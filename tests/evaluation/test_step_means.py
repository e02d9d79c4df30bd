import math
from dataclasses import replace

import numpy as np
import pytest

from riseg_drake.evaluation.scores import score
from riseg_drake.evaluation.step_means import EMPTY_PREDICTION, carried, step_deviations, step_means


def scores(overlap_f, objects_true=4.0):
    """Scores of which only these two figures matter."""
    return replace(EMPTY_PREDICTION, overlap_f=overlap_f, objects_true=objects_true)


LONG = [scores(0.0), scores(0.5), scores(1.0)]
SHORT = [scores(0.0, 6.0), scores(0.8, 6.0)]


def test_means_are_over_scenes_step_by_step():
    means = step_means([LONG, SHORT], last_step=1)
    assert [mean.overlap_f for mean in means] == pytest.approx([0.0, 0.65])
    assert [mean.objects_true for mean in means] == [5.0, 5.0]


def test_a_scene_that_ended_early_keeps_its_last_state():
    assert carried(SHORT, 3) == [*SHORT, SHORT[-1], SHORT[-1]]
    means = step_means([LONG, SHORT], last_step=3)
    assert [mean.overlap_f for mean in means] == pytest.approx([0.0, 0.65, 0.9, 0.9])


def test_a_scene_that_never_was_counts_as_an_empty_prediction():
    means = step_means([LONG, []], last_step=2)
    assert [mean.overlap_f for mean in means] == pytest.approx([0.0, 0.25, 0.5])
    assert means[2].overlap_precision == 1.0
    assert means[2].objects_true == 4.0  # it is not known what stood there


def test_an_empty_prediction_has_the_scores_that_the_protocol_gives_it():
    ground_truth = np.zeros((20, 30), np.uint16)
    ground_truth[5:10, 5:10] = 1
    of_protocol = score(np.zeros_like(ground_truth), ground_truth)
    assert replace(of_protocol, objects_true=0.0) == replace(EMPTY_PREDICTION, objects_true=0.0)
    assert math.isnan(EMPTY_PREDICTION.objects_true)


def test_the_spread_is_the_sample_standard_deviation():
    deviations = step_deviations([LONG, SHORT], last_step=2)
    assert deviations[1].overlap_f == pytest.approx(0.3 / math.sqrt(2))
    assert step_deviations([LONG], last_step=2)[1].overlap_f == 0.0


def test_without_scenes_there_is_no_mean():
    with pytest.raises(ValueError, match="no scenes"):
        step_means([], last_step=5)
