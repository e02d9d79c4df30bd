"""Reads a YAML file into a dataclass, and says in one line what would have been right where it is wrong.

pydrake's yaml_load_typed does the filling; the check before it knows lines, near misses and plain words, and
the one after it the values. What a field allows stands in its metadata: `choices` (words), `least` and `most`
(of a number, or of each in a list), `sizes` (of a list). How fields must fit together a dataclass checks
itself, in `check(self)`, which raises ValueError with a text that begins with a key.
"""

import dataclasses
import difflib
import math
import re
import types
import typing
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, TypeVar

import yaml
from pydrake.common.yaml import yaml_load_typed

from riseg_drake.host.files import MOST_SETTINGS, FileError, MissingFileError, near_name, read_text
from riseg_drake.host.terminal import one_line

Schema = TypeVar("Schema")


MOST_VALUES = 20_000
"""Keys and values; ten times as many take YAML's reader ten seconds."""
DEEPEST = 32
"""Blocks and lists in each other."""


class ScenarioError(ValueError):
    """What is wrong with a scenario, in one line for the person who wrote it."""


_FORMER = {
    "station.panda.pusher_url": [
        f"package://riseg_drake_models/pusher/{name}.sdf" for name in ("pusher", "bar")
    ],
    "push.action.pusher.thickness": ["0.02"],
    "push.action.pusher.width": ["0.03"],
    "push.action.pusher.length": ["0.3"],
}
"""Keys that recordings made before `station.panda.tool` hold, with the values that are those of its default."""


def read_scenario(path: Path, schema: type[Schema]) -> Schema:
    """Fill a dataclass from a YAML file; keys that are absent keep their defaults.

    Raises ScenarioError: missing file, no YAML, unknown key, value of the wrong type or out of bounds.
    """
    try:
        text = read_text(path, MOST_SETTINGS)
    except MissingFileError:
        raise ScenarioError(f"{path} is not there{_nearest_file(path)}") from None
    except FileError as error:
        raise ScenarioError(f"{error}; a scenario is a YAML file") from None
    return parse_scenario(text, schema, source=str(path))


def parse_scenario(text: str, schema: type[Schema], source: str) -> Schema:
    """The same for a text; `source` names it in errors. Raises ScenarioError."""
    try:
        _check_plain(text, source)
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
        loaded = yaml_load_typed(schema=schema, data=yaml.serialize(node), defaults=schema())
    except Exception as error:  # the loader's, YAML's own, and those of whatever a tag or a number asks for
        raise ScenarioError(f"{source}: {one_line(error)}") from None
    for complaint in _complaints(loaded):
        raise ScenarioError(f"{source}: line {_line(node, complaint)}: {complaint}")
    return loaded


def _complaints(loaded: Any, prefix: str = "") -> Iterator[str]:
    """What is wrong with the values of a dataclass, inner ones first; each line begins with the key's path."""
    for field in dataclasses.fields(loaded):
        value, path = getattr(loaded, field.name), f"{prefix}{field.name}"
        if dataclasses.is_dataclass(value):
            yield from _complaints(value, f"{path}.")
        else:
            yield from _out_of_bounds(value, field.metadata, path)
    try:
        getattr(loaded, "check", lambda: None)()
    except ValueError as error:
        yield f"{prefix}{error}"


def _out_of_bounds(value: Any, bounds: Mapping[str, Any], path: str) -> Iterator[str]:
    if "sizes" in bounds and len(value) not in bounds["sizes"]:
        yield f"{path} has {len(value)} numbers; expected {' or '.join(str(size) for size in bounds['sizes'])}"
    least, most = bounds.get("least", -math.inf), bounds.get("most", math.inf)
    for number in value if isinstance(value, list) else [value]:
        if ("least" in bounds or "most" in bounds) and number is not None and not least <= number <= most:
            yield f"{path} is {number:g}; expected {_range(least, most)}"


def _range(least: float, most: float) -> str:
    if math.isinf(most):
        return f"at least {least:g}"
    return f"at most {most:g}" if math.isinf(least) else f"{least:g} to {most:g}"


def _line(node: yaml.Node, complaint: str) -> int:
    """The line of the key whose path a complaint begins with, or of the innermost block around it."""
    line = node.start_mark.line
    for key in re.match(r"[\w.]*", complaint).group().split("."):  # type: ignore[union-attr]
        entries = node.value if isinstance(node, yaml.MappingNode) else []
        found = [entry for entry in entries if entry[0].value == key]
        if not found:
            break
        line, node = found[-1][0].start_mark.line, found[-1][1]
    return line + 1


