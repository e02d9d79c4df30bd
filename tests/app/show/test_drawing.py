import re
import shutil

import pytest
from pydrake.systems.framework import DiagramBuilder, LeafSystem
from pydrake.systems.primitives import ConstantVectorSource

from riseg_drake.app.cli import main
from riseg_drake.app.diagram import make_diagram
from riseg_drake.app.scenario import load_scenario
from riseg_drake.app.show.drawing import MEMORY_COLOR, STAGE_COLOR, UNUSED_COLOR, draw

STAGES = ("ExpectedFlow", "OpticalFlow", "BFIFGrouper", "MaskPropagator", "PushPlanner", "ArmMotion")


@pytest.mark.renders
def test_every_stage_and_its_ports_are_in_the_drawing(small_scenario, capsys):
    assert main(["diagram", str(small_scenario)]) == 0
    dot = capsys.readouterr().out
    assert dot.startswith("digraph")
    for name in (*STAGES, "wrist.color_image", "panda.position", "optical_flow"):
        assert name in dot


class Counter(LeafSystem):
    def __init__(self):
        super().__init__()
        self.DeclareVectorInputPort("step", 1)
        self.DeclareDiscreteState(1)
        self.DeclareStateOutputPort("count", self.DeclareDiscreteState(1))


def test_wires_ports_and_memory_can_be_told_from_the_drawing():
    builder = DiagramBuilder()
    source, counter = ConstantVectorSource([1.0]), Counter()
    source.set_name("one & only")
    counter.set_name("counter")
    builder.AddSystem(source)
    builder.AddSystem(counter)
    builder.Connect(source.get_output_port(), counter.GetInputPort("step"))
    builder.ExportOutput(counter.GetOutputPort("count"), "exported")
    dot = draw(builder.Build())
    assert re.findall(r"(\w+):y0:e -> (\w+):u0:w", dot) == [("s0", "s1")]
    assert f'BGCOLOR="{STAGE_COLOR}"><B>one &amp; only</B>' in dot
    assert f'BGCOLOR="{MEMORY_COLOR}"><B>counter</B>' in dot
    assert f'<FONT COLOR="{UNUSED_COLOR}">count</FONT>' in dot
    assert "exported" not in dot


@pytest.mark.renders
def test_the_same_diagram_gives_the_same_drawing(small_scenario):
    scenario = load_scenario(small_scenario)
    first, second = (make_diagram(scenario, seed=0) for _ in range(2))
    assert draw(first.diagram) == draw(second.diagram)


@pytest.mark.renders
def test_no_stage_is_wired_to_ground_truth(small_scenario):
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
