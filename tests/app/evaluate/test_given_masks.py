"""Masks of other methods: read beside the evaluation's own images."""

import numpy as np
import pytest

from riseg_drake.app.evaluate.command import scene_tasks
from riseg_drake.app.evaluate.given_masks import parse_given_masks, with_given_masks
from riseg_drake.app.scenario import Scenario
from riseg_drake.evaluation.label_folders import LabelFolderError
from riseg_drake.evaluation.scene_result import SceneResult, scores_by_method
from riseg_drake.evaluation.scores import score
from riseg_drake.recording.whole_file import write_png

TRUTH = np.zeros((48, 64), np.uint16)
TRUTH[10:30, 10:30] = 1


@pytest.fixture
def evaluation(tmp_path):
    """A task and a result of two steps, whose truth is on disk, and a folder for another method's masks."""
    (task,) = scene_tasks(Scenario(), "simulation", tmp_path / "ours", scenes=1, seed=0)
    for i in range(2):
        (task.folder / f"step_{i}").mkdir(parents=True)
        write_png(task.folder / f"step_{i}" / "ground_truth.png", TRUTH)
        (tmp_path / "theirs" / "scene_000" / f"step_{i}").mkdir(parents=True)
        write_png(tmp_path / "theirs" / "scene_000" / f"step_{i}" / "mask.png", TRUTH * (3 * i))
    ours = [score(np.zeros_like(TRUTH), TRUTH)] * 2
    return task, SceneResult("scene_000", 0, "", "done", scores=ours), tmp_path / "theirs"


def test_another_methods_masks_get_their_row(evaluation):
    task, result, theirs = evaluation
    (result,) = with_given_masks([result], [task], {"MSMFormer": theirs})
    assert list(scores_by_method([result])) == ["riseg_drake", "MSMFormer"]
    assert [each.overlap_f for each in result.baselines["MSMFormer"]] == [0.0, 1.0]


def test_a_mask_that_is_missing_is_named_with_the_image_that_it_should_be_of(evaluation):
    task, result, theirs = evaluation
    (theirs / "scene_000" / "step_1" / "mask.png").unlink()
    with pytest.raises(LabelFolderError, match=r"scene_000/step_1/mask.png is missing; .*step_1/color.png"):
        with_given_masks([result], [task], {"MSMFormer": theirs})


def test_a_mask_of_another_size_is_refused(evaluation):
    task, result, theirs = evaluation
    write_png(theirs / "scene_000" / "step_1" / "mask.png", TRUTH[:40])
    with pytest.raises(LabelFolderError, match="has 64x40 pixels, not 64x48"):
        with_given_masks([result], [task], {"MSMFormer": theirs})


@pytest.mark.parametrize(
    ("given", "says"),
    [
        (["theirs"], "give NAME=DIR"),
        (["=theirs"], "give NAME=DIR"),
        (["SAM=."], "already"),
        (["A=.", "A=."], "already"),
        (["A=nowhere"], "nowhere is not a folder"),
    ],
)
def test_a_mistake_is_said_in_one_line(given, says):
    with pytest.raises(LabelFolderError, match=says):
        parse_given_masks(given, taken=("SAM",))
