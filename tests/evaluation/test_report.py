from dataclasses import replace

import cv2
import pytest

from riseg_drake.evaluation.disturbance import Disturbance, ObjectMotion
from riseg_drake.evaluation.figure import figure_png
from riseg_drake.evaluation.in_motion import InMotion
from riseg_drake.evaluation.published import PUBLISHED
from riseg_drake.evaluation.report import report_text
from riseg_drake.evaluation.scene_result import SceneResult
from riseg_drake.evaluation.step_means import EMPTY_PREDICTION


def scores(*overlap_f):
    return [replace(EMPTY_PREDICTION, overlap_f=f, found_share=f, objects_true=4.0) for f in overlap_f]


GOOD = SceneResult(
    name="scene_000",
    seed=100,
    failure="",
    end="no push is left",
    scores=scores(0.0, 0.5, 0.9),
    disturbances=[
        Disturbance("a", {"a": ObjectMotion(0.02, 0, 1.0), "b": ObjectMotion(0.001, 0, 0)}),
        Disturbance("a", {"a": ObjectMotion(0.01, 0, 1.5), "b": ObjectMotion(0.003, 0, 0)}),
    ],
    ended="nothing_valid",
    unsettled_area_m2=0.0040,
    in_motion=[InMotion(10, 0.8, 0.9), None],
    baselines={"depth clusters": scores(0.7, 0.7, 0.6)},
    ablation={"no memory": scores(0.0, 0.5, 0.8)},
)
FAILED = SceneResult(name="scene_001", seed=101, failure="the table broke", end="the table broke")
BETTER = replace(
    GOOD,
    name="scene_002",
    seed=102,
    unsettled_area_m2=0.0010,
    in_motion=[InMotion(30, 0.6, 0.7), InMotion(10, 1.0, 0.9)],
    ablation={"no memory": scores(0.0, 0.5, 0.6)},
)


@pytest.fixture(scope="module")
def text():
    return report_text([GOOD, FAILED, BETTER], {"scenes": 3}, last_step=3)


def rows(text, first):
    """The figures of all table rows that begin with a cell."""
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in text.splitlines() if "|" in line]
    return [row[1:] for row in cells if row[0] == first]


def test_our_rows_are_the_means_of_every_step(text):
    ours = rows(text, "**riseg_drake**")[:4]
    assert [(row[0], row[3], row[7]) for row in ours] == [
        ("0", "0.0", "0.0"),
        ("1", "33.3", "33.3"),
        ("2", "60.0", "60.0"),
        ("3", "60.0", "60.0"),
    ]
    assert [row[3] for row in rows(text, "depth clusters")] == ["46.7", "46.7", "40.0", "40.0"]


@pytest.mark.parametrize("method", PUBLISHED)
def test_the_papers_rows_stand_beside_them(text, method):
    assert [row[0] for row in rows(text, f"{method} (paper)")] == list("012345")


def test_a_scene_that_failed_is_named_with_its_seed_and_reason(text):
    assert "1 of 3 scenes failed" in text
    assert "scene_001, seed 101: the table broke" in text


def test_the_worst_scene_comes_first(text):
    assert text.index("| scene_001 |") < text.index("[scene_000]")


def test_what_the_pushes_did_is_in_the_report(text):
    assert rows(text, "1")[1] == ["2", "2.00", "1.00", "1.0", "0", "0", "0"]
    assert rows(text, "3")[1] == ["0", "–", "–", "–", "0", "0", "0"]
    assert rows(text, "**all**")[1] == ["4", "1.50", "2.00", "1.5", "0", "0", "0"]


def test_masks_while_things_move_are_in_the_report(text):
    assert rows(text, "1")[0] == ["2", "40", "70.0", "80.0"]
    assert rows(text, "2")[0] == ["1", "10", "100.0", "90.0"]
    assert rows(text, "3")[0] == ["0", "0", "–", "–"]
    # Scenes weigh alike: 80, and (30 * 60 + 10 * 100) / 40 = 70.
    assert rows(text, "**all**")[0] == ["2", "50", "75.0", "82.5"]
    assert rows(text, "[scene_002](scene_002/step_2/overlay.png)")[0][-2:] == ["70.0", "no push is left"]


def test_how_the_runs_ended_is_counted_with_what_was_left(text):
    assert rows(text, "nothing_valid") == [["2", "25.0", "40.0"]]


def test_a_switch_is_compared_scene_by_scene():
    text = report_text([GOOD, BETTER], {}, last_step=2)
    # Differences of -10 and -30: mean -20, standard error 10.
    assert rows(text, "no memory")[0][-1] == "-20.0 ± 10.0"
    assert "one switch at a time" not in report_text([FAILED], {}, last_step=2)


def test_the_figure_is_a_picture(tmp_path):
    (tmp_path / "figure.png").write_bytes(figure_png([GOOD, FAILED, BETTER], 5))
    height, width, _ = cv2.imread(str(tmp_path / "figure.png")).shape
    assert min(height, width) > 500
