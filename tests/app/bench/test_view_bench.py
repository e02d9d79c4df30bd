"""`riseg bench --view`: with and without the view in turn, and what is made of the times."""

import json

import numpy as np
import pytest
from pydrake.geometry import Meshcat

from riseg_drake.app.bench import view
from riseg_drake.app.bench.recorded_push import push_images
from riseg_drake.app.cli import main
from riseg_drake.app.diagram import make_diagram
from riseg_drake.app.meshcat_view import MeshcatView
from riseg_drake.app.scenario import load_scenario


def test_of_each_frame_the_least_of_all_rounds_counts():
    # Without and with the view, s, of two frames in two rounds, of which each was disturbed once.
    rounds = [[[0.010, 0.500], [0.030, 0.032]], [[0.300, 0.014], [0.090, 0.041]]]
    assert view.costs(np.array(rounds)) == {
        "without_ms": pytest.approx(20.0),
        "with_ms": pytest.approx(23.0),  # (14 + 32) / 2
        "share": pytest.approx(0.15),
        "most_ms": pytest.approx(4.0),
    }


@pytest.mark.renders
def test_every_frame_is_timed_without_and_with_a_view_that_draws(small_scenario, monkeypatch):
    scenario, moments = load_scenario(small_scenario), []
    images = push_images(scenario, 1)[:9]
    put_through = view.put_through

    def told(diagram, *arguments):
        name = "with" if any(isinstance(each, MeshcatView) for each in diagram.GetSystems()) else "without"
        for context in put_through(diagram, *arguments):
            moments.append(name)
            yield context

    monkeypatch.setattr(view, "put_through", told)
    meshcat = Meshcat()
    times = view.frame_times(scenario, images, meshcat, first=1)
    assert times.shape == (8, 2)
    assert (times > 0).all()
    assert moments == ["without", "with"] + 4 * ["with", "without", "without", "with"]
    assert meshcat.HasPath("/riseg/panel")
    assert meshcat.HasPath("/drake/visualizer")


@pytest.mark.renders
def test_what_is_printed_is_written(small_scenario, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(view, "ROUNDS", 1)
    monkeypatch.setattr(view, "frame_times", lambda *_: np.array([[0.010, 0.011], [0.030, 0.0328]]))
    file = tmp_path / "view.json"
    assert main(["bench", str(small_scenario), "--seed", "1", "--view", "--json", str(file)]) == 0
    figures, printed = json.loads(file.read_text()), " ".join(capsys.readouterr().out.split())
    assert figures["share"] == pytest.approx(0.095)
    assert "20.0 ms without the view, 21.9 ms with it: +9.5 %" in printed
    assert "2.8 ms more), good;" in printed


@pytest.mark.renders
def test_where_no_view_is_asked_for_the_diagram_has_none(small_scenario):
    scenario = load_scenario(small_scenario)
    for meshcat, expected in ((None, 0), (Meshcat(), 1)):
        systems = make_diagram(scenario, 1, meshcat).diagram.GetSystems()
        assert sum(isinstance(each, MeshcatView) for each in systems) == expected
