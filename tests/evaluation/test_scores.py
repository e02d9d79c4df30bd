import os
from dataclasses import astuple
from pathlib import Path

import numpy as np
import pytest

from riseg_drake.evaluation.boundary import boundary_map, dilate, tolerance
from riseg_drake.evaluation.scores import FIGURES, mean_scores, numbered_alike, overlap_f_by_object, score

REFERENCE = (
    Path(os.environ.get("RISEG_EVALUATION", Path(__file__).parents[3] / "shared" / "evaluation"))
    / "reference_scores.npz"
)
NOTHING = np.zeros((40, 50), np.uint16)


def boxes(*corners, shape=(40, 50)):
    """A label image with one box (v0, v1, u0, u1) an object, ids 1, 2, ... in order."""
    labels = np.zeros(shape, np.uint16)
    for object_id, (v0, v1, u0, u1) in enumerate(corners, start=1):
        labels[v0:v1, u0:u1] = object_id
    return labels


TWO = boxes((5, 15, 5, 15), (20, 30, 20, 40))


def test_all_reference_cases_agree_to_1e_9():
    if not REFERENCE.exists():
        pytest.skip(f"{REFERENCE} is not there; set RISEG_EVALUATION to the folder that holds it")
    data = np.load(REFERENCE)
    assert tuple(data["keys"]) == FIGURES
    for k, name in enumerate(data["names"]):
        scores = score(data[f"prediction_{k:02d}"], data[f"ground_truth_{k:02d}"])
        np.testing.assert_allclose(astuple(scores), data["reference"][k], rtol=0, atol=1e-9, err_msg=name)


def test_nothing_predicted_is_precise_and_recalls_nothing():
    assert astuple(score(NOTHING, TWO)) == (1, 0, 0, 1, 0, 0, 0, 0, 2, 0)


def test_something_predicted_on_an_empty_table_is_wrong_and_complete():
    assert astuple(score(TWO, NOTHING)) == (0, 1, 0, 0, 1, 0, 2, 0, 0, 0)


def test_an_empty_table_seen_empty_is_perfect():
    assert astuple(score(NOTHING, NOTHING)) == (1, 1, 1, 1, 1, 1, 0, 0, 0, 1)


def test_on_an_empty_table_no_object_has_an_f():
    assert overlap_f_by_object(TWO, NOTHING) == overlap_f_by_object(NOTHING, NOTHING) == {}


def test_ids_do_not_matter():
    relabelled = np.array([0, 700, 3], np.uint16)[TWO]
    assert astuple(score(relabelled, TWO)) == (1, 1, 1, 1, 1, 1, 2, 2, 2, 1)


def test_two_objects_taken_for_one_count_the_larger_only():
    # True: 10x10 and 10x20 side by side; the prediction covers both with one id.
    true = boxes((5, 15, 5, 15), (5, 15, 15, 35))
    merged = (true > 0).astype(np.uint16)
    scores = score(merged, true)
    assert scores.overlap_precision == pytest.approx(200 / 300)
    assert scores.overlap_recall == pytest.approx(200 / 300)
    # The larger has p = 2/3, r = 1, so F = 0.8, and is found; the other is not.
    assert scores.objects_found == 1
    assert scores.found_share == 0.5


def test_f_of_exactly_three_quarters_is_not_found():
    true = boxes((0, 10, 0, 8))
    prediction = boxes((0, 10, 2, 10))  # p = r = 60 / 80
    scores = score(prediction, true)
    assert scores.overlap_f == pytest.approx(0.75)
    assert scores.objects_found == 0


def test_boundaries_three_pixels_apart_agree_at_640x480_and_four_pixels_apart_do_not():
    true = boxes((100, 200, 100, 300), shape=(480, 640))
    for shift, agrees in ((3, True), (4, False)):
        prediction = np.roll(true, shift, axis=0)
        scores = score(prediction, true)
        assert (scores.boundary_f == 1) == agrees


