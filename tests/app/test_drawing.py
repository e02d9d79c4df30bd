import shutil

import pytest

from riseg_drake.app.cli import main

STAGES = ("ExpectedFlow", "OpticalFlow", "BFIFGrouper", "MaskPropagator", "PushPlanner", "ArmMotion")


@pytest.mark.renders
def test_every_stage_and_its_ports_are_in_the_drawing(small_scenario, capsys):
    assert main(["diagram", str(small_scenario)]) == 0
    dot = capsys.readouterr().out
    assert dot.startswith("digraph")
    for name in (*STAGES, "wrist.color_image", "panda.position", "optical_flow"):
        assert name in dot


@pytest.mark.renders
def test_no_stage_is_wired_to_ground_truth(small_scenario):
    from riseg_drake.app.diagram import make_diagram
    from riseg_drake.app.scenario import load_scenario

    diagram = make_diagram(load_scenario(small_scenario), seed=0).diagram
    sources = {
        (system.get_name(), system.get_output_port(index).get_name())
        for system, index in (source for source in diagram.connection_map().values())
    }
    assert ("station", "wrist.color_image") in sources
    assert not [name for _, name in sources if name.startswith("cheat.")]


@pytest.mark.renders
@pytest.mark.skipif(shutil.which("dot") is None, reason="graphviz is not installed")
def test_a_drawing_can_be_an_svg(small_scenario, tmp_path):
    assert main(["diagram", str(small_scenario), "--output", str(tmp_path / "d.svg")]) == 0
    assert "<svg" in (tmp_path / "d.svg").read_text()


def test_an_svg_without_graphviz_is_one_line_that_says_so(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("shutil.which", lambda _: None)
    assert main(["diagram", "--output", str(tmp_path / "d.svg")]) == 2
    assert "graphviz" in capsys.readouterr().err


def test_other_kinds_of_drawing_are_refused(tmp_path, capsys):
    assert main(["diagram", "--output", str(tmp_path / "d.pdf")]) == 2
    assert ".dot or .svg" in capsys.readouterr().err
