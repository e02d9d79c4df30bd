import ast
import re
from collections import defaultdict
from functools import cache
from pathlib import Path

from riseg_drake.app.diagram import make_diagram
from riseg_drake.app.scenario import HARDWARE, load_scenario
from tests.docs.pages import section, table_rows

PACKAGE = Path(__file__).parents[1] / "riseg_drake"

PAGE = Path(__file__).parents[1] / "docs" / "architecture.md"

FLOORS = {
    name: int(floor)
    for floor, names in re.findall(r"^floor (\d+) +(.*)$", PAGE.read_text(), re.M)
    for name in names.split()
}
"""As the page draws them."""

FILES = [path for path in sorted(PACKAGE.rglob("*.py")) if path.parent != PACKAGE]
NOT_A_NOUN = {"utils", "util", "common", "helpers", "helper", "misc", "tools", "lib"}
LONGEST = 350


def name(path):
    return str(path.relative_to(PACKAGE))


def room(path):
    return path.relative_to(PACKAGE).parts[0]


@cache
def imports(path):
    """The full names of all modules that a file imports, wherever in the file it does."""
    modules = []
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            modules += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{name(path)} imports relatively"
            modules += [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
    return modules


def words(cell):
    return set(re.findall(r"`(\w+)`", cell))


def test_every_room_has_its_floor_in_the_drawing():
    assert {room(path) for path in FILES} == set(FLOORS)
    assert set(FLOORS.values()) == set(range(6))


def test_the_table_says_what_each_room_imports():
    real = defaultdict(set)
    for path in FILES:
        for module in imports(path):
            other = module.removeprefix("riseg_drake.").split(".")[0]
            if module.startswith("riseg_drake.") and other in FLOORS and other != room(path):
                real[room(path)].add(other)
    rows = table_rows(section(PAGE, "The rooms"))
    assert {row[0].strip("`"): words(row[1]) for row in rows} == {name: real[name] for name in FLOORS}


def test_the_table_says_what_each_room_of_app_imports_and_only_the_command_line_knows_them_all():
    app = PACKAGE / "app"
    rooms = {path.parent.name for path in app.glob("*/*.py")}
    real = {name: set() for name in rooms}
    beside = set()
    for path in sorted(app.rglob("*.py")):
        for module in imports(path):
            other = module.removeprefix("riseg_drake.app.").split(".")[0]
            if module.startswith("riseg_drake.app.") and other in rooms and other != path.parent.name:
                beside.add(path.stem) if path.parent == app else real[path.parent.name].add(other)
    rows = table_rows(section(PAGE, "The rooms of app"))
    assert {row[0].strip("`"): words(row[1]) for row in rows} == real
    assert beside <= {"cli", "commands", "arguments"}


def test_the_table_says_who_hears_whom_in_the_diagram():
    wired = make_diagram(load_scenario(None, HARDWARE), seed=0).diagram
    real = defaultdict(set)
    for (to, _), (source, _) in wired.connection_map().items():
        real[to.get_name()].add(source.get_name())
    rows = table_rows(section(PAGE, "The wiring"))
    assert {row[0].strip("`"): words(row[1]) for row in rows} == real


def test_imports_point_down_only():
    upwards = []
    for path in FILES:
        own = room(path)
        for module in imports(path):
            package, _, rest = module.partition(".")
            other = rest.split(".")[0]
            if package == "riseg_drake" and other in FLOORS and other != own and FLOORS[other] >= FLOORS[own]:
                upwards.append(f"{name(path)} must not import {module}")
    assert upwards == []


def importers(begin, among=FILES):
    """The files that import a module whose full name begins so."""
    return [name(path) for path in among if any(module.startswith(begin) for module in imports(path))]


def test_nothing_below_systems_knows_the_systems_framework():
    below = [path for path in FILES if FLOORS[room(path)] < FLOORS["systems"]]
    assert importers("pydrake.systems", below) == []


def test_pydrake_is_imported_by_name():
    assert importers("pydrake.all") == []


def test_a_file_has_a_noun_for_its_name_and_a_length_that_can_be_read():
    assert [name(path) for path in FILES if path.stem in NOT_A_NOUN] == []
    assert [name(path) for path in FILES if len(path.read_text().splitlines()) > LONGEST] == []


def test_the_floor_of_geometry_stands_on_libraries_of_arrays_and_images_alone():
    allowed = {
        "numpy",
        "scipy",
        "cv2",
        "riseg_drake",
        "dataclasses",
        "functools",
        "math",
        "typing",
        "collections",
    }
    for path in FILES:
        if room(path) == "geometry":
            assert {module.split(".")[0] for module in imports(path)} <= allowed


def test_the_test_rooms_mirror_the_package():
    tests = Path(__file__).parent
    rooms = {path.name for path in tests.iterdir() if path.is_dir() and path.name[0] not in "._"}
    assert rooms <= {*FLOORS, "docs", "models", "faults"}
    of_app = {path.name for path in (tests / "app").iterdir() if path.is_dir() and path.name[0] not in "._"}
    assert of_app <= {path.name for path in (PACKAGE / "app").iterdir() if path.is_dir()}
