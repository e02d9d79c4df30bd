"""Outlines: a good model sharpens them, a bad one harms nothing, and ids stay."""

import cv2
import numpy as np
import pytest

from riseg_drake.evaluation.scores import score
from riseg_drake.geometry.rgbd import Frame
from riseg_drake.learned.outlines import OutlineParameters, refine_outlines
from riseg_drake.learned.prompts import Answer
from tests.learned.standins import NONSENSE, Nonsense, Perfect, answer
from tests.segmentation.drawn_scene import DrawnScene, looking_down, planar

PARAMETERS = OutlineParameters()


@pytest.fixture(scope="module")
def seen() -> tuple[Frame, np.ndarray]:
    """Three boxes, two of which touch, and their true labels."""
    scene = DrawnScene([(0.06, 0.06, 0.05), (0.06, 0.06, 0.02), (0.05, 0.08, 0.03)])
    poses = [planar(-0.05, 0.0, 0.2), planar(0.015, 0.005, 0.1), planar(0.1, 0.0)]
    return scene.frame(0, looking_down(), poses, np.random.default_rng(0))


@pytest.fixture(scope="module")
def found(seen) -> np.ndarray:
    """What motion might have found: ids of its own, outlines off by some pixels."""
    _, labels = seen
    mask = np.zeros_like(labels)
    for number, object_id in ((1, 7), (2, 4), (3, 9)):
        blob = cv2.warpAffine(
            (labels == number).astype(np.uint8), np.float32([[1, 0, 3], [0, 1, -2]]), labels.shape[::-1]
        )
        mask[cv2.erode(blob, np.ones((3, 3), np.uint8)) > 0] = object_id
    return mask


def test_a_perfect_model_raises_the_boundary_score(seen, found):
    frame, labels = seen
    refined = refine_outlines(frame, found, Perfect(labels), PARAMETERS)
    before, after = score(found, labels), score(refined, labels)
    assert before.boundary_f < 0.8
    assert after.boundary_f > 0.999
    assert after.overlap_f > 0.999


@pytest.mark.parametrize("kind", NONSENSE)
def test_a_model_that_answers_nonsense_harms_nothing(seen, found, kind):
    frame, _ = seen
    np.testing.assert_array_equal(refine_outlines(frame, found, Nonsense(NONSENSE[kind]), PARAMETERS), found)


def test_ids_stay_with_their_objects(seen, found):
    frame, labels = seen
    refined = refine_outlines(frame, found, Perfect(labels), PARAMETERS)
    for number, object_id in ((1, 7), (2, 4), (3, 9)):
        np.testing.assert_array_equal(refined == object_id, labels == number)


def test_nonsense_about_one_object_costs_no_other_its_outline(seen, found):
    frame, labels = seen
    perfect = Perfect(labels)

    def wrong_about_seven(color, prompts):
        for prompt, true in zip(prompts, perfect(color, prompts), strict=True):
            u, v = prompt.points[0].astype(int)
            yield answer(np.ones(labels.shape, bool)) if found[v, u] == 7 else true

    refined = refine_outlines(frame, found, wrong_about_seven, PARAMETERS)
    np.testing.assert_array_equal(refined == 9, labels == 3)
    assert (refined == 7).sum() > 0.9 * (found == 7).sum()


def test_an_empty_mask_asks_nothing(seen):
    frame, labels = seen

    def never(color, prompts):
        raise AssertionError

    assert not refine_outlines(frame, np.zeros_like(labels), never, PARAMETERS).any()


def both(seen, found):
    """A model that gives the objects 7 and 4, which stand at different heights, all that both have."""
    _, labels = seen
    union = (labels == 1) | (labels == 2)

    def greedy(color, prompts):
        for prompt in prompts:
            u, v = prompt.points[0].astype(int)
            mine = found == found[v, u]
            grown = cv2.dilate(mine.astype(np.uint8), np.ones((25, 25), np.uint8)) > 0
            yield answer(grown & union if found[v, u] in (7, 4) else mine)

    return greedy


def test_a_contested_pixel_goes_to_the_object_at_its_depth(seen, found):
    frame, labels = seen
    refined = refine_outlines(frame, found, both(seen, found), PARAMETERS)
    contested = (cv2.dilate((found == 7).astype(np.uint8), np.ones((25, 25), np.uint8)) > 0) & (
        cv2.dilate((found == 4).astype(np.uint8), np.ones((25, 25), np.uint8)) > 0
    )
    tall, low = contested & (labels == 1), contested & (labels == 2)
    assert tall.sum() > 50
    assert low.sum() > 50
    top = tall & (np.abs(frame.depth - 0.40) < 0.003)  # faces seen from the side have the depth of neither
    assert (refined[top] == 7).mean() > 0.95
    assert (refined[low & (np.abs(frame.depth - 0.43) < 0.003)] == 4).mean() > 0.95


def test_at_equal_depth_the_better_score_decides(seen):
    frame, _ = seen
    flat = Frame(0, 0.0, frame.intrinsics, frame.color, np.full_like(frame.depth, 0.4), frame.X_WC, frame.robot)
    mask = np.zeros(frame.intrinsics.shape, np.uint16)
    mask[50:90, 50:90], mask[50:90, 90:130] = 1, 2
    claims = {1: (np.s_[50:90, 50:100], 0.7), 2: (np.s_[50:90, 80:130], 0.9)}

    def overlapping(color, prompts):
        for prompt in prompts:
            u, v = prompt.points[0].astype(int)
            region, sure = claims[int(mask[v, u])]
            claim = np.zeros(mask.shape, bool)
            claim[region] = True
            yield Answer(claim[None], np.array([sure]), np.array([1.0]))

    refined = refine_outlines(flat, mask, overlapping, PARAMETERS)
    assert (refined[50:90, 80:100] == 2).all()
    assert (refined[50:90, 50:80] == 1).all()


def test_an_object_whose_pixels_others_claim_keeps_its_own(seen):
    frame, _ = seen
    flat = Frame(0, 0.0, frame.intrinsics, frame.color, np.full_like(frame.depth, 0.4), frame.X_WC, frame.robot)
    mask = np.zeros(frame.intrinsics.shape, np.uint16)
    mask[40:140, 40:140] = 1
    mask[80:90, 140:160] = 2
    whole = np.zeros(mask.shape, bool)
    whole[40:140, 40:160] = True

    def swallowing(color, prompts):
        for prompt, sure in zip(prompts, (0.99, 0.5), strict=True):
            u, v = prompt.points[0].astype(int)
            mine = mask == mask[v, u]
            yield Answer((whole if mask[v, u] == 1 else mine)[None], np.array([sure]), np.array([1.0]))

    refined = refine_outlines(flat, mask, swallowing, PARAMETERS)
    np.testing.assert_array_equal(refined == 2, mask == 2)
    assert (refined == 1).sum() > (mask == 1).sum()


def test_the_robot_is_no_part_of_an_object(seen, found):
    frame, labels = seen
    robot = np.zeros_like(frame.robot)
    robot[:, :130] = True
    hidden = Frame(0, 0.0, frame.intrinsics, frame.color, frame.depth, frame.X_WC, robot)
    mask = np.where(robot, 0, found).astype(np.uint16)
    refined = refine_outlines(hidden, mask, Perfect(labels), PARAMETERS)
    assert not refined[robot].any()
