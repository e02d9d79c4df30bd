"""Paint for the toys: functions of a point on the flat texture, in mm, that give a colour.

A pattern is called as `pattern(points, rng)` with points [..., 2] and returns RGB [..., 3] in 0..1. All
toys share one small palette, so that colour says little about where one toy ends and the next begins.
"""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates
from scipy.spatial import cKDTree

Pattern = Callable[[NDArray, np.random.Generator], NDArray]

PALETTE = {
    "cream": (0.95, 0.89, 0.76),
    "yellow": (0.94, 0.74, 0.22),
    "orange": (0.88, 0.47, 0.15),
    "red": (0.75, 0.19, 0.16),
    "brown": (0.42, 0.24, 0.13),
    "black": (0.13, 0.12, 0.13),
    "green": (0.36, 0.55, 0.23),
    "teal": (0.13, 0.50, 0.52),
    "pink": (0.91, 0.55, 0.60),
    "violet": (0.33, 0.19, 0.38),
}


def paint(names: Sequence[str], index: NDArray) -> NDArray:
    """Colours [..., 3] of an integer field [...], counted around the given names."""
    return np.array([PALETTE[name] for name in names])[np.asarray(index).astype(int) % len(names)]


def plain(name: str) -> Pattern:
    """One colour, no texture at all."""
    return lambda points, rng: paint([name], np.zeros(points.shape[:-1], int))


def cells(size: float, joint: float, names: Sequence[str], joint_name: str) -> Pattern:
    """Irregular cells about `size` mm wide with joints between them: a giraffe, crazy paving."""

    def pattern(points: NDArray, rng: np.random.Generator) -> NDArray:
        seeds = _scatter(points, size, 0.38, rng)
        distance, nearest = cKDTree(seeds).query(points, k=2)
        colour = paint(names, rng.integers(0, len(names), len(seeds))[nearest[..., 0]])
        return np.where((distance[..., 1] - distance[..., 0] < joint)[..., None], PALETTE[joint_name], colour)

    return pattern


def spots(base: Pattern, pitch: float, radius: float, names: Sequence[str], ring: str | None = None) -> Pattern:
    """Round spots over a base pattern; `ring` gives each a broken ring: a leopard's rosettes."""

    def pattern(points: NDArray, rng: np.random.Generator) -> NDArray:
        image = base(points, rng)
        centres = _scatter(points, pitch, 0.3, rng)
        distance, nearest = cKDTree(centres).query(points)
        size = radius * rng.uniform(0.65, 1.15, len(centres))[nearest]
        distance = distance * (1.0 + 0.25 * _noise(points, radius, rng))
        colour = paint(names, rng.integers(0, len(names), len(centres))[nearest])
        if ring is not None:
            rim = (distance < size) & (distance > 0.55 * size) & (_noise(points, radius, rng) > -0.35)
            image = np.where((distance < size)[..., None], colour, image)
            return np.where(rim[..., None], PALETTE[ring], image)
        return np.where((distance < size)[..., None], colour, image)

    return pattern


def stripes(width: float, names: Sequence[str], degrees: float = 0.0, waviness: float = 0.0) -> Pattern:
    """Stripes `width` mm wide across the direction `degrees`, wandering by `waviness` mm."""
    direction = np.array([np.cos(np.radians(degrees)), np.sin(np.radians(degrees))])

    def pattern(points: NDArray, rng: np.random.Generator) -> NDArray:
        along = points @ direction + waviness * _noise(points, 2.5 * width, rng)
        return paint(names, np.floor(along / width))

    return pattern


def rings(
    width: float, names: Sequence[str], centre: tuple[float, float] = (0, 0), waviness: float = 0.0
) -> Pattern:
    """Concentric rings."""

    def pattern(points: NDArray, rng: np.random.Generator) -> NDArray:
        radius = np.linalg.norm(points - centre, axis=-1) + waviness * _noise(points, 2.5 * width, rng)
        return paint(names, np.floor(radius / width))

    return pattern


def scales(size: float, names: Sequence[str], joint_name: str) -> Pattern:
    """Overlapping round scales in staggered rows, with a dark lower edge."""

    def pattern(points: NDArray, rng: np.random.Generator) -> NDArray:
        image = np.zeros((*points.shape[:-1], 3))
        table = rng.integers(0, len(names), 4096)
        first = np.floor(points[..., 0] / size).astype(int)
        for step in (2, 1, 0, -1):  # the scale on the left lies over its right neighbour
            column = first + step
            row = np.floor(points[..., 1] / size + 0.5 * (column % 2)).astype(int)
            centre_y = (row + 0.5 - 0.5 * (column % 2)) * size
            distance = np.hypot(points[..., 0] - (column - 0.5) * size, points[..., 1] - centre_y) / size
            colour = paint(names, table[(column * 37 + row * 101) % 4096])
            colour = np.where((distance > 0.78)[..., None], PALETTE[joint_name], colour)
            image = np.where((distance < 0.95)[..., None], colour, image)
        return image

    return pattern


