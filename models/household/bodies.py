"""Shapes of household things: cartons, turned things (cans, bottles, mugs, bowls), and cut-out slabs.

Each has a surface with a painted texture, convex collision shapes that leave what is hollow hollow, and
its mass properties. Lengths in mm, z up; a body stands on z = 0.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from riseg_drake.models.household.gltf import Surface, joined
from riseg_drake.models.household.printing import RESOLUTION, Art, Color, blank
from riseg_drake.models.objects.collision import convex_pieces, hull_mesh
from riseg_drake.models.objects.outlines import Field, trace
from riseg_drake.models.objects.patterns import Pattern
from riseg_drake.models.objects.solids import Profile, mass_properties, solid
from riseg_drake.models.objects.texture import painted

SIDES = 40  # of a turned surface
FACETS = 14  # of its collision shape: it rolls, and comes to rest
SECTORS = 10  # that the wall of a hollow body is cut into


@dataclass(frozen=True)
class Body:
    """A thing without its name and weight."""

    surface: Surface
    texture: NDArray
    """[h, w, 3], RGB, 8 bit."""
    volume: float
    """mm^3"""
    centre: NDArray
    """Of volume, mm [3]."""
    inertia: NDArray
    """About the centre, for unit density, mm^5 [3, 3]."""
    boxes: Sequence[tuple[NDArray, NDArray]] = ()
    """Collision boxes: sizes and centres, mm."""
    hulls: Sequence[tuple[NDArray, NDArray]] = ()
    """Convex collision meshes: vertices, mm, and faces."""


def carton(x: float, y: float, z: float, top: Art, side: Art, rng: np.random.Generator) -> Body:
    """A box of cardboard, printed on six sides: top and bottom alike, and the four others alike."""
    right, up = np.array([1.0, 0, 0]), np.array([0, 0, 1.0])
    back = np.array([0, 1.0, 0])
    corner = 0.5 * np.array([x, y, 0.0])
    sides = [  # art, upper left corner seen from outside, rightwards, downwards
        (top, [-corner[0], corner[1], z], x * right, -y * back),
        (side, [corner[0], corner[1], 0.0], -x * right, -y * back),
        (top if z > 30 else side, [-corner[0], -corner[1], z], x * right, -z * up),
        (side, [corner[0], corner[1], z], -x * right, -z * up),
        (side, [corner[0], -corner[1], z], y * back, -z * up),
        (top if z > 30 else side, [-corner[0], corner[1], z], -y * back, -z * up),
    ]
    sheets = [
        _worn(art(float(np.linalg.norm(across)), float(np.linalg.norm(down)), rng))
        for art, _, across, down in sides
    ]
    texture, places = _atlas(sheets)
    surfaces = []
    for (_, start, across, down), place in zip(sides, places, strict=True):
        a = np.array(start)
        normal = np.cross(down, across)
        surfaces.append(
            Surface(
                np.array([a, a + down, a + across + down, a + across]),
                np.tile(normal / np.linalg.norm(normal), (4, 1)),
                place[[0, 2, 3, 1]],
                np.array([[0, 1, 2], [0, 2, 3]]),
            )
        )
    size = np.array([x, y, z])
    inertia = np.diag(np.sum(size**2) - size**2) * x * y * z / 12.0
    centre = np.array([0.0, 0.0, 0.5 * z])
    return Body(joined(*surfaces), texture, x * y * z, centre, inertia, boxes=[(size, centre)])


def turned(
    profile: Sequence[tuple[float, float]],
    paint: "Paint",
    rng: np.random.Generator,
    oval: float = 1.0,
    handle: "tuple[float, float, float, Color] | None" = None,
    hollow: bool = False,
) -> Body:
    """A body turned about the z axis from (r, z) nodes: from the axis below, outside up, to the axis again.

    Where `hollow`, the nodes go down again inside. `oval` stretches y. A handle is an upright half ring: its
    reach beyond the wall, its lower and upper end, its colour.
    """
    nodes = np.array(profile, float)
    texture, shown = _lathe_texture(nodes, paint, rng)
    surface = _turned_surface(nodes, oval)
    volume, centre, inertia = mass_properties(surface.vertices, surface.faces)
    hulls = _wall_hulls(nodes) if hollow else _solid_hulls(nodes, oval)
    surface = Surface(surface.vertices, surface.normals, surface.uv * (1.0, shown), surface.faces)
    boxes: list[tuple[NDArray, NDArray]] = []
    if handle is not None:
        reach, low, high, color = handle
        radius = float(nodes[:, 0].max())
        texture[-4:, :] = np.round(255 * np.array(color)).astype(np.uint8)
        surface = joined(surface, _handle(radius, reach, low, high, 1.0 - 2.0 / len(texture)))
        size = np.array([reach + 3.0, 8.0, high - low])
        boxes.append((size, np.array([radius + 0.5 * size[0] - 2.0, 0.0, 0.5 * (low + high)])))
    return Body(surface, texture, volume, centre, inertia, boxes, hulls)


def slab(drawing: Field, profile: Profile, pattern: Pattern, rng: np.random.Generator) -> Body:
    """A silhouette with rounded edges: the toys' solid."""
    loops = trace(drawing, reach=110.0)
    mesh = solid(loops, profile, rng)
    texture, chart = painted(mesh.chart, pattern, rng, RESOLUTION)
    volume, centre, inertia = mass_properties(mesh.vertices, mesh.faces)
    uv = np.column_stack([chart[:, 0], 1.0 - chart[:, 1]])
    surface = Surface(mesh.vertices, mesh.normals, uv, mesh.faces)
    hulls = convex_pieces(loops, profile, tolerance=2.5, lift=0.0, outline=2.0)
    return Body(surface, texture, volume, centre, inertia, hulls=hulls)


