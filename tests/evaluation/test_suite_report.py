"""The report of a suite: every figure in its place, worked out by hand."""

import math
from dataclasses import replace

import pytest

from riseg_drake.evaluation.disturbance import Disturbance, ObjectMotion
from riseg_drake.evaluation.in_motion import InMotion
from riseg_drake.evaluation.scene_result import SceneResult
from riseg_drake.evaluation.scores import FIGURES
from riseg_drake.evaluation.step_means import EMPTY_PREDICTION
from riseg_drake.evaluation.suite_report import KindResult, suite_figures, suite_text


def scores(*overlap_f):
    """Of these Overlap F; Boundary F is half as much, the share found a quarter."""
    return [
        replace(
            EMPTY_PREDICTION,
            overlap_f=f,
            boundary_f=f / 2,
            found_share=f / 4,
            objects_found=4 * f,
            objects_true=5.0,
        )
        for f in overlap_f
    ]


LONG = SceneResult(
    name="scene_000",
    seed=100,
    failure="",
    end="no push is left",
    ended="nothing_valid",
    scores=scores(0.0, 0.5, 0.75),
    disturbances=[Disturbance("a", {"a": ObjectMotion(0.02, 0, 1.5), "b": ObjectMotion(0.003, 0, 0)})],
    in_motion=[InMotion(10, 0.8, 0.9), None],
    baselines={"depth clusters": scores(0.6, 0.4, 0.3)},
)
SHORT = replace(
    LONG,
    name="scene_001",
    seed=101,
    end="nothing is left",
    ended="nothing_left",
    scores=scores(0.0, 0.25),
    in_motion=[InMotion(30, 0.6, 0.7)],
    baselines={"depth clusters": scores(0.2, 0.1), "graph": scores(1.0, 0.5)},
)
BROKEN = SceneResult("scene_000", 7, failure="the table broke", end="it ended", ended="time")
TOYS = KindResult("toys", "02_toys", [LONG, SHORT, replace(LONG, name="scene_002", ended="")], 2)
PILE = KindResult("pile", "05_pile", [BROKEN], 3)


def table(text, number):
    """The cells of the report's tables, row by row, without the line below the heading."""
    tables, lines = [], text.splitlines()
    for k, line in enumerate(lines):
        if line.startswith("|") and not (k and lines[k - 1].startswith("|")):
            tables.append([])
        if line.startswith("|") and "---" not in line:
            tables[-1].append([cell.strip() for cell in line.strip("|").split("|")])
    return tables[number]


@pytest.fixture(scope="module")
def text():
    return suite_text([TOYS, PILE], {"scenes a kind": 3, "seed": 7})


def test_its_settings_come_first(text):
    assert text.startswith("# A suite of scenes\n\n- scenes a kind: 3\n- seed: 7\n")


def test_a_kind_has_its_means_after_the_last_interaction_beside_what_a_picture_gives(text):
    head, toys, pile = table(text, 0)
    assert head == [
        *("kind", "scenes", "interactions", "Overlap F", "Boundary F", "found %"),
        *("depth clusters, untouched", "depth clusters, last", "graph, untouched", "graph, last", "ended"),
    ]
    # Overlap F: (75 + 25 + 75) / 3; 2, 1 and 2 interactions. Of the graph two scenes are empty predictions.
    assert toys == [
        *("[toys](02_toys/report.md)", "3", "1.7 of 2", "58.3", "29.2", "14.6"),
        *("46.7", "23.3", "33.3", "16.7"),
        "1 nothing_valid; 1 nothing_left; 1 otherwise",
    ]
    assert pile == [
        *("[pile](05_pile/report.md)", "1", "0.0 of 3", "0.0", "0.0", "0.0", "0.0", "0.0", "0.0", "0.0"),
        "1 failed: the table broke",
    ]


def test_what_moved_is_beside_by_how_much(text):
    head, toys, pile = table(text, 1)
    assert head[:5] == ["kind", "in motion", "at rest after it", "interactions", "pushed object moved, mean cm"]
    # Scenes weigh alike: (80 + 60 + 80) / 3, (90 + 70 + 90) / 3.
    assert toys == ["toys", "73.3", "83.3", "3", "2.00", "3.00", "1.5", "0", "0", "0"]
    assert pile == ["pile", "–", "–", "0", "–", "–", "–", "0", "0", "0"]
    assert "what has moved by 1 cm or more" in text


