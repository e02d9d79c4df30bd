"""Writes a surface with one texture as a glTF 2.0 file: only there a material has a gloss for Drake."""

import base64
import json
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FLOAT, UNSIGNED_SHORT = 5126, 5123


@dataclass(frozen=True)
class Surface:
    """Triangles with a place on a texture for every vertex. Lengths in mm, z up."""

    vertices: NDArray  # [n, 3]
    normals: NDArray  # [n, 3]
    uv: NDArray  # [n, 2] in 0..1, from the upper left corner of the image
    faces: NDArray  # [m, 3], counterclockwise from outside


def joined(*surfaces: Surface) -> Surface:
    """One surface of several, on the same texture."""
    offsets = np.cumsum([0] + [len(surface.vertices) for surface in surfaces])
    return Surface(
        np.vstack([surface.vertices for surface in surfaces]),
        np.vstack([surface.normals for surface in surfaces]),
        np.vstack([surface.uv for surface in surfaces]),
        np.vstack([s.faces + offset for s, offset in zip(surfaces, offsets[:-1], strict=True)]),
    )


def gltf_text(surface: Surface, texture: str, roughness: float, metallic: float) -> str:
    """The file's text. `texture` is the image's name, beside it; roughness and metallic are 0 to 1."""
    position, normal = (_y_up(array) for array in (1e-3 * surface.vertices, surface.normals))
    arrays = [
        (np.round(position, 6).astype("<f4"), "VEC3", FLOAT),
        (np.round(normal, 3).astype("<f4"), "VEC3", FLOAT),
        (np.round(surface.uv, 5).astype("<f4"), "VEC2", FLOAT),
        (surface.faces.astype("<u2").ravel(), "SCALAR", UNSIGNED_SHORT),
    ]
    accessors: list[dict[str, object]] = [
        {"bufferView": k, "componentType": number, "count": len(array), "type": kind}
        for k, (array, kind, number) in enumerate(arrays)
    ]
    accessors[0] |= {end: getattr(arrays[0][0], end)(axis=0).tolist() for end in ("min", "max")}
    blobs = [array.tobytes() for array, _, _ in arrays]
    starts = np.cumsum([0] + [len(blob) for blob in blobs]).tolist()
    encoded = base64.b64encode(b"".join(blobs)).decode()
    content = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [
            {
                "primitives": [
                    {
                        "attributes": {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2},
                        "indices": 3,
                        "material": 0,
                    }
                ]
            }
        ],
        "materials": [
            {
                "pbrMetallicRoughness": {
                    "baseColorTexture": {"index": 0},
                    "metallicFactor": metallic,
                    "roughnessFactor": roughness,
                }
            }
        ],
        "textures": [{"source": 0}],
        "images": [{"uri": texture}],
        "accessors": accessors,
        "bufferViews": [
            {"buffer": 0, "byteOffset": start, "byteLength": len(blob)}
            for start, blob in zip(starts, blobs, strict=False)
        ],
        "buffers": [{"byteLength": starts[-1], "uri": f"data:application/octet-stream;base64,{encoded}"}],
    }
    return json.dumps(content, separators=(",", ":")) + "\n"


def _y_up(vectors: NDArray) -> NDArray:
    """glTF's y points up, ours is z."""
    return vectors[:, [0, 2, 1]] * (1.0, 1.0, -1.0)
