"""What a toy touches the world with: small feet for the table, convex pieces for everything else.

Point contact gives one contact for each pair of geometries. A flat box on a table would rock about its
one point, so each toy stands on several small balls; and a silhouette that is not convex is cut into
pieces that are nearly so, each bevelled like the solid it stands for and lifted off the table.
Lengths in mm.
"""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray
from riseg_drake.models.objects.outlines import inward_distance
from riseg_drake.models.objects.solids import Profile
from scipy.spatial import ConvexHull

RASTER = 0.5  # mm a pixel
FOOT_RADIUS = 3.0
LIFT = 0.7  # of the convex pieces above the table


def feet(loops: Sequence[NDArray], profile: Profile, count: int = 6) -> NDArray:
    """Centres [k, 3] of balls that touch z = 0 inside the rim of the flat underside, spread widely."""
    points, distance = _raster(loops)
    flat = points[distance >= max(profile.bottom_run, FOOT_RADIUS) + RASTER]
    corners = flat[ConvexHull(flat).vertices]
    chosen = [int(np.argmax(np.linalg.norm(corners - corners.mean(axis=0), axis=1)))]
    for _ in range(count - 1):
        spread = np.linalg.norm(corners[:, None] - corners[chosen], axis=-1).min(axis=1)
        chosen.append(int(np.argmax(spread)))
    return np.column_stack([corners[chosen], np.full(count, FOOT_RADIUS)])


def convex_pieces(
    loops: Sequence[NDArray],
    profile: Profile,
    tolerance: float = 1.0,
    lift: float = LIFT,
    outline: float = 0.25,
) -> list[tuple[NDArray, NDArray]]:
    """Convex meshes (vertices [n, 3], faces [m, 3]) that together fill the solid.

    No piece reaches further than `tolerance` beyond the silhouette, or lower than `lift`; `outline`
    is how many pixels its corners may leave out.
    """
    points, distance = _raster(loops)
    pieces = _cut((distance > 0).astype(np.uint8), tolerance / RASTER)
    deepest = float(distance.max())
    top = float(profile.top(np.array(deepest)))
    levels = [lift, profile.foot, profile.shoulder]
    levels += [profile.shoulder + f * (top - profile.shoulder) for f in (0.55, 0.85, 0.99)]
    meshes = []
    for piece in pieces:
        layers = []
        for z in levels:
            section = points[(piece > 0) & (distance >= profile.inset(z))]
            if len(section) > 8:
                corners = _outline(section, outline)
                layers.append(np.column_stack([corners, np.full(len(corners), z)]))
        vertices = np.round(np.vstack(layers), 2)
        meshes.append(hull_mesh(vertices))
    return meshes


def hull_mesh(points: NDArray) -> tuple[NDArray, NDArray]:
    """The convex hull of points [n, 3]: its own vertices, and its faces, counterclockwise from outside."""
    hull = ConvexHull(points)
    number = {int(old): new for new, old in enumerate(hull.vertices)}
    faces = []
    for simplex, equation in zip(hull.simplices, hull.equations, strict=True):
        a, b, c = points[simplex]
        turn = np.dot(np.cross(b - a, c - a), equation[:3])
        order = simplex if turn > 0 else simplex[::-1]
        faces.append([number[int(i)] for i in order])
    return points[hull.vertices], np.array(sorted(faces))


def _raster(loops: Sequence[NDArray]) -> tuple[NDArray, NDArray]:
    """Pixel centres [h, w, 2] over the silhouette, with a free border, and their inward distances."""
    low, high = loops[0].min(axis=0) - 2.0, loops[0].max(axis=0) + 2.0
    x, y = (np.arange(a, b, RASTER) for a, b in zip(low, high, strict=True))
    points = np.stack(np.meshgrid(x, y), axis=-1)
    return points, inward_distance(points, loops)[0]


def _cut(mask: NDArray, tolerance: float) -> list[NDArray]:
    """Cut a mask by straight lines until every piece fills its convex hull to within `tolerance` pixels.

    Each cut starts where the hull is emptiest and takes the direction that leaves the least empty hull.
    """
    hull = _hull_mask(mask)
    emptiness = np.where(hull > 0, cv2.distanceTransform(1 - mask, cv2.DIST_L2, 5), 0.0)
    if emptiness.max() <= tolerance:
        return [mask]
    v, u = np.unravel_index(int(np.argmax(emptiness)), mask.shape)
    filled = np.argwhere(mask > 0)
    v_near, u_near = filled[np.argmin(np.sum((filled - (v, u)) ** 2, axis=1))]
    rows, columns = np.indices(mask.shape)
    best, best_cost = [mask], np.inf
    for angle in np.radians(np.arange(0.0, 180.0, 7.5)):
        side = (columns - u_near) * np.sin(angle) - (rows - v_near) * np.cos(angle) > 0
        parts = _connected(mask * side) + _connected(mask * ~side)
        cost = sum(float(_hull_mask(part).sum()) for part in parts) + 20.0 * len(parts)
        if len(parts) > 1 and cost < best_cost:
            best, best_cost = parts, cost
    return [piece for part in best for piece in _cut(part, tolerance)]


def _connected(mask: NDArray) -> list[NDArray]:
    """Connected parts of a mask, without crumbs."""
    count, labels = cv2.connectedComponents(mask.astype(np.uint8), connectivity=4)
    parts = [(labels == k).astype(np.uint8) for k in range(1, count)]
    return [part for part in parts if part.sum() > 30]


def _hull_mask(mask: NDArray) -> NDArray:
    hull = cv2.convexHull(np.argwhere(mask > 0)[:, ::-1].astype(np.int32))
    return cv2.fillConvexPoly(np.zeros_like(mask), hull, 1)


def _outline(points: NDArray, tolerance: float) -> NDArray:
    """A dozen or so corners of the convex hull of points [n, 2]."""
    hull = cv2.convexHull(points.astype(np.float32))
    return cv2.approxPolyDP(hull, tolerance, True)[:, 0].astype(float)