def test_every_scene_is_named_with_its_picture_and_its_end(text):
    head, *rows = table(text, 2)
    assert head == ["kind", "seed", "interactions", "Overlap F", "Boundary F", "found", "end"]
    picture = "[toys](02_toys/scene_00{}/step_{}/overlay.png)"
    assert rows == [
        [picture.format(0, 2), "100", "2", "75.0", "37.5", "3 of 5", "no push is left"],
        [picture.format(1, 1), "101", "1", "25.0", "12.5", "1 of 5", "nothing is left"],
        [picture.format(2, 2), "100", "2", "75.0", "37.5", "3 of 5", "no push is left"],
        ["[pile](05_pile/scene_000/step_0/overlay.png)", "7", "0", "–", "–", "–", "the table broke"],
    ]


def test_a_switch_is_compared_over_the_scenes_of_all_kinds_each_carried_to_its_end():
    toy = replace(LONG, ablation={"no memory": scores(0.0, 0.25)})  # 25 against 75
    pile = replace(SHORT, ablation={"no memory": scores(0.0, 0.25, 0.25, 0.15)})  # 15 against 25
    text = suite_text([replace(TOYS, scenes=[toy]), replace(PILE, scenes=[pile])], {})
    (row,) = (line for line in text.splitlines() if line.startswith("| no memory "))
    assert [cell.strip() for cell in row.strip("|").split("|")][3:9:5] == ["20.0", "-30.0 ± 20.0"]
    assert "no memory" not in suite_text([TOYS, PILE], {})


def test_a_version_that_failed_is_named_with_its_kind():
    broken = replace(LONG, ablation={"no memory": ()}, ablation_failures={"no memory": "out of memory"})
    text = suite_text([replace(TOYS, scenes=[broken]), replace(PILE, scenes=[SHORT])], {})
    assert "\ntoys, scene_000: no memory failed on the way and keeps what it had: out of memory\n" in text


def test_the_most_frequent_end_comes_first():
    kind = replace(TOYS, scenes=[SHORT, LONG, BROKEN, LONG, LONG, BROKEN])
    assert list(kind.endings.items()) == [
        ("nothing_valid", 3),
        ("failed: the table broke", 2),
        ("nothing_left", 1),
    ]


def test_a_mean_is_of_ours_or_of_a_baseline_at_a_step_that_may_be_the_last():
    assert [TOYS.mean(None, i).overlap_f for i in range(3)] == pytest.approx([0, 1.25 / 3, 1.75 / 3])
    assert [TOYS.mean("depth clusters", i).overlap_f for i in (0, 1, -1)] == pytest.approx(
        [1.4 / 3, 0.9 / 3, 0.7 / 3]
    )
    assert TOYS.mean("graph", 1).overlap_f == pytest.approx(0.5 / 3)
    assert TOYS.mean("unheard of", -1).overlap_f == 0


def test_the_same_figures_are_there_as_data():
    figures = suite_figures([TOYS, PILE])
    assert list(figures) == ["02_toys", "05_pile"]
    toys, pile = figures["02_toys"], figures["05_pile"]
    assert (toys["scenes"], toys["most_interactions"]) == (3, 2)
    assert toys["interactions"] == pytest.approx(5 / 3)
    assert tuple(toys["scores"]) == FIGURES
    assert toys["scores"]["Objects F-measure"] == pytest.approx(1.75 / 3)
    baselines = {
        (name, when): of["Objects F-measure"]
        for name, each in toys["baselines"].items()
        for when, of in each.items()
    }
    assert baselines == {
        ("depth clusters", "untouched"): pytest.approx(1.4 / 3),
        ("depth clusters", "last"): pytest.approx(0.7 / 3),
        ("graph", "untouched"): pytest.approx(1 / 3),
        ("graph", "last"): pytest.approx(0.5 / 3),
    }
    assert toys["in_motion"] == {
        "frames": 50,
        "overlap_f": pytest.approx(2.2 / 3),
        "at_rest_f": pytest.approx(2.5 / 3),
    }
    assert toys["disturbance"]["pushed_mean_m"] == pytest.approx(0.02)
    assert toys["endings"] == {"nothing_valid": 1, "nothing_left": 1, "otherwise": 1}
    assert pile["in_motion"] is None
    assert pile["baselines"] == {}
    assert pile["disturbance"]["interactions"] == 0
    assert math.isnan(pile["disturbance"]["pushed_mean_m"])
