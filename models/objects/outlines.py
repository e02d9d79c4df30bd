"""Silhouettes of toys, drawn as strokes and polygons, traced into closed curves. All lengths in mm.

A drawing is a signed distance field (negative inside) as a function of points [..., 2]; its parts are
joined with `union`, cut with `minus`, and `trace` turns the result into loops: one outer curve,
counterclockwise, and one clockwise curve for each hole.
"""

from collections.abc import Callable, Sequence
from itertools import pairwise

import cv2
import numpy as np
from numpy.typing import NDArray

Field = Callable[[NDArray], NDArray]
RASTER = 0.25  # mm a pixel while tracing; a tenth of the spacing of the traced points


def stroke(*nodes: tuple[float, float, float]) -> Field:
    """A brush stroke through nodes (x, y, radius), its width interpolated between them."""

    def field(points: NDArray) -> NDArray:
        distance = np.full(points.shape[:-1], np.inf)
        for start, end in pairwise(nodes):
            a, b = np.array(start[:2]), np.array(end[:2])
            along = np.clip((points - a) @ (b - a) / np.dot(b - a, b - a), 0.0, 1.0)
            spine = a + along[..., None] * (b - a)
            radius = start[2] + along * (end[2] - start[2])
            distance = np.minimum(distance, np.linalg.norm(points - spine, axis=-1) - radius)
        return distance

    return field


def disc(x: float, y: float, radius: float) -> Field:
    """A disc."""
    return lambda points: np.linalg.norm(points - (x, y), axis=-1) - radius


def ellipse(x: float, y: float, a: float, b: float, degrees: float = 0.0) -> Field:
    """An ellipse with half axes a, b; the field is exact on the curve and about right near it."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))

    def field(points: NDArray) -> NDArray:
        q = (points - (x, y)) @ np.array([[c, -s], [s, c]])
        level = np.hypot(q[..., 0] / a, q[..., 1] / b)
        slope = np.hypot(q[..., 0] / a**2, q[..., 1] / b**2)
        return (level - 1.0) * level / np.maximum(slope, 1e-9)

    return field


def polygon(corners: Sequence[tuple[float, float]], rounding: float = 0.0) -> Field:
    """A polygon, grown by `rounding` so that its corners are arcs of that radius."""
    loop = np.array(corners, float)
    return lambda points: -inward_distance(points, [loop])[0] - rounding


def arc(x: float, y: float, radius: float, begin: float, end: float, widths: Sequence[float]) -> Field:
    """A stroke along a circular arc from `begin` to `end` degrees, its half widths spread evenly."""
    angles = np.radians(np.linspace(begin, end, len(widths)))
    nodes = [(x + radius * np.cos(t), y + radius * np.sin(t), w) for t, w in zip(angles, widths, strict=True)]
    return stroke(*nodes)


def union(*fields: Field) -> Field:
    """Everything that is in any of the fields."""
    return lambda points: np.min([field(points) for field in fields], axis=0)


def minus(field: Field, *holes: Field) -> Field:
    """What is in `field` and in none of the holes."""
    return lambda points: np.maximum(field(points), -union(*holes)(points))


def inward_distance(points: NDArray, loops: Sequence[NDArray]) -> tuple[NDArray, NDArray]:
    """Distance [...] of points [..., 2] to the loops, positive inside, and nearest points [..., 2]."""
    flat = points.reshape(-1, 2)
    best = np.full(len(flat), np.inf)
    nearest = np.zeros_like(flat)
    inside = np.zeros(len(flat), bool)
    for loop in loops:
        for a, b in zip(loop, np.roll(loop, -1, axis=0), strict=True):
            along = np.clip((flat - a) @ (b - a) / np.dot(b - a, b - a), 0.0, 1.0)
            foot = a + along[:, None] * (b - a)
            distance = np.hypot(*(flat - foot).T)
            closer = distance < best
            best[closer], nearest[closer] = distance[closer], foot[closer]
            straddles = (a[1] > flat[:, 1]) != (b[1] > flat[:, 1])
            with np.errstate(divide="ignore", invalid="ignore"):
                x_crossing = a[0] + (flat[:, 1] - a[1]) * (b[0] - a[0]) / (b[1] - a[1])
            inside ^= straddles & (flat[:, 0] < x_crossing)
    signed = np.where(inside, best, -best)
    return signed.reshape(points.shape[:-1]), nearest.reshape(points.shape)


def trace(field: Field, softening: float = 1.2, spacing: float = 2.8, reach: float = 75.0) -> list[NDArray]:
    """The closed curves [n, 2] around a drawing, its corners softened, a point every `spacing` mm."""
    axis = np.arange(-reach, reach, RASTER)
    distance = field(np.stack(np.meshgrid(axis, axis), axis=-1))
    soft = cv2.GaussianBlur(distance, (0, 0), softening / RASTER)
    contours, hierarchy = cv2.findContours((soft < 0).astype(np.uint8), cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    outer = max((i for i in range(len(contours)) if hierarchy[0, i, 3] < 0), key=lambda i: len(contours[i]))
    holes = [i for i in range(len(contours)) if hierarchy[0, i, 3] == outer and len(contours[i]) > 40]
    loops = []
    for i in [outer, *holes]:
        curve = _smooth(contours[i][:, 0].astype(float) * RASTER - reach, sigma=4.0)
        curve = _resample(curve, spacing)
        if (signed_area(curve) > 0) != (i == outer):
            curve = curve[::-1]
        loops.append(np.round(curve, 2))
    return loops


def signed_area(loop: NDArray) -> float:
    """Area inside a loop, positive if it runs counterclockwise."""
    x, y = loop.T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def _smooth(curve: NDArray, sigma: float) -> NDArray:
    """Take the pixel steps out of a closed contour by a periodic Gaussian of `sigma` samples."""
    offsets = np.arange(-int(4 * sigma), int(4 * sigma) + 1)
    weights = np.exp(-0.5 * (offsets / sigma) ** 2)
    shifted = np.stack([np.roll(curve, -k, axis=0) for k in offsets])
    return np.tensordot(weights / weights.sum(), shifted, axes=1)


def _resample(curve: NDArray, spacing: float) -> NDArray:
    """Points at equal arc length along a closed curve."""
    closed = np.vstack([curve, curve[:1]])
    length = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(closed, axis=0).T))])
    stations = np.linspace(0.0, length[-1], round(length[-1] / spacing), endpoint=False)
    return np.stack([np.interp(stations, length, closed[:, k]) for k in range(2)], axis=-1)
