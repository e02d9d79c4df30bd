"""Every block of README, CONTRIBUTING and docs is executed, or parsed by what would read it."""

import json
import re
import tomllib
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from itertools import pairwise
from pathlib import Path

import pytest
import yaml

from riseg_drake.app.arguments import command_line
from riseg_drake.app.cli import main
from riseg_drake.app.scenario import Scenario
from riseg_drake.app.scenario_file import parse_scenario
from riseg_drake.recording.layout import camera_from_json
from tests.docs.given import ROBOT_RECORDING, give
from tests.docs.pages import CHECKOUT, PAGES, all_blocks, blocks, code_spans, commands, name

LANGUAGES = {"bash", "python", "yaml", "json", "xml", "text"}
"""A block of `text` is a drawing, or what a program says; nothing is done with it here."""

SHORT = Path("short")
"""Where scenarios lie of which only the first look is taken."""


def shortened(words: list[str]) -> list[str]:
    """`riseg run` with no push: the first look at the same scene, into the same folder."""
    given = [word for word in words[1:2] if word.endswith(".yaml")]
    return [words[0], str(first_look(given[0] if given else None)), *words[1 + len(given) :]]


def without_rerun(words: list[str]) -> list[str]:
    """A command of `riseg` as it stands where Rerun is installed, otherwise without its time line."""
    if find_spec("rerun") is not None:
        return words
    return [word for word in words if word != "--rerun" and not word.endswith(".rrd")]


def one_scene(words: list[str]) -> list[str] | None:
    """`riseg evaluate` of one scene with no push, in this process, whose folder is the test's own.

    None where it wants a Dask cluster, weights of a SAM, masks of another method, or a suite of many scenes.
    """
    if {"--dask", "--baseline", "--masks", "--suite"} & set(words):
        return None
    given = dict(pairwise(words)).get("--scenario")
    short = [word for word in words if word not in ("--scenario", given)]
    return [*short, "--scenario", str(first_look(given)), "--scenes", "1", "--jobs", "1"]


def of_that_robot(words: list[str]) -> list[str] | None:
    """`riseg segment` as it stands; where it names a robot, with a recording of that robot.

    None for bags, of which there are none.
    """
    if words[1:] and words[1].startswith("pushes"):
        return None
    return [ROBOT_RECORDING if "--robot" in words and word == "my_recording" else word for word in words]


def first_look(scenario: str | None) -> Path:
    """A scenario file of the same name with a quarter of the pixels, by which no push is made."""
    content = yaml.safe_load(Path(scenario).read_text()) if scenario else {}
    content.setdefault("arm", {})["most_interactions"] = 0
    camera = content.setdefault("station", {}).setdefault("camera", {})
    camera |= {"width": 320, "height": 240, "fx": 308.1, "fy": 307.9, "cx": 150.7, "cy": 116.4}
    short = SHORT / (Path(scenario).name if scenario else "simulation.yaml")
    short.parent.mkdir(exist_ok=True)
    short.write_text(yaml.safe_dump(content))
    return short


EXECUTED: dict[str, tuple[Callable[[list[str]], list[str] | None], str]] = {
    "run": (
        shortened,
        "a minute; tests/app/run/test_run.py goes to the last push of a small scene",
    ),
    "evaluate": (
        one_scene,
        "20 scenes take minutes; tests/app/evaluate/test_evaluate.py has small ones",
    ),
    "segment": (of_that_robot, "executed as it stands"),
    "convert": (
        lambda words: None,
        "needs bags; tests/app/segment/test_convert_command.py writes some",
    ),
    "score": (lambda words: words, "executed as it stands"),
    "diagram": (lambda words: words, "executed as it stands"),
    "doctor": (lambda words: words, "executed as it stands"),
    "bench": (lambda words: None, "measures for a minute; tests/app/bench/test_stop_bench.py has its parts"),
    "emulate": (
        lambda words: None,
        "runs until Ctrl-C; tests/app/test_emulate.py has it in processes of its own",
    ),
    "pictures": (
        lambda words: None,
        "films a run; tests/app/show/test_pictures_command.py has a small one",
    ),
    "hardware": (lambda words: None, "needs the drivers; tests/app/test_emulate.py runs it on emulated ones"),
    "drive-arm": (
        lambda words: None,
        "needs a robot; tests/stations/test_drive_process.py drives one that others wrote",
    ),
    "drive-camera": (
        lambda words: None,
        "needs a camera; tests/app/hardware/test_drive_camera.py plays a file",
    ),
    "calibrate": (
        lambda words: words if "--draw" in words else None,
        "needs views of a board; tests/app/hardware/test_calibrate.py renders some",
    ),
    "hand-eye": (
        lambda words: None,
        "needs the drivers; tests/segmentation/test_hand_eye.py has its arithmetic",
    ),
}
"""What is executed of each command of `riseg`, and why it is not more; None: it is parsed alone."""