@dataclass(frozen=True)
class Paint:
    """How a turned body is painted: a colour by height, another inside, and a sheet around its wall."""

    base: Color
    label: Art | None = None
    label_low: float = 0.0
    """mm above the table; with `label_high` where the sheet lies."""
    label_high: float = 0.0
    cap: Color | None = None
    cap_from: float = 1e9
    """mm; what is higher has the cap's colour."""
    inside: Color | None = None
    rings: float = 0.0
    """mm between the ridges that are pressed into the lid; 0: none."""


def _lathe_texture(nodes: NDArray, paint: Paint, rng: np.random.Generator) -> tuple[NDArray, float]:
    """The painted strip [h, w, 3]: columns go round, rows along the profile; and what share of rows it fills.

    The rest, some rows at the end, is for handles.
    """
    length = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(nodes, axis=0).T))])
    rows = round(length[-1] / RESOLUTION)
    along = (np.arange(rows) + 0.5) / rows * length[-1]
    r, z = (np.interp(along, length, nodes[:, k]) for k in (0, 1))
    highest = int(np.argmax(z))
    sheet = blank(2.0 * np.pi * float(nodes[:, 0].max()), rows * RESOLUTION, paint.base)[:rows]
    inner = np.arange(rows) > highest
    if paint.label is not None:
        wall = (z >= paint.label_low) & (z <= paint.label_high) & ~inner & (r > 0.5 * r.max())
        label = paint.label(2.0 * np.pi * float(nodes[:, 0].max()), paint.label_high - paint.label_low, rng)
        at = (paint.label_high - z[wall]) / (paint.label_high - paint.label_low) * (len(label) - 1)
        columns = np.linspace(0, label.shape[1] - 1, sheet.shape[1]).round().astype(int)
        sheet[wall] = label[at.round().astype(int)][:, columns]
    if paint.cap is not None:
        sheet[z >= paint.cap_from] = paint.cap
    if paint.inside is not None:
        sheet[inner] = paint.inside
    if paint.rings:
        lid = (z > z.max() - 3.0) & (r < 0.93 * r.max())
        sheet[lid] *= (0.86 + 0.14 * np.cos(2 * np.pi * r[lid] / paint.rings))[:, None, None]
    whole = np.vstack([sheet, np.broadcast_to(sheet[-1:], (6, *sheet.shape[1:]))])
    return _eight_bit(whole), rows / len(whole)