def test_a_mask_that_fills_the_image_has_no_boundary():
    full = np.ones((40, 50), np.uint16)
    scores = score(full, TWO)
    assert np.isnan(scores.boundary_precision)
    assert scores.boundary_recall == 0
    assert scores.boundary_f == 0


@pytest.mark.parametrize("seed", range(12))
def test_boundaries_agree_as_in_the_whole_image_wherever_the_objects_lie(seed):
    rng = np.random.default_rng(seed)

    def box():
        """Of at least 3 pixels on a side; every other one begins or ends at an edge of the image."""
        (v0, v1), (u0, u1) = (np.sort(rng.choice(np.arange(0, size + 1, 3), 2, False)) for size in (39, 48))
        return boxes((v0 if seed % 4 else 0, v1, u0, 50 if seed % 4 == 2 else u1))

    prediction, true = box(), box()
    of_prediction, of_true = boundary_map(prediction > 0), boundary_map(true > 0)
    radius = tolerance(true.shape)
    scores = score(prediction, true)
    assert scores.boundary_precision == np.mean(dilate(of_true, radius)[of_prediction])
    assert scores.boundary_recall == np.mean(dilate(of_prediction, radius)[of_true])


def test_objects_without_overlap_are_paired_in_the_order_of_their_labels():
    # No pair overlaps, all are tied. In order of label each object lies 1 px beside its partner.
    true = boxes((5, 6, 5, 15), (25, 26, 25, 40))
    beside = boxes((6, 7, 5, 15), (26, 27, 25, 40))
    swapped = np.array([0, 2, 1], np.uint16)[beside]
    assert score(beside, true).boundary_precision == 1
    assert score(swapped, true).boundary_precision == 0


def test_a_tie_is_broken_as_by_the_classic_munkres_procedure():
    # True 2 is predicted 1. True 1 overlaps nothing; predicted 2 and 3 are both free, and the classic
    # procedure takes 3, which lies 1 px beside it. (Other solvers take 2, far away.)
    true = boxes((5, 6, 5, 15), (25, 35, 25, 40))
    prediction = boxes((25, 35, 25, 40), (15, 16, 40, 50), (6, 7, 5, 15))
    assert score(prediction, true).boundary_recall == 1


def test_mean_over_images_is_unweighted_and_not_the_f_of_the_means():
    images = [score(NOTHING, TWO), score(TWO, TWO)]
    mean = mean_scores(images)
    assert mean.overlap_precision == 1
    assert mean.overlap_recall == 0.5
    assert mean.overlap_f == 0.5


@pytest.mark.parametrize(
    ("prediction", "message"),
    [
        (np.zeros((40, 49), np.uint16), "49x40"),
        (np.zeros((40, 50), np.float32), "integers"),
        (np.zeros((40, 50, 3), np.uint16), "label image"),
        (np.full((40, 50), -1), "from 0 up"),
        (np.zeros((0, 50), np.uint16), r"its shape is \(0, 50\)"),
    ],
)
def test_what_is_no_label_image_of_the_same_size_is_refused(prediction, message):
    with pytest.raises(ValueError, match=message):
        score(prediction, TWO)


def test_true_objects_are_numbered_as_what_they_are_matched_with_and_others_after_those():
    truth = np.zeros((4, 12), np.uint16)
    truth[:, :4], truth[:, 4:8], truth[:, 8:10] = 1, 2, 5
    found = np.zeros_like(truth)
    # 7 lies on most of 1 and a little of 2, 1 on the rest of 2; nothing on 5.
    found[:, :5], found[:, 5:8] = 7, 1
    alike = numbered_alike(truth, found)
    assert alike[0].tolist() == [7] * 4 + [1] * 4 + [10] * 2 + [0] * 2
    assert numbered_alike(truth, np.zeros_like(truth))[0].tolist() == [1] * 4 + [2] * 4 + [3] * 2 + [0] * 2
    assert not numbered_alike(np.zeros_like(truth), found).any()
