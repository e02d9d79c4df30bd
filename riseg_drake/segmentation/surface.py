"""Some pixels of one view, ready to be sought in another one: under this motion, and that, and that."""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.camera import Intrinsics, pixel_grid
from riseg_drake.geometry.rgbd import Immutable
from riseg_drake.segmentation.expected_flow import pixel_projection

_ROW = 256
"""Pixels are handed to OpenCV in rows of so many: it wants images, and none longer than 32767."""


@dataclass(frozen=True)
class SurfacePixels(Immutable):
    """N pixels of a view C0 that all have depth."""

    index: NDArray[np.intp]
    """[N], the pixels' places in the image, row by row."""
    depth: NDArray[np.float32]
    """[N], m."""
    intrinsics: Intrinsics
    homogeneous: NDArray[np.float32]
    """[4, R * 256], (u, v, 1, 1 / z), the last ones repeated to fill whole rows."""

    def __len__(self) -> int:
        """The number of pixels N."""
        return len(self.depth)

    @cached_property
    def pixel(self) -> NDArray[np.intp]:
        """[2, N], (v, u)."""
        return np.stack(np.divmod(self.index, self.intrinsics.width))

    def subset(self, which: NDArray[np.intp]) -> "SurfacePixels":
        """Some of the pixels, by their numbers [N]."""
        return _rows_of_pixels(self.index.take(which), self.depth.take(which), self.intrinsics)


@dataclass(frozen=True)
class Sought:
    """Where the pixels of a `SurfacePixels` appear in another view C1."""

    u: NDArray[np.float32]
    """[R, 256], pixels."""
    v: NDArray[np.float32]
    """[R, 256], pixels."""
    depth: NDArray[np.float32]
    """[N], m; not positive for points that are not ahead of C1."""

    def slope(self, image: NDArray[np.float32]) -> NDArray[np.float32]:
        """By how much an image of C1 rises there along u and along v [2, N], a pixel; NaN where it cannot be
        read one pixel to both sides."""
        u = np.concatenate([self.u + 1, self.u, self.u - 1, self.u])
        v = np.concatenate([self.v, self.v + 1, self.v, self.v - 1])
        values = _between(image, u, v).reshape(2, 2, -1)[..., : len(self.depth)]
        return np.float32(0.5) * (values[0] - values[1])

    def inside(self, shape: tuple[int, int]) -> NDArray[np.bool_]:
        """Which of them [N] an image of some rows and columns shows."""
        u, v = (x.ravel()[: len(self.depth)] for x in (self.u, self.v))
        return (u >= 0) & (v >= 0) & (u <= shape[1] - 1) & (v <= shape[0] - 1)

    def read(self, image: NDArray, outside: float = 0) -> NDArray:
        """The values [N] of the nearest pixels of an image of C1; `outside` beyond its edges."""
        values = cv2.remap(
            image, self.u, self.v, cv2.INTER_NEAREST, borderMode=cv2.BORDER_CONSTANT, borderValue=outside
        )
        return values.ravel()[: len(self.depth)]

    def read_between(self, image: NDArray[np.float32]) -> NDArray[np.float32]:
        """The values [N] of an image of C1, interpolated; NaN beyond its edges and beside any NaN."""
        return _between(image, self.u, self.v).ravel()[: len(self.depth)]


def _between(image: NDArray[np.float32], u: NDArray[np.float32], v: NDArray[np.float32]) -> NDArray[np.float32]:
    """The values [R, 256] of an image between its pixels; NaN beyond its edges."""
    return cv2.remap(image, u, v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=float("nan"))


def surface_pixels(
    mask: NDArray[np.bool_], depth: NDArray[np.float32], intrinsics: Intrinsics
) -> SurfacePixels:
    """The pixels of a mask [H, W] that have depth [H, W] (m, 0 = none), row by row."""
    index = np.flatnonzero(mask & (depth > 0))
    return _rows_of_pixels(index, depth.ravel().take(index), intrinsics)


def _rows_of_pixels(
    index: NDArray[np.intp], depth: NDArray[np.float32], intrinsics: Intrinsics
) -> SurfacePixels:
    count = len(depth)
    homogeneous = np.ones((4, -(-max(count, 1) // _ROW) * _ROW), np.float32)
    for row, places in zip(homogeneous, _places(*intrinsics.shape), strict=False):
        row[:count] = places.take(index)
    np.divide(1, depth, out=homogeneous[3, :count])
    return SurfacePixels(index, depth, intrinsics, homogeneous)


@lru_cache(maxsize=8)
def _places(height: int, width: int) -> NDArray[np.float32]:
    """u and v [2, H * W] of all pixels, row by row."""
    return np.ascontiguousarray(pixel_grid(height, width).reshape(-1, 2).T)


def seek(pixels: SurfacePixels, X_C1C0: NDArray[np.float64], depth_factor: float = 1.0) -> Sought:
    """Where the points behind some pixels of C0 appear in C1, if X_C1C0 [4, 4] takes them there.

    Their depth is really the measured one by a factor.
    """
    projection = pixel_projection(X_C1C0, pixels.intrinsics)
    projection[:, 3] /= depth_factor
    a, b, c = projection @ pixels.homogeneous
    depth = pixels.depth * np.float32(depth_factor) * c[: len(pixels)]
    if c.min() <= 0:
        # What is not ahead of the camera is sought far outside the image.
        a, b, c = np.where(c > 0, (a, b, c), np.array([[-1e4], [-1e4], [1]], np.float32))
    a /= c
    b /= c
    return Sought(a.reshape(-1, _ROW), b.reshape(-1, _ROW), depth)