def _turned_surface(nodes: NDArray, oval: float) -> Surface:
    """The closed surface; two rings of vertices for each piece of the profile, so that edges can be sharp."""
    step = np.diff(nodes, axis=0)
    length = np.hypot(*step.T)
    flat = np.column_stack([step[:, 1], -step[:, 0]]) / length[:, None]  # outward, in (r, z)
    begin, end = flat.copy(), flat.copy()
    for k in np.flatnonzero(np.sum(flat[1:] * flat[:-1], axis=1) > np.cos(np.radians(50.0))):
        begin[k + 1] = end[k] = (flat[k] + flat[k + 1]) / np.linalg.norm(flat[k] + flat[k + 1])
    rows = np.concatenate([[0.0], np.cumsum(length)]) / length.sum()
    angle = np.linspace(0.0, 2.0 * np.pi, SIDES + 1)
    c, s = np.cos(angle), np.sin(angle)
    c[-1], s[-1] = c[0], s[0]
    vertices, normals, uv, faces = [], [], [], []
    for k in range(len(step)):
        start = len(vertices) * (SIDES + 1)
        for (r, z), (n_r, n_z), v in ((nodes[k], begin[k], rows[k]), (nodes[k + 1], end[k], rows[k + 1])):
            vertices.append(np.column_stack([r * c, oval * r * s, np.full(SIDES + 1, z)]))
            normal = np.column_stack([n_r * c, n_r * s / oval, np.full(SIDES + 1, n_z)])
            normals.append(normal / np.linalg.norm(normal, axis=1, keepdims=True))
            uv.append(np.column_stack([angle / (2.0 * np.pi), np.full(SIDES + 1, v)]))
        i = start + np.arange(SIDES)
        j = i + SIDES + 1
        if nodes[k, 0] > 0:
            faces.append(np.column_stack([i, i + 1, j + 1]))
        if nodes[k + 1, 0] > 0:
            faces.append(np.column_stack([i, j + 1, j]))
    # Towards the outer wall of the label, rows count from below: the sheet was laid on by height.
    return Surface(np.vstack(vertices), np.vstack(normals), np.vstack(uv), np.vstack(faces))


def _solid_hulls(nodes: NDArray, oval: float, tolerance: float = 1.0) -> list[tuple[NDArray, NDArray]]:
    """Convex pieces one above the other: a new one wherever the profile has a waist."""
    hulls, start = [], 0
    outline = nodes[np.append(True, np.diff(nodes[:, 1]) >= 0)]
    while start < len(outline) - 1:
        end = start + 1
        while end + 1 < len(outline) and _bulges(outline[start : end + 2], tolerance):
            end += 1
        hulls.append(_turned_hull(outline[start : end + 1], oval))
        start = end
    return hulls


def _bulges(part: NDArray, tolerance: float) -> bool:
    """Whether no node lies further than `tolerance` inside the straight lines between other nodes."""
    for a in range(len(part) - 2):
        for b in range(a + 2, len(part)):
            share = (part[a + 1 : b, 1] - part[a, 1]) / max(part[b, 1] - part[a, 1], 1e-9)
            chord = part[a, 0] + share * (part[b, 0] - part[a, 0])
            if np.any(part[a + 1 : b, 0] < chord - tolerance):
                return False
    return True


def _turned_hull(part: NDArray, oval: float) -> tuple[NDArray, NDArray]:
    angle = (np.arange(FACETS) + 0.5) * 2.0 * np.pi / FACETS
    round_about = np.column_stack([np.cos(angle), oval * np.sin(angle)])
    points = [np.column_stack([r * round_about, np.full(FACETS, z)]) for r, z in part if r > 0.5]
    return hull_mesh(np.round(np.vstack(points), 2))