NOT_EXECUTED = {
    "apt": "changes the machine",
    "sudo": "changes the machine",
    "pip": "changes the environment; tests/test_packaging.py installs the package",
    "python3": "makes an environment; tests/test_packaging.py has one of its own",
    "franka/bin/python": "the Python of another environment; tests/stations/franka_rig.py starts the same",
    ".": "enters it",
    "export": "is the shell's own",
    "kill": "is the shell's own",
    "set": "is the shell's own",
    "wait": "is the shell's own",
    "python": "its modules and tests are looked up",
    "ruff": "is a check of its own",
    "mypy": "is a check of its own",
    "sphinx-build": ".ci/run builds the site",
    "pre-commit": "tests/docs/test_contributing.py compares its hooks with .ci/run",
    "lcm-logger": "a program of LCM's",
    "lcm-logplayer": "a program of LCM's",
}
"""Other programs that a page may call, and why a test does not."""


def test_no_block_is_of_an_unknown_language():
    assert [str(block) for block in all_blocks() if block.language not in LANGUAGES] == []


def subparsers():
    (action,) = (a for a in command_line()._actions if a.choices and "run" in a.choices)
    return action.choices


@pytest.mark.parametrize("block", all_blocks("bash"), ids=str)
def test_every_command_of_riseg_is_one_that_its_parser_takes_and_others_are_known(block):
    for words in commands(block):
        if words[0] == "riseg":
            command_line().parse_args(words[1:])
            assert words[1] in EXECUTED
        else:
            assert words[0] in NOT_EXECUTED, f"{block}: {words[0]}"


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_commands_in_running_text_exist_with_all_their_options(page):
    for span in code_spans(page):
        words = re.sub(r"[\[\]|]", " ", span).split()
        if words[:1] == ["riseg"] and len(words) > 1 and words[1].islower():
            parser = subparsers()[words[1]]
            options = {word.partition("=")[0] for word in words if word.startswith("--")} - {"--help"}
            assert options <= set(parser._option_string_actions), span


def pip_extras(words: list[str]) -> Iterator[str]:
    for word in words:
        yield from re.search(r"\[(.*)\]$", word)[1].split(",") if word.endswith("]") else ()


def python_calls() -> Iterator[tuple[str, list[str]]]:
    """Where and how Python or pip are called, in blocks and between backticks."""
    for block in all_blocks("bash"):
        yield from ((str(block), words) for words in commands(block))
    for page in PAGES:
        yield from ((name(page), span.replace("'", "").split()) for span in code_spans(page))


def test_whoever_is_told_to_install_an_extra_finds_it():
    known = tomllib.loads((CHECKOUT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    asked = [(where, set(pip_extras(words))) for where, words in python_calls() if words[:1] == ["pip"]]
    assert any(extras for _, extras in asked)
    assert [(where, extras) for where, extras in asked if extras - set(known)] == []


def test_every_module_and_test_that_a_page_names_is_there():
    for where, words in python_calls():
        called = [word for word in words if not re.match(r"[A-Z_]+=", word)]
        if called[:2] != ["python", "-m"]:
            continue
        assert find_spec(called[2]) is not None, where
        if called[2] != "pytest":
            continue
        files = [word for word in called[3:] if word.endswith(".py")]
        for file in files:
            assert (CHECKOUT / file).is_file(), f"{where}: {file}"
        if "-k" in called:
            word = called[called.index("-k") + 1].strip('"')
            tests = re.findall(r"def (test_\w+)|ids=(.*)", (CHECKOUT / files[0]).read_text())
            assert any(word in part for test in tests for part in test), f"{where}: {word}"


@pytest.mark.parametrize("block", all_blocks("yaml"), ids=str)
def test_every_yaml_block_is_a_scenario(block):
    assert parse_scenario(block.text, Scenario, source=str(block)) != Scenario()


@pytest.mark.parametrize("block", all_blocks("json"), ids=str)
def test_every_json_block_is_a_camera(block):
    camera_from_json(json.loads(block.text))


def to_execute() -> list[Path]:
    return [page for page in PAGES if any(block.language in ("python", "bash") for block in blocks(page))]


@pytest.mark.renders
@pytest.mark.parametrize("page", to_execute(), ids=name)
def test_a_page_does_what_it_says_from_top_to_bottom(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    give(tmp_path)
    namespace: dict = {}
    for block in blocks(page):
        if block.language == "python":
            # Blank lines before it, so that an error tells the line of the page.
            exec(compile("\n" * (block.line - 1) + block.text, str(page), "exec"), namespace)
        elif block.language == "yaml" and (named := re.match(r"# (\S+\.yaml)\n", block.text)):
            Path(named[1]).write_text(block.text)
        elif block.language == "xml":
            Path(re.match(r"<!-- (\w+\.(?:sdf|urdf)):", block.text)[1]).write_text(block.text)
        elif block.language == "bash":
            for words in commands(block):
                reduced = EXECUTED[words[1]][0](without_rerun(words[1:])) if words[0] == "riseg" else None
                assert reduced is None or main(reduced) == 0, f"{block}: {' '.join(words)}"