def sprinkles(base: Pattern, pitch: float, length: float, thickness: float, names: Sequence[str]) -> Pattern:
    """Short rods strewn over a base pattern."""

    def pattern(points: NDArray, rng: np.random.Generator) -> NDArray:
        image = base(points, rng)
        centres = _scatter(points, pitch, 0.3, rng)
        angles = rng.uniform(0.0, np.pi, len(centres))
        half = 0.5 * length * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
        colours = rng.integers(0, len(names), len(centres))
        _, near = cKDTree(centres).query(points, k=3)
        for k in range(3):
            i = near[..., k]
            offset = points - centres[i]
            along = np.clip(np.sum(offset * half[i], axis=-1) / (0.25 * length**2), -1.0, 1.0)
            distance = np.linalg.norm(offset - along[..., None] * half[i], axis=-1)
            image = np.where((distance < 0.5 * thickness)[..., None], paint(names, colours[i]), image)
        return image

    return pattern


def wedges(number: int, base: Sequence[str], spoke: str, radii: Sequence[float], rim: Sequence[str]) -> Pattern:
    """A cut citrus: `number` wedges with spokes between them, then a band of rim beyond each radius."""

    def pattern(points: NDArray, rng: np.random.Generator) -> NDArray:
        radius = np.hypot(*np.moveaxis(points, -1, 0)) + 0.6 * _noise(points, 5.0, rng)
        turn = np.arctan2(points[..., 1], points[..., 0]) / (2.0 * np.pi) * number
        image = paint(base, np.floor(turn + 0.5))
        from_spoke = np.abs(turn - 0.5 - np.round(turn - 0.5)) / number * 2.0 * np.pi * radius
        image = np.where((from_spoke < 0.9)[..., None], PALETTE[spoke], image)
        for limit, name in zip(radii, rim, strict=True):
            image = np.where((radius > limit)[..., None], PALETTE[name], image)
        return image

    return pattern


def zoned(parts: Sequence[tuple[Callable[[NDArray], NDArray], Pattern]], elsewhere: Pattern) -> Pattern:
    """Other patterns where a drawing's signed distance is negative: a crust, a cap, a rind."""

    def pattern(points: NDArray, rng: np.random.Generator) -> NDArray:
        image = elsewhere(points, rng)
        for field, inside in parts:
            image = np.where((field(points) < 0)[..., None], inside(points, rng), image)
        return image

    return pattern


def grained(base: Pattern, strength: float = 0.1, size: float = 2.0) -> Pattern:
    """A base pattern with soft mottling, `size` mm across, as of wood or wool."""

    def pattern(points: NDArray, rng: np.random.Generator) -> NDArray:
        image = base(points, rng)
        mottle = 0.65 * _noise(points, size, rng) + 0.35 * _noise(points, 4.0 * size, rng)
        return np.clip(image * (1.0 + strength * mottle[..., None]), 0.0, 1.0)

    return pattern


def _scatter(points: NDArray, pitch: float, jitter: float, rng: np.random.Generator) -> NDArray:
    """A hexagonal lattice that covers the points, each node moved by up to `jitter` pitches."""
    low, high = (
        points.reshape(-1, 2).min(axis=0) - 2 * pitch,
        points.reshape(-1, 2).max(axis=0) + 2 * pitch,
    )
    rows = int((high[1] - low[1]) / (0.866 * pitch)) + 1
    columns = int((high[0] - low[0]) / pitch) + 1
    row, column = np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij")
    lattice = np.stack([low[0] + pitch * (column + 0.5 * (row % 2)), low[1] + 0.866 * pitch * row], axis=-1)
    return lattice.reshape(-1, 2) + rng.uniform(-jitter, jitter, (rows * columns, 2)) * pitch


def _noise(points: NDArray, size: float, rng: np.random.Generator) -> NDArray:
    """Smooth noise in -1..1 with features about `size` mm across."""
    low = points.reshape(-1, 2).min(axis=0)
    where = (points - low) / size + 1.0
    shape = tuple(int(v) + 4 for v in where.reshape(-1, 2).max(axis=0))
    lattice = rng.uniform(-1.0, 1.0, shape)
    return map_coordinates(lattice, np.moveaxis(where, -1, 0), order=2, mode="nearest")
