"""`riseg diagram`: the wired diagram as a picture."""

import shutil
import subprocess
from pathlib import Path

from pydrake.systems.framework import Diagram
from rich.console import Console

from riseg_drake.app.diagram import make_diagram
from riseg_drake.app.graphics import require_graphics
from riseg_drake.app.output import OutputError
from riseg_drake.app.scenario import load_scenario
from riseg_drake.recording.whole_file import write_bytes


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
    content = _to_svg(dot) if output.suffix == ".svg" else dot.encode()
    try:
        write_bytes(output, content)
    except OSError as error:
        raise OutputError(f"cannot write {output}: {error.strerror}") from None
    console.print(f"drew {output}")


def draw(diagram: Diagram) -> str:
    """The stages and the station as boxes, with all their ports, in DOT."""
    return diagram.GetGraphvizString(max_depth=1)


def _check_output(output: Path) -> None:
    if output.suffix not in (".dot", ".svg"):
        raise OutputError(f"{output}: the name must end in .dot or .svg")
    if output.suffix == ".svg" and shutil.which("dot") is None:
        raise OutputError("SVG needs the program dot; install the package graphviz, or ask for a .dot file")


def _to_svg(dot: str) -> bytes:
    return subprocess.run(["dot", "-Tsvg"], input=dot.encode(), capture_output=True, check=True).stdout
