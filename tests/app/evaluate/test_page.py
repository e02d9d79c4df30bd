import re
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from riseg_drake.app.evaluate.page import MOST_VIEWS, evaluation_page
from riseg_drake.app.evaluate.scene_folder import SceneTask
from riseg_drake.app.output import RunFolder, Step
from riseg_drake.evaluation.scene_result import SceneResult
from riseg_drake.evaluation.scores import score

TRUE = np.zeros((48, 64), np.uint16)
TRUE[10:30, 10:40] = 1


def found(share):
    mask = TRUE.copy()
    mask[:, 10 + round(30 * share) :] = 0
    return mask


def scene(place: Path, number: int, share: float):
    """One scene, of whose object a share is found in the end."""
    name, steps = f"scene_{number:03d}", [score(0 * TRUE, TRUE), score(found(share), TRUE)]
    color = np.full((48, 64, 3), [200, 0, 0], np.uint8)  # red
    with RunFolder(place / name, {}) as folder:
        for i, mask in enumerate((0 * TRUE, found(share))):
            folder.write_step(
                Step(i, 0.0, color, np.ones((48, 64), np.float32), mask, 1, {1: 0.5}, ground_truth=TRUE)
            )
    task = SceneTask(place / name, number, "simulation", "")
    return SceneResult(name, number, "", "everything is found", "nothing_left", 0.0, steps), task


@pytest.fixture
def two(tmp_path):
    return [scene(tmp_path, 0, 1.0), scene(tmp_path, 1, 0.5)]


def page(scenes, **changes):
    results, tasks = zip(*scenes, strict=True)
    results = [replace(result, **changes) for result in results]
    return evaluation_page(results, tasks, {"evaluation": {"scenario": "a & b", "seed": 0}}, last_step=1)


def test_the_worst_scene_comes_first_with_its_picture_and_all_are_in_the_table(two):
    html = page(two)
    assert re.findall(r"<h2>(scene_\d+), seed (\d+)</h2>", html) == [("scene_001", "1"), ("scene_000", "0")]
    assert "Overlap F 66.7 % after 1 interaction; everything is found." in html  # 2 * 1 * 0.5 / 1.5
    assert html.count("data:image/jpeg") == 6  # colour, masks and truth of both
    assert html.count("nothing_left</td>") == 2
    assert "a &amp; b" in html


def test_colours_are_those_of_the_camera(two):
    import base64

    (first, *_) = re.findall(r"data:image/jpeg;base64,([^)]*)\)", page(two))
    picture = cv2.imdecode(np.frombuffer(base64.b64decode(first), np.uint8), cv2.IMREAD_COLOR)
    np.testing.assert_allclose(picture.mean((0, 1)), [0, 0, 200], atol=4)  # BGR


def test_a_scene_without_pictures_or_scores_is_said_and_the_page_is_there(two):
    (_, task), _ = two
    for file in task.folder.glob("step_1/*.png"):
        file.write_bytes(b"cut off")
    html = page(two, failure="its process died")
    assert re.findall(r"<h2>(scene_\d+),", html) == ["scene_001"]
    assert "What failed" in html
    assert "scene_000 (seed 0) failed: its process died" in html
    assert "<h1>Evaluation of 2 scenes</h1>" in page(two, scores=())


def test_of_many_scenes_only_the_worst_are_shown(tmp_path):
    many = [scene(tmp_path, k, 0.3 + 0.04 * k) for k in range(MOST_VIEWS + 2)]
    shown = re.findall(r"<h2>scene_(\d+),", page(many))
    assert shown == [f"{k:03d}" for k in range(MOST_VIEWS)]
