"""The pinhole camera: pixels to rays, points to pixels."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Intrinsics:
    """A pinhole camera without distortion; all in pixels, centre of the top left pixel at (0, 0)."""

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float

    @property
    def shape(self) -> tuple[int, int]:
        """(height, width), as numpy wants it."""
        return self.height, self.width


@lru_cache(maxsize=8)
def pixel_grid(height: int, width: int) -> NDArray[np.float32]:
    """Pixel coordinates (u, v) of every pixel, [H, W, 2]. Shared and read-only."""
    u, v = np.meshgrid(np.arange(width), np.arange(height))
    grid = np.stack([u, v], axis=-1).astype(np.float32)
    grid.flags.writeable = False
    return grid


@lru_cache(maxsize=8)
def rays(intrinsics: Intrinsics) -> NDArray[np.float32]:
    """The point at unit depth behind every pixel, [H, W, 3]. Shared and read-only."""
    uv = pixel_grid(intrinsics.height, intrinsics.width)
    directions = np.ones((*intrinsics.shape, 3), np.float32)
    directions[..., 0] = (uv[..., 0] - intrinsics.cx) / intrinsics.fx
    directions[..., 1] = (uv[..., 1] - intrinsics.cy) / intrinsics.fy
    directions.flags.writeable = False
    return directions


def rays_at(uv: NDArray, intrinsics: Intrinsics) -> NDArray:
    """The points at unit depth behind arbitrary pixels (u, v) [..., 2], [..., 3]."""
    x = (uv[..., 0] - intrinsics.cx) / intrinsics.fx
    y = (uv[..., 1] - intrinsics.cy) / intrinsics.fy
    return np.stack([x, y, np.ones_like(x)], axis=-1)


def back_project(depth: NDArray, intrinsics: Intrinsics) -> NDArray[np.float32]:
    """Points p_CQ [H, W, 3] in metres behind the pixels of a depth image [H, W]; 0 where invalid."""
    return rays(intrinsics) * depth[..., None].astype(np.float32)


Region = tuple[slice, slice]
"""A rectangle of an image: rows, columns."""


def bounding_region(mask: NDArray[np.bool_], margin: int = 0) -> Region:
    """The smallest rectangle around the pixels of a mask [H, W] that is not empty, and `margin` pixels."""
    rows, columns = np.flatnonzero(mask.any(1)), np.flatnonzero(mask.any(0))
    return (
        slice(max(0, int(rows[0]) - margin), min(mask.shape[0], int(rows[-1]) + margin + 1)),
        slice(max(0, int(columns[0]) - margin), min(mask.shape[1], int(columns[-1]) + margin + 1)),
    )


WHOLE: Region = (slice(None), slice(None))
"""The region that is the whole image."""


def project(p_CQ: NDArray, intrinsics: Intrinsics) -> NDArray:
    """Pixels (u, v) [..., 2] of points p_CQ [..., 3]; NaN for points not ahead of the camera."""
    z = p_CQ[..., 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        inverse_depth = np.where(z > 0, 1.0 / z, np.nan)
    u = p_CQ[..., 0] * inverse_depth * intrinsics.fx + intrinsics.cx
    v = p_CQ[..., 1] * inverse_depth * intrinsics.fy + intrinsics.cy
    return np.stack([u, v], axis=-1)
