"""Pictures and lines of text that stand in Meshcat's scene, as cards.

Meshcat draws no text and no images by itself. A rectangle with a texture is one glTF file, which it does draw:
also in a replay.
"""

import json
from base64 import b64encode
from collections.abc import Mapping
from functools import cache
from io import BytesIO

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont
from pydrake.common import MemoryFile
from pydrake.geometry import InMemoryMesh, Mesh, Meshcat

from riseg_drake.pictures.object_colors import object_colors

_QUALITY = 80
"""Of a card's JPEG."""
_PAPER, _INK = (28, 31, 36), (245, 245, 245)
_LINES = 8
"""For which a board has room at full size, its title and the room around them among them."""
_TEXT = 30
"""Height of a line of text, pixels."""
_PAD = 10
"""Around a line of text, pixels."""


def set_card(meshcat: Meshcat, path: str, picture: NDArray[np.uint8], width: float) -> None:
    """A picture [H, W, 3] as a card `width` m wide, at its full brightness, whatever the lights.

    The card's frame has its origin in the middle, x to the right, z up; it is seen from -y.
    """
    file = BytesIO()
    Image.fromarray(picture).save(file, "jpeg", quality=_QUALITY)
    height = width * picture.shape[0] / picture.shape[1]
    gltf = MemoryFile(_gltf(file.getvalue(), width, height), ".gltf", path)
    meshcat.SetObject(path, Mesh(InMemoryMesh(mesh_file=gltf)))


def text_card(text: str, object_id: int) -> NDArray[np.uint8]:
    """A line of text [H, W, 3] behind a field in an object's colour."""
    font = _font(_TEXT)
    left, _, right, _ = font.getbbox(text)
    field = _TEXT
    picture = Image.new("RGB", (int(right - left) + field + 3 * _PAD, _TEXT + 2 * _PAD), _PAPER)
    draw = ImageDraw.Draw(picture)
    color = tuple(int(value) for value in object_colors(np.array(object_id)))
    draw.rectangle((0, 0, field + _PAD, picture.height), color)
    draw.text((field + 2 * _PAD - left, picture.height / 2), text, _INK, font, anchor="lm")
    return np.asarray(picture)


def with_caption(picture: NDArray[np.uint8], text: str) -> NDArray[np.uint8]:
    """A picture [H, W, 3] with a line of text below it [H + h, W, 3]; the text is made to fit."""
    height, width = picture.shape[:2]
    size = max(12, width // 16)
    bar = 2 * size
    font = _font(size)
    room = width - 1.5 * size
    # As it is drawn: whole pixels for each letter, which is more than its nominal length.
    while size > 8 and font.getbbox(text)[2] > room:
        size -= 1
        font = _font(size)
    card = Image.new("RGB", (width, height + bar), _PAPER)
    card.paste(Image.fromarray(picture))
    ImageDraw.Draw(card).text((bar * 3 / 8, height + bar / 2), text, _INK, font, anchor="lm")
    return np.asarray(card)


def board(title: str, rows: Mapping[int, str], shape: tuple[int, int]) -> NDArray[np.uint8]:
    """A card [H, W, 3] of a `shape` H, W, with a line for each object behind a field in its colour; all of them
    fit, and one that is alone is no larger than the title."""
    height, width = shape
    line = height / max(_LINES, len(rows) + 2)
    size = line / 2
    widest = max((_font(size).getbbox(text)[2] for text in (title, *rows.values())), default=0)
    font = _font(min(size, size * (width - 3 * line) / max(widest, 1)))
    card = Image.new("RGB", (width, height), _PAPER)
    draw = ImageDraw.Draw(card)
    draw.text((line / 2, line), title, _INK, font, anchor="lm")
    for number, (object_id, text) in enumerate(rows.items()):
        y = (number + 1.5) * line
        color = tuple(int(value) for value in object_colors(np.array(object_id)))
        draw.rectangle((line / 2, y + line / 8, 1.25 * line, y + line * 7 / 8), color)
        draw.text((1.75 * line, y + line / 2), text, _INK, font, anchor="lm")
    return np.asarray(card)


@cache
def _font(size: float) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    return ImageFont.load_default(size)


def _gltf(jpeg: bytes, width: float, height: float) -> str:
    """A rectangle about the origin, width and height in m, under an image."""
    x, y = width / 2, height / 2
    corners = np.array([[-x, -y, 0], [x, -y, 0], [x, y, 0], [-x, y, 0]], "<f4")
    texture = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], "<f4")  # glTF counts an image's rows from above
    triangles = np.array([0, 1, 2, 0, 2, 3], "<u2")
    parts = [corners.tobytes(), texture.tobytes(), triangles.tobytes()]
    starts = np.cumsum([0, *map(len, parts)])
    views = [
        {"buffer": 0, "byteOffset": int(at), "byteLength": len(part)}
        for at, part in zip(starts, parts, strict=False)
    ]
    ends = {"min": corners.min(axis=0).tolist(), "max": corners.max(axis=0).tolist()}
    return json.dumps(
        {
            "asset": {"version": "2.0"},
            "extensionsUsed": ["KHR_materials_unlit"],
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0}],
            "meshes": [
                {"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2, "material": 0}]}
            ],
            "materials": [
                {
                    "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}},
                    "extensions": {"KHR_materials_unlit": {}},
                    "doubleSided": True,
                }
            ],
            "textures": [{"source": 0}],
            "images": [{"uri": _data("image/jpeg", jpeg)}],
            "accessors": [
                {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", **ends},
                {"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2"},
                {"bufferView": 2, "componentType": 5123, "count": 6, "type": "SCALAR"},
            ],
            "bufferViews": views,
            "buffers": [
                {"byteLength": int(starts[-1]), "uri": _data("application/octet-stream", b"".join(parts))}
            ],
        }
    )


def _data(kind: str, data: bytes) -> str:
    return f"data:{kind};base64,{b64encode(data).decode()}"
