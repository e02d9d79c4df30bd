"""Where things stand on a table: loosely, flush, in a crowd. Shapes seen from above, in metres.

Each comes in along a straight line from outside until it touches what lies there already; of a number of
ways in, the one that ends nearest to the middle is taken.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from riseg_drake.stations.footprint import Footprint, separation, travel

CLEAR = 1e-4  # m; smallest gap, so that nothing starts inside its neighbour
TRIES = 24  # ways in that are compared for each object
SLIDES = 6  # of them, the best, that are followed to a second contact
Spot = tuple[float, NDArray]
"""A yaw, rad, and a place (x, y), m."""


@dataclass(frozen=True)
class Habit:
    """How things of a layout come in."""

    right_angles: bool = False
    """Turned and moved along two directions only, sides parallel: boxes put away."""
    slides: bool = False
    """Once it touches, a thing slides along until it touches a second one, if there is any on its way."""


def lay_out(
    shapes: Sequence[Footprint], gaps: Iterable[float], habit: Habit, rng: np.random.Generator
) -> list[Spot] | None:
    """A spot for each shape; None where one of them found no room.

    Args:
        shapes: footprints about their bodies' origins.
        gaps: how far each stays away from what it meets, m; asked for one by one: they may be drawn.
        habit: how they come in.
        rng: draws them.
    """
    spots: list[Spot] = []
    prints: list[Footprint] = []
    grid = rng.uniform(-np.pi, np.pi) if habit.right_angles else 0.0
    for shape, wanted in zip(shapes, gaps, strict=True):
        gap = max(wanted, CLEAR)
        square = grid - main_direction(shape) if habit.right_angles else 0.0
        if not prints:
            yaw = square if habit.right_angles else rng.uniform(-np.pi, np.pi)
            spots.append((yaw, np.zeros(2)))
            prints.append(shape.moved(*spots[0]))
            continue
        middle = np.mean([p.corners().mean(axis=0) for p in prints], axis=0)
        ways = []
        for _ in range(TRIES):
            if habit.right_angles:
                yaw, heading = np.array([square, grid]) + rng.integers(0, 4, 2) * np.pi / 2
            else:
                yaw, heading = rng.uniform(-np.pi, np.pi, 2)
            direction = np.array([np.cos(heading), np.sin(heading)])
            start = middle + rng.uniform(-0.03, 0.03, 2) - direction
            outside = shape.moved(yaw, start)
            way = min(travel(outside, other, direction) for other in prints)
            if np.isfinite(way):
                touch = start + way * direction
                extent = np.linalg.norm(outside.corners() - start + touch - middle, axis=1).max()
                ways.append((float(extent), yaw, touch, direction))
        found: list[tuple[float, Spot]] = []
        for extent, yaw, touch, direction in sorted(ways, key=lambda way: way[0]):
            spot = _step_back(shape, prints, yaw, touch, direction, gap)
            if spot is None:
                continue
            if habit.slides:
                spot = _slide(shape, prints, yaw, spot, direction, gap, middle)
                extent = float(np.linalg.norm(shape.moved(yaw, spot).corners() - middle, axis=1).max())
            found.append((extent, (yaw, spot)))
            if len(found) == (SLIDES if habit.slides else 1):
                break
        if not found:
            return None
        spots.append(min(found, key=lambda each: each[0])[1])
        prints.append(shape.moved(*spots[-1]))
    return spots


def centred(
    spots: Sequence[Spot], shapes: Sequence[Footprint], centre_W: Sequence[float], radius: float
) -> list[Spot] | None:
    """The spots moved into the middle of the work area; None if they reach out of its radius, m."""
    corners = np.vstack([shape.moved(*spot).corners() for shape, spot in zip(shapes, spots, strict=True)])
    middle = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
    if np.linalg.norm(corners - middle, axis=1).max() > radius - 0.001:
        return None
    return [(yaw, xy - middle + np.array(centre_W)) for yaw, xy in spots]


def main_direction(shape: Footprint) -> float:
    """Which way the smallest rectangle around a shape lies, rad: along one of the sides of its hull."""
    corners = shape.corners()
    hull = corners[ConvexHull(corners).vertices]
    sides = np.roll(hull, -1, axis=0) - hull
    sides = sides[np.linalg.norm(sides, axis=1) > 1e-6]
    angles = np.arctan2(sides[:, 1], sides[:, 0])
    along = np.stack([np.cos(angles), np.sin(angles)])
    across = np.stack([-np.sin(angles), np.cos(angles)])
    areas = np.ptp(hull @ along, axis=0) * np.ptp(hull @ across, axis=0)
    return float(angles[int(np.argmin(areas))])


def _step_back(
    shape: Footprint,
    prints: Sequence[Footprint],
    yaw: float,
    touch: NDArray,
    direction: NDArray,
    gap: float,
) -> NDArray | None:
    """Where a shape stands that came in along `direction` to `touch` and then gave way by `gap`."""
    back = gap
    for _ in range(12):  # a slanting contact gives less room than the step back: step again
        spot = touch - back * direction
        room = min(separation(shape.moved(yaw, spot), other) for other in prints)
        if room >= 0.8 * gap:
            return spot
        back += max(gap - room, 1e-4)
    return None


def _slide(
    shape: Footprint,
    prints: Sequence[Footprint],
    yaw: float,
    spot: NDArray,
    direction: NDArray,
    gap: float,
    middle: NDArray,
) -> NDArray:
    """Where a shape comes to that slides across `direction`, past what it touches, to the next thing."""
    across = np.array([-direction[1], direction[0]])
    if (middle - spot) @ across < 0:
        across = -across
    way = min(travel(shape.moved(yaw, spot), other, across) for other in prints)
    if not np.isfinite(way) or way <= gap:
        return spot
    slid = _step_back(shape, prints, yaw, spot + way * across, across, gap)
    return spot if slid is None else slid
