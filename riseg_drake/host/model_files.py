"""The door for model files (URDF, SDF, MJCF): whole XML of a size that can be, before Drake's parsers see it.

These end the whole process at some damage, follow a pipe for ever, and go down a tree without an end.
"""

import logging
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from xml.parsers import expat

from riseg_drake.host.files import FileError, read_bytes
from riseg_drake.host.terminal import one_line

MOST_BYTES = 2**25
"""Of one file; meshes lie beside it."""
MOST_MESH_BYTES = 2**29
"""Of a mesh."""
DEEPEST = 100
"""Elements in each other."""
LONGEST_NAME = 1000
"""Letters; on much longer ones the parsers' stack runs over."""


class ModelFileError(ValueError):
    """Why a file is no model, in a few words without its name."""


@contextmanager
def reading_model(path: Path) -> Iterator[None]:
    """For Drake's parsers to read a file in a `with`. Raises ModelFileError for what is wrong with it.

    Some faults they only log, and go on with something of their own in the place of what they could not read;
    an inertia that no body can have is but a warning to them.
    """
    check_model(path)
    errors: list[str] = []

    def hear(record: logging.LogRecord) -> bool:
        said = one_line(record.getMessage())
        if record.levelno >= logging.ERROR or "invalid" in said:
            errors.append(said)
            return False
        record.msg, record.args = said, ()
        return True

    drake = logging.getLogger("drake")
    drake.addFilter(hear)
    try:
        yield
    finally:
        drake.removeFilter(hear)
    if errors:
        raise ModelFileError(errors[0])


def check_model(path: Path) -> None:
    """Raise ModelFileError unless a file holds XML that a parser of models can be given, and its meshes, where
    they are there, are files of a size that can be."""
    try:
        content = read_bytes(path, MOST_BYTES)
    except FileError as error:
        raise ModelFileError(str(error).removeprefix(f"{path} ")) from None
    depth = 0
    words: list[str] = []

    def begin(name: str, attributes: dict[str, str]) -> None:
        nonlocal depth
        depth += 1
        if depth > DEEPEST:
            raise ModelFileError("its elements are nested too deeply")
        if len(attributes.get("name", "")) > LONGEST_NAME:
            raise ModelFileError(f"a name in it has more than {LONGEST_NAME} letters")
        for mesh in (attributes.get("filename", ""), attributes.get("file", "")):
            _check_mesh(path, mesh)

    def end(name: str) -> None:
        nonlocal depth
        depth -= 1
        if name == "uri":
            _check_mesh(path, "".join(words))
        words.clear()

    def declare(*_: object) -> None:
        raise ModelFileError("it declares entities of its own, which no model needs")

    parser = expat.ParserCreate()
    parser.StartElementHandler, parser.EndElementHandler, parser.EntityDeclHandler = begin, end, declare
    parser.CharacterDataHandler = words.append
    try:
        parser.Parse(content, True)
    except expat.ExpatError as error:
        raise ModelFileError(f"it is not whole XML ({error})") from None


def _check_mesh(model: Path, uri: str) -> None:
    """Raise ModelFileError where a mesh that is named by its path is there and is no file that can be read."""
    path = model.parent / uri.strip().removeprefix("file://")
    if not uri.strip() or "://" in uri.removeprefix("file://"):
        return  # of a package, which Drake finds
    try:
        found = os.stat(path)
    except (OSError, ValueError):
        return  # Drake says that it is missing
    if not stat.S_ISREG(found.st_mode):
        raise ModelFileError(f"its mesh {path} is not a file")
    if found.st_size > MOST_MESH_BYTES:
        raise ModelFileError(f"its mesh {path} is larger than {MOST_MESH_BYTES / 2**20:g} MB")