def _check_plain(text: str, source: str) -> None:
    """Raise ScenarioError for YAML that no scenario needs; reads no further than to the first of it.

    Brackets in brackets cost time by their square, and memory of the stack; directives change what tags mean.
    """
    depth = values = 0
    for event in yaml.parse(text, Loader=yaml.SafeLoader):
        values += isinstance(event, yaml.NodeEvent)
        line = event.start_mark.line + 1
        if isinstance(event, yaml.DocumentStartEvent) and (event.version or event.tags):
            raise ScenarioError(f"{source}: line {line}: a scenario has no directives (%YAML, %TAG)")
        if isinstance(event, yaml.CollectionStartEvent):
            depth += 1
        elif isinstance(event, yaml.CollectionEndEvent):
            depth -= 1
        if values > MOST_VALUES:
            raise ScenarioError(
                f"{source}: line {line}: a scenario has no more than {MOST_VALUES} keys and values"
            )
        if depth > DEEPEST:
            raise ScenarioError(f"{source}: line {line}: nothing in a scenario is nested so deeply")


def _check(node: yaml.Node, schema: Any, name: str, source: str) -> None:
    """Raise ScenarioError if a YAML node does not fit the schema of its field."""
    where = f"{source}: line {node.start_mark.line + 1}:"
    if not node.tag.startswith(("!", "tag:yaml.org,2002:")) or node.tag.startswith(_OF_PYTHON):
        raise ScenarioError(f"{where} {name} has the unknown tag {node.tag}")
    choices = _without_none(schema, node)
    schema = _variant(choices, node, name, where)
    if schema is None:
        return
    if dataclasses.is_dataclass(schema):
        _check_keys(node, schema, name, source, where, [c for c in typing.get_args(choices) if c is not schema])
    elif typing.get_origin(schema) is list:
        if not isinstance(node, yaml.SequenceNode):
            raise ScenarioError(f"{where} {name} must be a list, such as [1, 2], not {_said(node)}")
        for index, item in enumerate(node.value):
            _check(item, typing.get_args(schema)[0], f"{name}[{index}]", source)
    elif schema in _FITS and not (isinstance(node, yaml.ScalarNode) and _FITS[schema](node)):
        raise ScenarioError(f"{where} {name} must be {_WORDS[schema]}, not {_said(node)}")


def _check_keys(node: yaml.Node, schema: Any, name: str, source: str, where: str, others: list[Any]) -> None:
    """The same for a dataclass's keys; `others` are what the field could be by another tag."""
    fields = typing.get_type_hints(schema)
    known = [field.name for field in dataclasses.fields(schema)]
    if not isinstance(node, yaml.MappingNode):
        raise ScenarioError(f"{where} {name} must be a block of keys ({', '.join(known)}), not {_said(node)}")
    node.value = [(k, v) for k, v in node.value if v.value not in _FORMER.get(f"{name}.{k.value}", ())]
    seen: dict[str, int] = {}
    for index, (key_node, value_node) in enumerate(node.value):
        key = str(key_node.value)  # of what is no text only what is said about it
        path = key if name == "the scenario" else f"{name}.{key}"
        line = key_node.start_mark.line + 1
        if key in seen:
            raise ScenarioError(f"{source}: line {line}: {path!r} stands twice, in line {seen[key]} too")
        seen[key] = line
        if key not in known:
            for other in others:
                if key in typing.get_type_hints(other):
                    raise ScenarioError(
                        f"{source}: line {line}: {path!r} is a key of !{other.__name__}, and {name} has "
                        f"not that tag: write `{name}: !{other.__name__}`"
                    )
            near = difflib.get_close_matches(key, known, n=1)
            right = f"did you mean {near[0]!r}?" if near else f"the keys here are {', '.join(known)}"
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
    rest = [choice for choice in typing.get_args(schema) if choice is not type(None)]
    if node.tag.endswith(":null") and len(rest) < len(typing.get_args(schema)):
        return None
    return typing.Union[tuple(rest)]  # noqa: UP007  (of a number of types that is known only here)


_OF_PYTHON = "tag:yaml.org,2002:python"


def _variant(schema: Any, node: yaml.Node, name: str, where: str) -> Any:
    """Of a choice between dataclasses the one that a tag such as !Name asks for; the first without a tag."""
    if typing.get_origin(schema) not in (typing.Union, types.UnionType):
        if node.tag.startswith("!"):
            raise ScenarioError(f"{where} {name} has the unknown tag {node.tag}")
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
_WORDS = {
    bool: "true or false",
    int: "a whole number",
    float: "a number",
    str: "a text (a number is one in quotes)",
}


def _said(node: yaml.Node) -> str:
    if isinstance(node, yaml.ScalarNode):
        return repr(node.value)
    return "a list" if isinstance(node, yaml.SequenceNode) else "a block of keys"


def _nearest_file(path: Path) -> str:
    """A hint at a file of nearly the same name beside the one that is missing."""
    if not path.parent.is_dir():
        return f"; nor is the folder {path.parent}"
    return near_name(path, (".yaml", ".yml"))