def _wall_hulls(nodes: NDArray) -> list[tuple[NDArray, NDArray]]:
    """The floor of a hollow body as one piece, its wall in sectors, each convex."""
    highest = int(np.argmax(nodes[:, 1]))
    outer, inner = nodes[: highest + 1], nodes[highest:][::-1]
    floor = float(inner[0, 1])
    below = [(r, z) for r, z in outer if z < floor]
    at_floor = (float(np.interp(floor, outer[:, 1], outer[:, 0])), floor)
    hulls = [_turned_hull(np.array([*below, at_floor]), 1.0)]
    top = float(nodes[highest, 1])
    middle = 0.5 * (floor + top)
    for low, high in ((floor, middle), (middle, top)):
        ends = [
            (float(np.interp(z, side[:, 1], side[:, 0])), z) for z in (low, high) for side in (outer, inner)
        ]
        for k in range(SECTORS):
            angle = (k + np.array([0.0, 1.0])) * 2.0 * np.pi / SECTORS
            points = [[r * np.cos(t), r * np.sin(t), z] for r, z in ends for t in angle]
            hulls.append(hull_mesh(np.round(np.array(points), 2)))
    return hulls


def _handle(radius: float, reach: float, low: float, high: float, v: float) -> Surface:
    """Half a ring of round section in the plane y = 0, from the wall at `low` to the wall at `high`."""
    middle, half = 0.5 * (low + high), 0.5 * (high - low) - 4.0
    along, around = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 13), np.linspace(0.0, 2.0 * np.pi, 11)
    a, b = np.meshgrid(along, around, indexing="ij")
    outward = np.stack([np.cos(a), np.zeros_like(a), np.sin(a)], axis=-1)
    section = np.cos(b)[..., None] * outward + np.sin(b)[..., None] * np.array([0.0, 1.0, 0.0])
    spine = np.stack([radius - 2.0 + (reach - 2.0) * np.cos(a), 0 * a, middle + half * np.sin(a)], axis=-1)
    vertices = (spine + 4.0 * section).reshape(-1, 3)
    i = (np.arange(12)[:, None] * 11 + np.arange(10)).ravel()
    faces = np.vstack([np.column_stack([i, i + 1, i + 12]), np.column_stack([i, i + 12, i + 11])])
    uv = np.tile([0.5, v], (len(vertices), 1))
    return Surface(vertices, section.reshape(-1, 3), uv, faces)


def _atlas(sheets: Sequence[NDArray]) -> tuple[NDArray, list[NDArray]]:
    """Sheets one below the other, and the places of their corners [4, 2]: upper left, right, lower left, right.

    Places are half a texel inside, so that nothing of a neighbour shows at an edge.
    """
    width, height = max(s.shape[1] for s in sheets), sum(s.shape[0] for s in sheets)
    texture = np.zeros((height, width, 3))
    places, row = [], 0
    for sheet in sheets:
        h, w = sheet.shape[:2]
        texture[row : row + h, :w] = sheet
        u, v = [0.5 / width, (w - 0.5) / width], [(row + 0.5) / height, (row + h - 0.5) / height]
        places.append(np.array([[u[0], v[0]], [u[1], v[0]], [u[0], v[1]], [u[1], v[1]]]))
        row += h
    return _eight_bit(texture), places


def _worn(sheet: NDArray) -> NDArray:
    """A sheet whose edges are a little lighter: cardboard shows where it is folded."""
    sheet = sheet.copy()
    for edge in (np.s_[:1], np.s_[-1:], np.s_[:, :1], np.s_[:, -1:]):
        sheet[edge] = 0.75 * sheet[edge] + 0.25 * 0.8
    return sheet


def _eight_bit(image: NDArray) -> NDArray:
    """Six bits a channel are enough, and make a smaller file."""
    return (np.round(np.clip(image, 0.0, 1.0) * 63.0) * (255.0 / 63.0)).astype(np.uint8)
