"""`riseg diagram`: the wired diagram as a picture."""

import shutil
import subprocess
from html import escape
from pathlib import Path

from pydrake.systems.framework import Diagram, System
from rich.console import Console

from riseg_drake.app.diagram import make_diagram
from riseg_drake.app.graphics import require_graphics
from riseg_drake.app.output_folder import OutputError, write_told
from riseg_drake.app.scenario import load_scenario
from riseg_drake.pictures.object_colors import hex_color

STATION_COLOR, MEMORY_COLOR, STAGE_COLOR = "#d5e8f3", "#f9e3b8", "#eeeeee"
UNUSED_COLOR = "#999999"
WIRE_IDS = (1, 2, 3, 5, 6, 7, 8, 9, 10, 11, 12)  # colours of objects, but for the yellow that is lost on white
LOOK = """\
rankdir=LR; nodesep=0.25; ranksep=0.6; bgcolor=white;
node [shape=plain, fontname="Helvetica,Arial,sans-serif", fontsize=11];
edge [penwidth=1.4, arrowsize=0.7];"""


def diagram_command(scenario_file: Path | None, output: Path | None, console: Console) -> None:
    """Draw the diagram of a scenario to a .dot or .svg file, or as DOT to the terminal. Raises OutputError."""
    if output is not None:
        _check_output(output)
    scenario = load_scenario(scenario_file)
    require_graphics()
    dot = draw(make_diagram(scenario, seed=0).diagram)
    if output is None:
        print(dot, flush=True)
        return
    content = render(dot, "svg") if output.suffix == ".svg" else dot.encode()
    write_told(output, content)
    console.print(f"drew {output}")


def draw(diagram: Diagram) -> str:
    """A diagram's systems as boxes with all their ports, and its wires, in DOT.

    Blue: diagrams within; orange: systems that remember something from one event to the next; gray: the
    others. All wires from one system have one colour. Ports in gray are not wired to anything here (those
    of a whole diagram that are exported can still be read).

    Drake's own drawing (`GetGraphvizString`) has the exported ports as well, each with a wire of its own;
    with a score of them nothing else is to be seen.
    """
    systems, wires = diagram.GetSystems(), diagram.connection_map()
    wired = {(system, "u", int(index)) for system, index in wires}
    wired |= {(system, "y", int(index)) for system, index in wires.values()}
    name = {system: f"s{k}" for k, system in enumerate(systems)}
    lines = [f"digraph {{\n{LOOK}"]
    for system in systems:
        inputs = [system.get_input_port(k).get_name() for k in range(system.num_input_ports())]
        outputs = [system.get_output_port(k).get_name() for k in range(system.num_output_ports())]
        rows = ""
        for k in range(max(len(inputs), len(outputs))):
            cells = (
                _cell(ports[k], f"{side}{k}", align, (system, side, k) in wired)
                if k < len(ports)
                else "<TD></TD>"
                for ports, side, align in ((inputs, "u", "LEFT"), (outputs, "y", "RIGHT"))
            )
            rows += f"<TR>{''.join(cells)}</TR>"
        lines.append(
            f'{name[system]} [label=<<TABLE BORDER="1" COLOR="#555555" CELLBORDER="0" CELLSPACING="0" '
            f'CELLPADDING="3"><TR><TD COLSPAN="2" BGCOLOR="{_color(system)}">'
            f"<B>{escape(system.get_name())}</B></TD></TR>{rows}</TABLE>>];"
        )
    # In the order of the systems: the map's own changes from one process to the next.
    order = {system: k for k, system in enumerate(systems)}
    for (target, u), (source, y) in sorted(
        wires.items(), key=lambda wire: (order[wire[0][0]], int(wire[0][1]))
    ):
        color = hex_color(WIRE_IDS[order[source] % len(WIRE_IDS)])
        lines.append(f'{name[source]}:y{int(y)}:e -> {name[target]}:u{int(u)}:w [color="{color}"];')
    return "\n".join([*lines, "}"])


def _cell(port: str, anchor: str, align: str, is_wired: bool) -> str:
    """A port in its system's table."""
    text = escape(port) if is_wired else f'<FONT COLOR="{UNUSED_COLOR}">{escape(port)}</FONT>'
    return f'<TD PORT="{anchor}" ALIGN="{align}">{text}</TD>'


def _color(system: System) -> str:
    if isinstance(system, Diagram):
        return STATION_COLOR
    remembers = (
        system.num_abstract_states() + system.num_discrete_state_groups() + system.num_continuous_states()
    )
    return MEMORY_COLOR if remembers else STAGE_COLOR


def render(dot: str, image_format: str) -> bytes:
    """DOT as an image ("svg", "png"), by the program dot. Raises OutputError where that is missing."""
    require_dot()
    return subprocess.run(
        ["dot", f"-T{image_format}", "-Gdpi=72"], input=dot.encode(), capture_output=True, check=True
    ).stdout


def require_dot() -> None:
    """Raise OutputError unless the program dot is there."""
    if shutil.which("dot") is None:
        raise OutputError(
            "a drawing needs the program dot; install the package graphviz, or ask for a .dot file"
        )


def _check_output(output: Path) -> None:
    if output.suffix not in (".dot", ".svg"):
        raise OutputError(f"{output}: the name must end in .dot or .svg")
    if output.suffix == ".svg":
        require_dot()
