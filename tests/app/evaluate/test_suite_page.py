"""The page of a suite: the worst scene of each kind, and the tables of its report."""

import re
from dataclasses import replace

import pytest

from riseg_drake.app.evaluate.suite_page import suite_page
from riseg_drake.evaluation.suite_report import KindResult, kinds_table, moved_table, scenes_table
from tests.app.evaluate.test_page import scene


@pytest.fixture
def kinds(tmp_path):
    """Two kinds: of the first the second scene is the worse one, of the other the only one failed."""
    early = [scene(tmp_path / "1_early", number, share)[0] for number, share in ((0, 1.0), (1, 0.5), (2, 0.75))]
    (late, _) = scene(tmp_path / "2_late", 7, 1.0)
    failed = replace(late, scores=(), failure="the <table> broke")
    return [KindResult("early", "1_early", early, 1), KindResult("late", "2_late", [failed], 2)]


def page(kinds, tmp_path):
    return suite_page(kinds, tmp_path, {"scenes of each kind": "3, seeds 0 to 2"})


def test_of_each_kind_the_worst_scene_is_shown_and_what_failed_is_said(kinds, tmp_path):
    html = page(kinds, tmp_path)
    assert "<h1>A suite of 4 scenes of 2 kinds</h1>" in html
    assert "3, seeds 0 to 2" in html
    assert re.findall(r"<h2>(\w+): seed (\d+)</h2>", html) == [("early", "1")]
    assert "Overlap F 66.7 % after 1 interaction; everything is found." in html  # 2 * 1 * 0.5 / 1.5
    assert html.count("data:image/jpeg") == 3  # colour, masks and truth
    assert "late, scene_007 (seed 7) failed: the &lt;table&gt; broke" in html


def test_a_scene_whose_pictures_are_damaged_gives_way_to_the_next(kinds, tmp_path):
    for file in (tmp_path / "1_early" / "scene_001").glob("step_1/*.png"):
        file.write_bytes(b"cut off")
    assert re.findall(r"<h2>(\w+): seed (\d+)</h2>", page(kinds, tmp_path)) == [("early", "2")]


def test_all_figures_of_the_report_are_in_its_tables(kinds, tmp_path):
    html = page(kinds, tmp_path)
    rows = [re.findall(r"<td>(.*?)</td>", row) for row in re.findall(r"<tr>(.*?)</tr>", html) if "<td>" in row]
    told = [*kinds_table(kinds).rows, *moved_table(kinds).rows, *scenes_table(kinds).rows]
    assert len(told) == 2 + 2 + 4
    escaped = [[cell.replace("<", "&lt;").replace(">", "&gt;") for cell in row] for row in told]
    assert rows == escaped
