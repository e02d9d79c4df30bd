"""From a silhouette to a solid with rounded edges: a closed mesh, its texture coordinates, its mass.

Lengths in mm here; `make_objects` writes metres. A solid stands on z = 0. At inward distance d from the
silhouette its surface runs from `Profile.bottom(d)` up to `Profile.top(d)`.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from riseg_drake.models.objects.outlines import inward_distance
from scipy.spatial import Delaunay

RING_ANGLES = np.radians([28.0, 58.0, 90.0])  # where the rounded rim gets vertices, from the wall up
GRID = 7.0  # mm between vertices on the flat part of the top


@dataclass(frozen=True)
class Profile:
    """Heights in mm: an upright wall from `foot` to `shoulder`, quarter ellipses below and above it."""

    height: float
    shoulder: float
    foot: float = 3.0
    top_run: float = 8.0
    bottom_run: float = 2.5

    def top(self, d: NDArray) -> NDArray:
        """Upper surface at inward distance d."""
        return self.shoulder + (self.height - self.shoulder) * _quarter(d / self.top_run)

    def bottom(self, d: NDArray) -> NDArray:
        """Lower surface at inward distance d."""
        return self.foot * (1.0 - _quarter(d / self.bottom_run))

    def inset(self, z: float) -> float:
        """How far inside the silhouette the surface is at height z."""
        if z < self.foot:
            return self.bottom_run * (1.0 - float(np.sqrt(1.0 - (1.0 - z / self.foot) ** 2)))
        rise = (z - self.shoulder) / (self.height - self.shoulder)
        return 0.0 if rise <= 0 else self.top_run * (1.0 - float(np.sqrt(max(0.0, 1.0 - rise**2))))


def _quarter(t: NDArray) -> NDArray:
    """A quarter circle: 0 at t = 0 with an upright tangent, 1 from t = 1 on."""
    return np.sqrt(1.0 - (1.0 - np.clip(t, 0.0, 1.0)) ** 2)


@dataclass(frozen=True)
class Mesh:
    """A closed triangle mesh; `chart` is where each vertex lies on the flat texture, in mm."""

    vertices: NDArray  # [n, 3]
    normals: NDArray  # [n, 3]
    chart: NDArray  # [n, 2]
    faces: NDArray  # [m, 3], counterclockwise from outside


def solid(loops: Sequence[NDArray], profile: Profile, rng: np.random.Generator) -> Mesh:
    """Raise a silhouette to a solid. `rng` only jitters vertices, so that no four lie on one circle."""
    rim = np.vstack(loops)
    n = len(rim)
    outward = np.vstack([_outward(loop) for loop in loops])
    top_xy = _sheet(rim, outward, loops, profile.top_run * (1.0 - np.cos(RING_ANGLES)), GRID, rng)
    bottom_xy = _sheet(rim, outward, loops, [profile.bottom_run], 3.0 * GRID, rng)
    d_top, nearest_top = inward_distance(top_xy, loops)
    d_bottom, _ = inward_distance(bottom_xy, loops)
    d_top[:n] = d_bottom[:n] = 0.0

    vertices = np.vstack(
        [
            np.column_stack([top_xy, profile.top(d_top)]),
            np.column_stack([bottom_xy, profile.bottom(d_bottom)]),
        ]
    )
    vertices = np.round(vertices, 2)
    top_faces = _triangles(top_xy, loops)
    bottom_faces = _triangles(bottom_xy, loops)[:, ::-1] + len(top_xy)
    faces = np.vstack([top_faces, _wall(loops, len(top_xy)), bottom_faces])
    _check_closed(faces)

    # The texture is a plane laid over the top and drawn down the sides: a vertex on the rim lies as far
    # out on the plane as the surface is long from the flat top to it.
    away = outward.copy()
    slack = _surface_length(profile, d_top) - np.maximum(profile.top_run - d_top, 0.0)
    direction = nearest_top - top_xy
    direction[:n] = away
    direction /= np.maximum(np.linalg.norm(direction, axis=1, keepdims=True), 1e-9)
    chart_top = top_xy + direction * slack[:, None]
    chart_bottom = bottom_xy.copy()
    chart_bottom[:n] = chart_top[:n] + away * (profile.shoulder - profile.foot)
    return Mesh(vertices, _vertex_normals(vertices, faces), np.vstack([chart_top, chart_bottom]), faces)


def mass_properties(vertices: NDArray, faces: NDArray) -> tuple[float, NDArray, NDArray]:
    """Volume, centre of volume [3], and inertia about it per unit density [3, 3], of a closed mesh.

    Sums signed tetrahedra from the origin; the second moments of one with corners 0, a, b, c are
    det(a, b, c) / 120 * (sum over all pairs of corners, equal ones twice).
    """
    corners = vertices[faces]  # [m, 3, 3]
    determinant = np.linalg.det(corners)
    volume = determinant.sum() / 6.0
    centre = np.einsum("m,mki->i", determinant, corners) / (24.0 * volume)
    total = corners.sum(axis=1)
    pairs = np.einsum("mi,mj->mij", total, total) + np.einsum("mki,mkj->mij", corners, corners)
    moments = np.einsum("m,mij->ij", determinant, pairs) / 120.0 - volume * np.outer(centre, centre)
    return float(volume), centre, np.trace(moments) * np.eye(3) - moments


def _outward(loop: NDArray) -> NDArray:
    """Unit normals that point out of the solid: to the right of the direction of travel."""
    tangent = np.roll(loop, -1, axis=0) - np.roll(loop, 1, axis=0)
    normal = np.column_stack([tangent[:, 1], -tangent[:, 0]])
    return normal / np.linalg.norm(normal, axis=1, keepdims=True)


def _sheet(
    rim: NDArray,
    outward: NDArray,
    loops: Sequence[NDArray],
    insets: Sequence[float] | NDArray,
    grid: float,
    rng: np.random.Generator,
) -> NDArray:
    """Vertices of one side, rim first: parallel rings inside the rim, then a jittered grid."""
    points = [rim]
    for inset in insets:
        ring = rim - outward * inset
        distance, _ = inward_distance(ring, loops)
        points.append(ring[distance > 0.97 * inset])
    deepest = max(insets)
    low, high = rim.min(axis=0), rim.max(axis=0)
    xy = np.stack(np.meshgrid(*[np.arange(a, b, grid) for a, b in zip(low, high, strict=True)]), axis=-1)
    xy = xy.reshape(-1, 2) + rng.uniform(-0.15 * grid, 0.15 * grid, (xy.size // 2, 2))
    distance, _ = inward_distance(xy, loops)
    points.append(xy[distance > min(deepest, 0.25 * grid) + 0.3 * grid])
    sheet = np.round(np.vstack(points), 2)
    _, first = np.unique(sheet, axis=0, return_index=True)
    return sheet[np.sort(first)]


def _triangles(xy: NDArray, loops: Sequence[NDArray]) -> NDArray:
    """Triangles between the points that lie inside the silhouette, counterclockwise."""
    triangles = Delaunay(xy).simplices
    a, b, c = (xy[triangles[:, k]] for k in range(3))
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    triangles[area < 0] = triangles[area < 0][:, ::-1]
    distance, _ = inward_distance((a + b + c) / 3.0, loops)
    return triangles[(distance > 0) & (np.abs(area) > 1e-9)]


def _wall(loops: Sequence[NDArray], below: int) -> NDArray:
    """Two triangles a step along the rim; the lower rim's vertices come `below` after the upper's."""
    faces, start = [], 0
    for loop in loops:
        i = start + np.arange(len(loop))
        j = np.roll(i, -1)
        faces += [np.column_stack([i + below, j + below, j]), np.column_stack([i + below, j, i])]
        start += len(loop)
    return np.vstack(faces)


def _check_closed(faces: NDArray) -> None:
    edges = np.vstack([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    if {tuple(edge) for edge in edges} != {tuple(edge[::-1]) for edge in edges}:
        raise ValueError("the mesh has an open edge: trace the outline with a finer spacing")


def _surface_length(profile: Profile, d: NDArray) -> NDArray:
    """Length of the upper profile from inward distance d to the flat top."""
    t = np.linspace(0.0, 1.0, 400) ** 2  # denser near the upright start
    run, rise = t * profile.top_run, profile.top(t * profile.top_run)
    length = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(run), np.diff(rise)))])
    return length[-1] - np.interp(d, run, length)


def _vertex_normals(vertices: NDArray, faces: NDArray) -> NDArray:
    """Face normals averaged by area at each vertex."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    face_normal = np.cross(b - a, c - a)
    normals = np.zeros_like(vertices)
    for k in range(3):
        np.add.at(normals, faces[:, k], face_normal)
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
