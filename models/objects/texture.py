"""Painted images and the files that they and plain meshes are written to."""

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from riseg_drake.models.objects.patterns import Pattern

MM = 1e-3


def painted(
    chart: NDArray, pattern: Pattern, rng: np.random.Generator, resolution: float
) -> tuple[NDArray, NDArray]:
    """The painted image [h, w, 3] (RGB, 8 bit) over a mesh's chart, and its texture coordinates [n, 2] in 0..1.

    Args:
        chart: where each vertex lies on the flat texture, mm [n, 2].
        pattern: what to paint.
        rng: for the pattern.
        resolution: mm a texel.
    """
    low, high = chart.min(axis=0) - 1.0, chart.max(axis=0) + 1.0
    width, height = np.ceil((high - low) / resolution).astype(int)
    x = low[0] + (np.arange(width) + 0.5) * (high[0] - low[0]) / width
    y = high[1] - (np.arange(height) + 0.5) * (high[1] - low[1]) / height
    colour = pattern(np.stack(np.meshgrid(x, y), axis=-1), rng)
    # Six bits a channel: the eye and the camera see no difference, and the file is a third smaller.
    return (np.round(colour * 63.0) * (255.0 / 63.0)).astype(np.uint8), (chart - low) / (high - low)


def write_png(path: Path, image: NDArray) -> None:
    """Write an RGB image."""
    cv2.imwrite(str(path), image[..., ::-1], [cv2.IMWRITE_PNG_COMPRESSION, 9])


def plain_obj(vertices: NDArray, faces: NDArray) -> str:
    """The text of an OBJ file without a material; vertices in mm."""
    lines = [f"v {x:.5f} {y:.5f} {z:.5f}" for x, y, z in vertices * MM]
    lines += [f"f {a} {b} {c}" for a, b, c in faces + 1]
    return "\n".join(lines) + "\n"
