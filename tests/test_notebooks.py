"""The notebooks run with today's code, and are stored with what they show."""

import json
import re
import runpy
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[1] / "notebooks"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))
LARGEST = 400_000  # bytes; code hosts show no large notebooks
LARGEST_PICTURE = 190_000  # bytes in base64


def name(path):
    return path.stem


def code_cells(path):
    return [cell for cell in json.loads(path.read_text())["cells"] if cell["cell_type"] == "code"]


def outputs(path):
    return [output for cell in code_cells(path) for output in cell["outputs"]]


def figures(cells):
    """How many figures of the room `pictures` the cells show."""
    return sum("image/jpeg" in output.get("data", ()) for cell in cells for output in cell.get("outputs", ()))


def text_of(output):
    return "".join(output.get("text", ())) + "".join(output.get("data", {}).get("text/plain", ()))


def test_there_are_three():
    assert [path.stem for path in NOTEBOOKS] == ["1_the_idea", "2_one_push", "3_your_own_diagram"]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=name)
def test_a_notebook_is_stored_executed_from_top_to_bottom(path):
    assert [cell["execution_count"] for cell in code_cells(path)] == list(range(1, len(code_cells(path)) + 1))


@pytest.mark.parametrize("path", NOTEBOOKS, ids=name)
def test_a_notebook_shows_pictures_and_is_small_enough_to_be_shown(path):
    pictures = [
        data for output in outputs(path) for kind, data in output.get("data", {}).items() if "image/" in kind
    ]
    assert len(pictures) >= 3
    assert max(map(len, pictures)) < LARGEST_PICTURE
    assert path.stat().st_size < LARGEST


@pytest.mark.parametrize("path", NOTEBOOKS, ids=name)
def test_a_notebook_shows_no_errors_no_warnings_and_nobodys_folders(path):
    for output in outputs(path):
        assert output["output_type"] != "error"
        assert not re.search(
            r"warning|Error|/home/|/tmp/|site-packages|riseg_drake/", text_of(output), re.IGNORECASE
        )


@pytest.mark.renders
@pytest.mark.parametrize("path", NOTEBOOKS, ids=name)
def test_a_notebook_runs_and_shows_as_many_figures_as_the_stored_one(path, tmp_path):
    before = path.read_bytes()
    executed = runpy.run_path(str(FOLDER / "execute.py"))["executed"](path, tmp_path)
    assert path.read_bytes() == before
    assert figures(executed.cells) == figures(json.loads(path.read_text())["cells"]) > 0
