import io
import re
from types import SimpleNamespace

import pytest
from pydrake.geometry import Box, Meshcat, Rgba
from rich.console import Console

from riseg_drake.app import meshcat_replay
from riseg_drake.app.meshcat_replay import Replay, replay, stay, with_marks


def test_an_interaction_is_marked_where_it_began():
    kept = Replay(start=1.7e9)
    for step, time in ((0, 1.7e9), (1, 1.7e9 + 2.5), (1, 1.7e9 + 3.0), (2, 1.7e9 + 9.0)):
        kept.mark(step, time)
    assert kept.marks == {1: 2.5, 2: 9.0}


def test_the_slider_stands_at_the_end_of_the_page_with_its_marks():
    page = with_marks("<script>'</body>'</script><p></p></body></html>", {2: 9.0, 1: 2.5})
    assert page.startswith("<script>'</body>'</script><p></p><style>")
    assert page.endswith("</body></html>")
    assert 'const marks = [["1", 2.5], ["2", 9.0]];' in page


def test_the_slider_reaches_the_end_whatever_the_last_digits_of_its_time():
    (slider,) = re.findall(r'<input type="range"[^>]*>', with_marks("<body></body>", {}))
    assert 'step="any"' in slider


def interrupted(meshcat, file):
    """A replay of two seconds at wall time, and Ctrl-C."""
    with replay(meshcat, file, start=1.7e9) as kept:
        meshcat.SetObject("/box", Box(1, 1, 1), Rgba(1, 0, 0))
        meshcat.SetProperty("/box", "visible", False, 1.7e9 + 2.0)
        kept.mark(1, 1.7e9 + 1.5)
        raise KeyboardInterrupt


def test_a_replay_at_wall_time_is_whole_however_it_stops(tmp_path):
    meshcat, file = Meshcat(), tmp_path / "replay.html"
    with pytest.raises(KeyboardInterrupt):
        interrupted(meshcat, file)
    assert '[["1", 1.5]]' in file.read_text()
    assert meshcat.get_mutable_recording().frame(1.7e9 + 2.0) == 2 * meshcat_replay.FRAME_RATE


def stayed(monkeypatch, terminal, wait):
    """What is printed, and how often somebody is waited for."""
    out, waited = io.StringIO(), []
    monkeypatch.setattr(meshcat_replay.sys, "stdin", SimpleNamespace(isatty=lambda: terminal))
    browser = SimpleNamespace(web_url=lambda: "http://localhost:7000")
    stay(browser, "out/x/replay.html", Console(file=out, width=80), wait, lambda: waited.append(1))
    return out.getvalue().strip().split("\n"), len(waited)


def test_at_a_terminal_the_view_stays_and_the_last_line_names_the_replay(monkeypatch):
    lines, waited = stayed(monkeypatch, terminal=True, wait=True)
    assert lines == ["the view stays at http://localhost:7000 until Enter", "open out/x/replay.html"]
    assert waited == 1


@pytest.mark.parametrize(("terminal", "wait"), [(False, True), (True, False), (False, False)])
def test_nobody_is_waited_for_without_a_terminal_or_by_request(monkeypatch, terminal, wait):
    assert stayed(monkeypatch, terminal, wait) == (["open out/x/replay.html"], 0)
