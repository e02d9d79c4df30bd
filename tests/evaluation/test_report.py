from dataclasses import replace

import cv2
import pytest

from riseg_drake.evaluation.disturbance import Disturbance, DisturbanceFigures, ObjectMotion
from riseg_drake.evaluation.figure import figure_png
from riseg_drake.evaluation.figure_table import markdown_table, percent, score_cells, table_figures
from riseg_drake.evaluation.in_motion import InMotion
from riseg_drake.evaluation.published import PUBLISHED
from riseg_drake.evaluation.report import disturbance_cells, ending_counts, report_text
from riseg_drake.evaluation.scene_result import SceneResult
from riseg_drake.evaluation.scores import Scores
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
    ablation_in_motion={"no memory": [InMotion(10, 0.6, 0.7), None]},
)
FAILED = SceneResult(name="scene_001", seed=101, failure="the table broke", end="the table broke")
BETTER = replace(
    GOOD,
    name="scene_002",
    seed=102,
    unsettled_area_m2=0.0010,
    in_motion=[InMotion(30, 0.6, 0.7), InMotion(10, 1.0, 0.9)],
    ablation={"no memory": scores(0.0, 0.5, 0.6)},
    ablation_in_motion={"no memory": [InMotion(30, 0.2, 0.7), InMotion(10, 0.6, 0.9)]},
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
    assert rows(text, "no memory")[0][7] == "-20.0 ± 10.0"
    # In motion 60 and (30 * 20 + 10 * 60) / 40 = 30, where ours have 80 and 70: -20 and -40.
    assert rows(text, "no memory")[0][8:] == ["45.0", "-30.0 ± 10.0"]
    assert rows(text.split("## What each part is worth")[1], "**riseg_drake**")[0][7:] == ["", "75.0", ""]
    assert "What each part is worth" not in report_text([FAILED], {}, last_step=2)


def test_a_switch_under_which_nothing_moved_in_sight_is_not_compared_in_motion():
    still = replace(GOOD, ablation_in_motion={})
    assert rows(report_text([still], {}, last_step=2), "no memory")[0][7:] == ["-10.0", "–", "–"]
    # A scene where it is unknown is left out of the mean and of the difference.
    assert rows(report_text([still, BETTER], {}, last_step=2), "no memory")[0][8:] == ["30.0", "-40.0"]


def test_a_table_has_its_figures_to_the_right_and_no_cell_ends_a_row():
    assert markdown_table(("a", "b", "c"), [("1", "2|3", "|"), ("4", "5", "6")]) == (
        "| a | b | c |\n| --- | ---: | ---: |\n| 1 | 2/3 | / |\n| 4 | 5 | 6 |\n"
    )


def test_the_seven_figures_are_those_of_the_papers_table_and_figure():
    each = Scores(0.01, 0.02, 0.03, 0.04, 0.05, 0.06, 0.07, 0.08, 0.09, 0.1234)
    assert table_figures(each) == (0.01, 0.02, 0.03, 0.04, 0.05, 0.06, 0.1234)
    assert score_cells(each) == ["1.0", "2.0", "3.0", "4.0", "5.0", "6.0", "12.3"]
    assert percent(float("nan")) == "–"


def test_what_was_moved_is_in_centimetres_millimetres_and_degrees():
    figures = DisturbanceFigures(7, 0.01234, 0.0012345, 12.34, 4, 5, 6)
    assert disturbance_cells(figures) == ["7", "1.23", "1.23", "12.3", "4", "5", "6"]


def test_the_settings_come_first_and_thresholds_are_said(text):
    assert text.startswith("# Evaluation\n\n- scenes: 3\n")
    for said in (
        "Overlap F above\n75%.",
        "more than 20 degrees count",
        "more than\n1 cm without",
        "by 1 cm or",
    ):
        assert said in text
    assert "**" not in report_text([GOOD], {}, 2).split("## Scores")[0]


def test_how_many_scenes_got_how_far_is_said(text):
    assert "over the 3 scenes" in text
    assert "Of the 3 scenes 2 reached 1, 2 reached 2, 0 reached 3." in text


def test_a_scenes_row_has_its_last_figures(text):
    assert rows(text, "[scene_000](scene_000/step_2/overlay.png)") == [
        ["100", "2", "90.0", "0.0", "0 of 4", "80.0", "no push is left"]
    ]
    assert rows(text, "scene_001") == [["101", "0", "0.0", "0.0", "–", "–", "the table broke"]]


def test_ends_are_counted_without_failures_the_most_frequent_first():
    late = replace(GOOD, ended="time")
    scenes = [late, GOOD, FAILED, BETTER, replace(GOOD, ended=""), replace(FAILED, ended="time")]
    assert list(ending_counts(scenes).items()) == [("nothing_valid", 2), ("time", 1), ("otherwise", 1)]


def test_what_was_left_is_over_the_runs_in_which_it_is_known():
    unknown = replace(GOOD, unsettled_area_m2=float("nan"))
    scenes = [GOOD, unknown, BETTER, replace(unknown, ended="")]
    scenes += [replace(GOOD, failure="broken", unsettled_area_m2=1.0)]
    text = report_text(scenes, {}, 2)
    assert rows(text, "nothing_valid") == [["3", "25.0", "40.0"]]
    assert rows(text, "otherwise") == [["1", "–", "–"]]


def test_ours_and_each_switch_are_in_percent_after_the_last_interaction():
    broken = replace(GOOD, ablation_failures={"no memory": "out of memory"})
    text = report_text([broken], {}, last_step=2)
    ours = rows(text.split("What each part is worth")[1], "**riseg_drake**")
    assert ours == [["100.0", "0.0", "90.0", "100.0", "0.0", "0.0", "90.0", "", "80.0", ""]]
    # One scene has no standard error.
    assert rows(text, "no memory") == [
        ["100.0", "0.0", "80.0", "100.0", "0.0", "0.0", "80.0", "-10.0", "60.0", "-20.0"]
    ]
    assert "scene_000: no memory failed on the way and keeps what it had: out of memory\n" in text


def test_the_figure_is_a_picture(tmp_path):
    (tmp_path / "figure.png").write_bytes(figure_png([GOOD, FAILED, BETTER], 5))
    height, width, _ = cv2.imread(str(tmp_path / "figure.png")).shape
    assert min(height, width) > 500
