"""The door for model files (URDF, SDF, MJCF): whole XML of a size that can be, before Drake's parsers see it.

These end the whole process at some damage, follow a pipe for ever, and go down a tree without an end.
"""

import json
import logging
import os
import re
import stat
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import unquote
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
MOST_SEARCHED = 2**26
"""Bytes of a mesh in which the names of its materials are looked for; they stand near the beginning."""
_BESIDE = {
    ".obj": re.compile(rb"^[ \t]*mtllib[ \t]+([^\r\n]+)", re.M),
    ".mtl": re.compile(rb"^[ \t]*(?:map_|bump|norm|disp)\w*[ \t]+([^\r\n]+)", re.M),
}
"""What files with these endings name beside them."""


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


def check_model(path: Path, packages: Mapping[str, Path] | None = None) -> None:
    """Raise ModelFileError unless a file holds XML that a parser of models can be given, and its meshes, with
    all that these name, are, where they are there, files of a size that can be.

    `packages` are the folders of `package://NAME/` and `model://NAME/`, by name; others are left to Drake.
    """
    for uri in _uris(path):
        mesh = _place(path, uri.strip(), packages or {})
        if mesh is None:
            continue
        _check_part(mesh, "mesh")
        for part in _beside(mesh):
            _check_part(part, "mesh's part")
            for texture in _beside(part) if part.suffix.lower() == ".mtl" else []:
                _check_part(texture, "mesh's part")


def _uris(path: Path) -> list[str]:
    """All that a model may name in a file of XML. Raises ModelFileError for one that no parser may be given."""
    try:
        content = read_bytes(path, MOST_BYTES)
    except FileError as error:
        raise ModelFileError(str(error).removeprefix(f"{path} ")) from None
    depth = 0
    words: list[str] = []
    uris: list[str] = []

    def begin(name: str, attributes: dict[str, str]) -> None:
        nonlocal depth
        depth += 1
        if depth > DEEPEST:
            raise ModelFileError("its elements are nested too deeply")
        if len(attributes.get("name", "")) > LONGEST_NAME:
            raise ModelFileError(f"a name in it has more than {LONGEST_NAME} letters")
        uris.extend(attributes[key] for key in ("filename", "file") if key in attributes)

    def end(name: str) -> None:
        nonlocal depth
        depth -= 1
        if name == "uri":
            uris.append("".join(words))
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
    return uris


def _place(model: Path, uri: str, packages: Mapping[str, Path]) -> Path | None:
    """Where the file lies that a URI names; None where Drake must find it."""
    scheme, separator, rest = uri.partition("://")
    if not separator:
        return model.parent / uri if uri else None
    if scheme == "file":
        return model.parent / rest
    name, _, inside = rest.partition("/")
    return packages[name] / inside if scheme in ("package", "model") and name in packages and inside else None


def _check_part(path: Path, what: str) -> None:
    """Raise ModelFileError where a mesh, or what one names, is there and is nothing that can be read."""
    try:
        found = os.stat(path)
    except (OSError, ValueError):
        return  # Drake says that it is missing
    if stat.S_ISDIR(found.st_mode):
        return  # a model that is included; as a mesh Drake refuses it
    if not stat.S_ISREG(found.st_mode):
        raise ModelFileError(f"its {what} {path} is not a file")
    if found.st_size > MOST_MESH_BYTES:
        raise ModelFileError(f"its {what} {path} is larger than {MOST_MESH_BYTES / 2**20:g} MB")


def _beside(mesh: Path) -> list[Path]:
    """Materials, textures and buffers that a mesh or a material names."""
    ending = mesh.suffix.lower()
    if ending not in (*_BESIDE, ".gltf"):
        return []
    try:
        content = read_bytes(mesh, MOST_MESH_BYTES, first=MOST_SEARCHED)
        if ending == ".gltf":
            return [mesh.parent / unquote(uri) for uri in _gltf_uris(json.loads(content))]
    except (FileError, ValueError, RecursionError):
        return []  # whoever reads it says what is wrong
    names = [os.fsdecode(name.strip()) for name in _BESIDE[ending].findall(content)]
    # Before the name of a texture there may be options, and in it spaces.
    return [mesh.parent / name for said in names for name in {said, said.rpartition(" ")[2]}]


def _gltf_uris(content: object) -> list[str]:
    """What buffers and images of glTF name; data that stands in the file itself is left out."""
    parts = [content.get(key) for key in ("buffers", "images")] if isinstance(content, dict) else []
    entries = [entry for part in parts if isinstance(part, list) for entry in part if isinstance(entry, dict)]
    uris = [entry.get("uri") for entry in entries]
    return [uri for uri in uris if isinstance(uri, str) and not uri.startswith("data:")]
