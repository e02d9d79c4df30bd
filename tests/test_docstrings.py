"""Docstrings of what is public say shapes, units and errors. That they are there at all is ruff's D1.

A rule for machines is coarse: where an array goes in or comes out, some shape in brackets is named; where a
plain number does, some unit; and what a function raises itself is named. Whether it is right is for people to
read.
"""

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

import pytest

PACKAGE = Path(__file__).parents[1] / "riseg_drake"

SHAPE = re.compile(r"\[[^\]]+\]")
UNIT = re.compile(
    r"(?<!\w)(m|mm|s|ms|rad|px|Hz|N|kg|MB|%|m\^2|m/s|rad/s|metres?|seconds?|milliseconds|pixels?|degrees|radians"
    r"|percent|nats|standard deviations|levels|shares?|ratio|times|probability|in \[0, 1\])(?!\w)",
    re.IGNORECASE,
)
"""Of a length, a time, an angle ..., or of a number that has none."""


class Public(NamedTuple):
    """A function, a method, or a class that is made, and all that its docstrings say."""

    where: str
    node: ast.FunctionDef
    said: str


@cache
def modules() -> dict[str, ast.Module]:
    """The syntax trees of all files, by their names."""
    return {
        str(path.relative_to(PACKAGE)): ast.parse(path.read_text()) for path in sorted(PACKAGE.rglob("*.py"))
    }


def functions() -> Iterator[Public]:
    for name, module in modules().items():
        for node in module.body:
            if isinstance(node, ast.FunctionDef) and node.name[0] != "_":
                yield Public(f"{name}::{node.name}", node, ast.get_docstring(node) or "")
            if isinstance(node, ast.ClassDef) and node.name[0] != "_":
                for method in node.body:
                    if isinstance(method, ast.FunctionDef) and re.match(r"__(init|call)__|[^_]", method.name):
                        said = ast.get_docstring(method) or ""
                        if method.name == "__init__":
                            said += "\n" + (ast.get_docstring(node) or "")
                        yield Public(f"{name}::{node.name}.{method.name}", method, said)


class Field(NamedTuple):
    """An attribute of a public class, as dataclasses have them."""

    where: str
    node: ast.AnnAssign
    said: str
    """By its own docstring."""
    said_of_all: str
    """By the docstring of its class."""


def fields() -> Iterator[Field]:
    for name, module in modules().items():
        for node in ast.walk(module):
            if not isinstance(node, ast.ClassDef) or node.name[0] == "_":
                continue
            for entry, following in zip(node.body, [*node.body[1:], None], strict=True):
                if isinstance(entry, ast.AnnAssign) and ast.unparse(entry.target)[0] != "_":
                    own = following.value if isinstance(following, ast.Expr) else None
                    said = str(own.value) if isinstance(own, ast.Constant) else ""
                    where = f"{name}::{node.name}.{ast.unparse(entry.target)}"
                    yield Field(where, entry, said, ast.get_docstring(node) or "")


def annotations(function: ast.FunctionDef) -> list[str]:
    """Of what goes in and what comes out."""
    arguments = [*function.args.args, *function.args.kwonlyargs]
    written = [a.annotation for a in arguments] + [function.returns]
    return [ast.unparse(annotation) for annotation in written if annotation is not None]


def is_array(annotation: str) -> bool:
    return annotation.startswith("NDArray")


def is_number(annotation: str) -> bool:
    return annotation in ("float", "float | None")


def raised(function: ast.FunctionDef) -> set[str]:
    """The names of the errors that a function itself makes and raises."""
    errors = [node.exc for node in ast.walk(function) if isinstance(node, ast.Raise) and node.exc]
    names = {ast.unparse(error.func if isinstance(error, ast.Call) else error) for error in errors}
    return {name for name in names if name[0].isupper()}


def test_arrays_have_a_shape():
    silent = [
        f.where for f in functions() if any(map(is_array, annotations(f.node))) and not SHAPE.search(f.said)
    ]
    silent += [
        f.where
        for f in fields()
        if is_array(ast.unparse(f.node.annotation)) and not SHAPE.search(f.said + f.said_of_all)
    ]
    assert silent == []


def test_numbers_have_a_unit():
    silent = [
        f.where for f in functions() if any(map(is_number, annotations(f.node))) and not UNIT.search(f.said)
    ]
    assert silent == []


def test_numbers_that_are_kept_are_explained():
    silent = [
        f.where
        for f in fields()
        if is_number(ast.unparse(f.node.annotation)) and not f.said and not UNIT.search(f.said_of_all)
    ]
    assert silent == []


def test_errors_are_named():
    silent = [(f.where, name) for f in functions() for name in raised(f.node) if name not in f.said]
    assert silent == []


@pytest.mark.parametrize(
    ("text", "shape", "unit"),
    [("Points [N, 3], m.", True, True), ("Points of the image.", False, False), ("A share.", False, True)],
)
def test_the_rule_itself_tells_one_from_the_other(text, shape, unit):
    assert (bool(SHAPE.search(text)), bool(UNIT.search(text))) == (shape, unit)
