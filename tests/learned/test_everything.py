"""Segment Anything alone: what is sharp, sure and on the table is an object, once."""

import numpy as np
import pytest

from riseg_drake.evaluation.scores import score
from riseg_drake.learned.everything import EverythingParameters, segment_everything
from riseg_drake.learned.prompts import Answer

LABELS = np.zeros((96, 128), np.uint16)
LABELS[10:50, 10:50], LABELS[20:80, 60:110] = 1, 2
COLOR = np.zeros((96, 128, 3), np.uint8)


def model(sure=0.95, stable=0.99):
    """Answers with what is under the point, be it the table; sometimes a pixel short."""

    def answers(color, prompts):
        for number, prompt in enumerate(prompts):
            u, v = prompt.points[0].astype(int)
            mask = LABELS[v, u] == LABELS
            if number % 2:
                mask = mask & np.roll(mask, 1, axis=0)
            yield Answer(mask[None], np.array([sure - 0.01 * (number % 2)]), np.array([stable]))

    return answers


def test_each_object_is_found_once_and_the_table_is_none():
    found = segment_everything(COLOR, LABELS > 0, model(), EverythingParameters())
    assert set(np.unique(found)) == {0, 1, 2}
    assert score(found, LABELS).overlap_f == pytest.approx(1.0)


@pytest.mark.parametrize("doubt", [{"sure": 0.5}, {"stable": 0.5}])
def test_what_is_not_sure_or_not_sharp_is_left_out(doubt):
    assert not segment_everything(COLOR, LABELS > 0, model(**doubt), EverythingParameters()).any()


def test_a_part_stays_visible_on_the_whole():
    part = np.zeros(LABELS.shape, bool)
    part[30:40, 70:80] = True

    def answers(color, prompts):
        for _ in prompts:
            yield Answer(np.stack([part, LABELS == 2]), np.array([0.9, 0.95]), np.ones(2))

    found = segment_everything(COLOR, LABELS > 0, answers, EverythingParameters())
    assert len(np.unique(found[part])) == 1
    assert set(np.unique(found)) == {0, 1, 2}
