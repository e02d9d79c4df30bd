"""Reads a YAML file into a dataclass, and says in one line what would have been right where it is wrong.

pydrake's yaml_load_typed does the filling; the check before it knows lines, near misses and plain words.
"""

import dataclasses
import difflib
import math
import types
import typing
from pathlib import Path
from typing import Any, TypeVar

import yaml
from pydrake.common.yaml import yaml_load_typed

Schema = TypeVar("Schema")


class ScenarioError(ValueError):
    """What is wrong with a scenario, in one line for the person who wrote it."""


def read_scenario(path: Path, schema: type[Schema]) -> Schema:
    """Fill a dataclass from a YAML file; keys that are absent keep their defaults.

    Raises ScenarioError: missing file, no YAML, unknown key, value of the wrong type.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise ScenarioError(f"{path} is not there{_nearest_file(path)}") from None
    except (OSError, UnicodeDecodeError):
        raise ScenarioError(f"{path} is not a readable text file; a scenario is a YAML file") from None
    return parse_scenario(text, schema, source=str(path))


def parse_scenario(text: str, schema: type[Schema], source: str) -> Schema:
    """The same for a text; `source` names it in errors. Raises ScenarioError."""
    try:
        node = yaml.compose(text, Loader=yaml.SafeLoader)
    except yaml.MarkedYAMLError as error:
        line = f" line {error.problem_mark.line + 1}:" if error.problem_mark else ""
        raise ScenarioError(f"{source}:{line} not YAML ({error.problem})") from None
    except yaml.YAMLError as error:
        raise ScenarioError(f"{source}: not YAML ({str(error).splitlines()[0]})") from None
    if node is None:  # an empty file: all defaults
        return schema()
    _check(node, schema, name="the scenario", source=source)
    try:
        return yaml_load_typed(schema=schema, data=yaml.serialize(node), defaults=schema())
    except (RuntimeError, ValueError, TypeError) as error:
        raise ScenarioError(f"{source}: {' '.join(str(error).split())}") from None


def _check(node: yaml.Node, schema: Any, name: str, source: str) -> None:
    """Raise ScenarioError if a YAML node does not fit the schema of its field."""
    where = f"{source}: line {node.start_mark.line + 1}:"
    schema = _variant(_without_none(schema, node), node, name, where)
    if schema is None:
        return
    if dataclasses.is_dataclass(schema):
        _check_keys(node, schema, name, source, where)
    elif typing.get_origin(schema) is list:
        if not isinstance(node, yaml.SequenceNode):
            raise ScenarioError(f"{where} {name} must be a list, such as [1, 2], not {_said(node)}")
        for index, item in enumerate(node.value):
            _check(item, typing.get_args(schema)[0], f"{name}[{index}]", source)
    elif schema in _FITS and not (isinstance(node, yaml.ScalarNode) and _FITS[schema](node)):
        raise ScenarioError(f"{where} {name} must be {_WORDS[schema]}, not {_said(node)}")


def _check_keys(node: yaml.Node, schema: Any, name: str, source: str, where: str) -> None:
    fields = typing.get_type_hints(schema)
    known = [field.name for field in dataclasses.fields(schema)]
    if not isinstance(node, yaml.MappingNode):
        raise ScenarioError(f"{where} {name} must be a block of keys ({', '.join(known)}), not {_said(node)}")
    for index, (key_node, value_node) in enumerate(node.value):
        key = key_node.value
        path = key if name == "the scenario" else f"{name}.{key}"
        if key not in known:
            near = difflib.get_close_matches(str(key), known, n=1)
            right = f"did you mean {near[0]!r}?" if near else f"the keys here are {', '.join(known)}"
            line = key_node.start_mark.line + 1
            raise ScenarioError(f"{source}: line {line}: unknown key {path!r}; {right}")
        if fields[key] == list[str] and isinstance(value_node, yaml.ScalarNode) and _FITS[str](value_node):
            # One text stands for a list of one.
            marks = value_node.start_mark, value_node.end_mark
            value_node = yaml.SequenceNode("tag:yaml.org,2002:seq", [value_node], *marks)
            node.value[index] = (key_node, value_node)
        _check(value_node, fields[key], path, source)
        choices = _choices(schema, key)
        if choices and value_node.value not in choices:
            line = value_node.start_mark.line + 1
            raise ScenarioError(
                f"{source}: line {line}: {path} must be one of {', '.join(choices)}, not {_said(value_node)}"
            )


def _choices(schema: Any, key: str) -> tuple[str, ...]:
    """The words that a field allows: `field(default=..., metadata={"choices": (...)})`; empty: any."""
    (field,) = (field for field in dataclasses.fields(schema) if field.name == key)
    return field.metadata.get("choices", ())


def _without_none(schema: Any, node: yaml.Node) -> Any:
    """The schema behind `X | None`; None if nothing is left to check."""
    if typing.get_origin(schema) not in (typing.Union, types.UnionType):
        return schema
    if node.tag.endswith(":null"):
        return None
    rest = [choice for choice in typing.get_args(schema) if choice is not type(None)]
    return typing.Union[tuple(rest)]  # noqa: UP007  (of a number of types that is known only here)


def _variant(schema: Any, node: yaml.Node, name: str, where: str) -> Any:
    """Of a choice between dataclasses the one that a tag such as !Name asks for; the first without a tag."""
    if typing.get_origin(schema) not in (typing.Union, types.UnionType):
        return schema
    variants = {f"!{choice.__name__}": choice for choice in typing.get_args(schema)}
    if not node.tag.startswith("!"):
        return next(iter(variants.values()))
    if node.tag not in variants:
        raise ScenarioError(f"{where} {name} must be one of {', '.join(variants)}, not {node.tag}")
    return variants[node.tag]


def _is_number(node: yaml.ScalarNode) -> bool:
    try:
        return math.isfinite(float(node.value))  # also 1e-3, which YAML takes for a text
    except ValueError:
        return False


_FITS: dict[Any, typing.Callable[[yaml.ScalarNode], bool]] = {
    bool: lambda node: node.tag.endswith(":bool"),
    int: lambda node: node.tag.endswith(":int"),
    float: _is_number,
    str: lambda node: node.tag.endswith(":str"),
}
_WORDS = {bool: "true or false", int: "a whole number", float: "a number", str: "a text"}


def _said(node: yaml.Node) -> str:
    if isinstance(node, yaml.ScalarNode):
        return repr(node.value)
    return "a list" if isinstance(node, yaml.SequenceNode) else "a block of keys"


def _nearest_file(path: Path) -> str:
    """A hint at a file of nearly the same name beside the one that is missing."""
    try:
        names = [entry.name for entry in path.parent.iterdir() if entry.suffix in (".yaml", ".yml")]
    except OSError:
        return f"; nor is the folder {path.parent}"
    near = difflib.get_close_matches(path.name, names, n=1)
    return f"; did you mean {path.parent / near[0]}?" if near else ""
