"""The figure: what is drawn where."""

from dataclasses import replace
from io import BytesIO

import cv2
import numpy as np
import pytest
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure

from riseg_drake.evaluation import figure as module
from riseg_drake.evaluation.figure import figure_png
from riseg_drake.evaluation.published import PUBLISHED
from riseg_drake.evaluation.scene_result import SceneResult
from riseg_drake.evaluation.step_means import EMPTY_PREDICTION

pytestmark = pytest.mark.renders

OURS = "riseg_drake"


def scores(*shares):
    return [replace(EMPTY_PREDICTION, found_share=share) for share in shares]


def scene(number, ours, **baselines):
    return SceneResult(
        f"scene_{number:03d}",
        number,
        "",
        "",
        scores=scores(*ours),
        baselines={name: scores(*shares) for name, shares in baselines.items()},
    )


SCENES = [
    scene(0, (0.0, 0.5, 0.75), graph=(0.25, 0.5), depth=(0.5, 0.25)),
    scene(1, (0.0, 0.5), graph=(0.75, 0.5), depth=(0.25, 0.25)),
    scene(2, (0.0, 0.75, 1.0), graph=(0.5, 0.5), depth=(1.0, 1.0)),
    scene(3, (0.0, 0.25, 0.75, 1.0), graph=(0.5, 0.5), depth=(0.5, 0.5)),
]


@pytest.fixture(scope="module")
def drawn():
    """The figure of these scenes and 3 interactions, its one set of axes, and the file."""
    made = []

    def figure(*arguments, **others):
        made.append(Figure(*arguments, **others))
        return made[-1]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "Figure", figure)
        png = figure_png(SCENES, 3)
    (axes,) = made[0].axes
    return made[0], axes, png


def line(axes, label):
    (found,) = (each for each in axes.lines if each.get_label() == label)
    return found


def test_the_file_is_a_png_of_the_figures_size(drawn):
    image = cv2.imdecode(np.frombuffer(BytesIO(drawn[2]).getvalue(), np.uint8), cv2.IMREAD_UNCHANGED)
    assert image.shape[:2] == (675, 1125)  # 7.5 x 4.5 inches of 150 dots


@pytest.mark.parametrize("method", PUBLISHED)
def test_the_papers_lines_are_its_shares_in_percent(drawn, method):
    paper = line(drawn[1], f"{method} (paper)")
    np.testing.assert_array_equal(paper.get_xdata(), range(6))
    np.testing.assert_array_equal(paper.get_ydata(), [row.found_share for row in PUBLISHED[method]])


def test_the_papers_lines_can_be_told_apart_without_colour(drawn):
    styles = [line(drawn[1], f"{method} (paper)").get_linestyle() for method in PUBLISHED]
    assert len(set(styles)) == 4


def test_our_line_is_the_mean_over_scenes_which_keep_their_last_state(drawn):
    ours = line(drawn[1], OURS)
    np.testing.assert_array_equal(ours.get_xdata(), [0, 1, 2, 3])
    np.testing.assert_allclose(ours.get_ydata(), [0, 50, 75, 81.25])


@pytest.mark.parametrize(("name", "means"), [("graph", [50, 50, 50, 50]), ("depth", [56.25, 50, 50, 50])])
def test_a_baselines_line_is_its_mean(drawn, name, means):
    baseline = line(drawn[1], name)
    np.testing.assert_array_equal(baseline.get_xdata(), [0, 1, 2, 3])
    np.testing.assert_allclose(baseline.get_ydata(), means)


def test_every_method_is_drawn_once_and_in_a_colour_of_its_own(drawn):
    labels = [each.get_label() for each in drawn[1].lines]
    assert sorted(labels) == sorted([OURS, "graph", "depth", *(f"{method} (paper)" for method in PUBLISHED)])
    colors = {to_rgba(line(drawn[1], name).get_color()) for name in (OURS, "graph", "depth")}
    assert len(colors) == 3
    widths = {each.get_label(): each.get_linewidth() for each in drawn[1].lines}
    assert all(width < widths[OURS] / 1.5 for label, width in widths.items() if label != OURS)


def test_the_first_baselines_colour_is_the_first_and_after_six_they_begin_anew(monkeypatch):
    made = []
    monkeypatch.setattr(module, "Figure", lambda **others: made.append(Figure(**others)) or made[-1])
    figure_png([scene(0, (0.0, 1.0), **{f"m{k}": (0.5,) for k in range(7)})], 1)
    colors = [line(made[0].axes[0], f"m{k}").get_color() for k in range(7)]
    assert colors[0] == colors[6] == "#0072b2"
    assert len(set(colors)) == 6


def test_the_band_is_one_standard_deviation_on_both_sides_within_0_and_100(drawn):
    (band, *_) = drawn[1].collections
    assert band.get_label() == "± 1 s.d. over scenes"
    corners = band.get_paths()[0].vertices
    # In percent: 0 thrice; 50, 50, 75, 25; 75, 50, 100, 75; 75, 50, 100, 100. Of a sample: over n - 1 = 3.
    spreads = [0, np.sqrt(1250 / 3), np.sqrt(1250 / 3), np.sqrt(1718.75 / 3)]
    for x, mean, spread in zip(range(4), (0, 50, 75, 81.25), spreads, strict=True):
        y = corners[corners[:, 0] == x, 1]
        assert (y.min(), y.max()) == pytest.approx((mean - spread, min(mean + spread, 100)))


def test_a_dot_stands_for_the_scenes_that_had_a_share_and_its_area_for_how_many(drawn):
    _, *dots = drawn[1].collections
    offsets = [each.get_offsets().tolist() for each in dots]
    assert offsets == [
        [[0, 0]],
        [[1, 25], [1, 50], [1, 75]],
        [[2, 50], [2, 75], [2, 100]],
        [[3, 50], [3, 75], [3, 100]],
    ]
    of_all = dots[0].get_sizes()[0]
    assert [(each.get_sizes() / of_all).tolist() for each in dots] == [
        [1.0],
        [0.25, 0.5, 0.25],
        [0.25, 0.5, 0.25],
        [0.25, 0.25, 0.5],
    ]


def test_all_that_can_be_is_in_sight_and_the_longer_of_ours_and_the_papers_runs(drawn):
    low, high = drawn[1].get_ylim()
    assert -3 < low < 0
    assert 100 < high < 103
    assert drawn[1].get_xlim() == pytest.approx((-0.15, 5.15))


def test_more_interactions_than_the_papers_are_in_sight_too(monkeypatch):
    made = []
    monkeypatch.setattr(module, "Figure", lambda **others: made.append(Figure(**others)) or made[-1])
    figure_png([scene(0, (0.0, 1.0))], 8)
    assert made[0].axes[0].get_xlim() == pytest.approx((-0.15, 8.15))
    assert all(float(tick).is_integer() for tick in made[0].axes[0].get_xticks())


def test_the_legend_begins_with_ours(drawn):
    (legend,) = drawn[0].legends
    texts = [text.get_text() for text in legend.get_texts()]
    assert set(texts[:2]) == {OURS, "± 1 s.d. over scenes"}
    assert len(texts) == 8
    for text, handle in zip(texts, legend.legend_handles, strict=True):
        if not text.startswith("±"):
            assert handle.get_color() == line(drawn[1], text).get_color()
