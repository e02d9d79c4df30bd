"""Tables in rooms as the field's data sets show them, by intersecting rays: floor, walls, chairs, clutter.

A camera at 0.6 to 2 m sees a table (or a part of the floor) from a slant; boxes, cylinders and balls stand on
it, lie on each other and stick out over its edge. Depth has the faults of a structured light or a stereo
camera: noise that grows with z^2, coarse steps, a slow bend, holes at outlines, shadows of the projector.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from riseg_drake.geometry.camera import Intrinsics, rays
from riseg_drake.geometry.rgbd import Frame
from tests.segmentation.drawn_scene import between_planes

VGA = Intrinsics(640, 480, 570.3, 570.3, 319.5, 239.5)
FLOOR = -0.72
"""m; how far below a table top the floor is."""


@dataclass
class Solid:
    """A box, an upright cylinder or an ellipsoid, centred on its frame B; `size` is the box around it."""

    kind: str
    size: NDArray
    X_WB: NDArray
    label: int
    """0 = none of the objects."""
    color: NDArray

    def enter(self, eye_W: NDArray, ray_W: NDArray) -> NDArray:
        """Depth [H, W] at which rays enter; inf where they miss."""
        half = self.size / 2
        eye = (eye_W - self.X_WB[:3, 3]) @ self.X_WB[:3, :3] / half
        ray = ray_W @ self.X_WB[:3, :3] / half
        with np.errstate(divide="ignore", invalid="ignore"):
            if self.kind == "box":
                enter, leave = between_planes(-1 - eye, 1 - eye, ray)
            else:
                n = 3 if self.kind == "ball" else 2
                a, b = (ray[..., :n] ** 2).sum(-1), ray[..., :n] @ eye[:n]
                root = np.sqrt(b**2 - a * (eye[:n] @ eye[:n] - 1))
                enter, leave = (-b - root) / a, (-b + root) / a
                if self.kind == "cylinder":
                    above, below = between_planes(-1 - eye[2:], 1 - eye[2:], ray[..., 2:])
                    enter, leave = np.maximum(enter, above), np.minimum(leave, below)
        return np.where((enter < leave) & (enter > 0), enter, np.inf)


@dataclass
class Room:
    """What to draw. Lengths in metres; W stands on the table top, z up."""

    table: tuple[float, float] | None = (1.2, 0.7)
    """Its size along x and y; None where things stand on the floor."""
    objects: int = 8
    heights: tuple[float, float] = (0.03, 0.25)
    distance: tuple[float, float] = (0.9, 1.5)
    elevation: tuple[float, float] = (25.0, 60.0)
    """Of the line of sight below the horizontal, degrees."""
    wall: tuple[float, float] | None = (0.3, 1.5)
    """How far behind the table's edge; None where there is none."""
    chairs: int = 2
    structured_light: bool = True
    """Kinect, Xtion; else active stereo as of the RealSense."""
    at_edge: float = 0.0
    """Share of the objects that stand at the far edge, and over it."""
    near_wall: float = 0.0
    """Share of the objects that touch the wall."""
    aim: float = 0.1
    """How far beside the table's middle the camera looks, m."""


def draw_room(
    room: Room, rng: np.random.Generator, intrinsics: Intrinsics = VGA
) -> tuple[Frame, NDArray[np.uint16], float]:
    """The frame, the true labels (0 = no object), and the share of the image that is table or object."""
    X_WC = _camera(room, rng)
    solids, wall_y = _solids(room, rng)
    eye_W, ray_W = X_WC[:3, 3], rays(intrinsics).astype(float) @ X_WC[:3, :3].T
    ground = 0.0 if room.table is None else FLOOR
    with np.errstate(divide="ignore"):
        depth = (ground - eye_W[2]) / ray_W[..., 2]
        depth[~(depth > 0)] = np.inf
        label = np.zeros(depth.shape, np.uint16)
        color = np.full((*depth.shape, 3), 90.0) + rng.uniform(-40, 40, 3)
        on_table = np.full(depth.shape, room.table is None)
        walls = [(1, wall_y)] if wall_y is not None else [(1, 4.0)]
        walls += [(0, rng.uniform(1.2, 3.0)), (0, -rng.uniform(1.2, 3.0))]
        for axis, at in walls:
            behind = (at - eye_W[axis]) / ray_W[..., axis]
            hit = (behind > 0) & (behind < depth)
            depth[hit], on_table[hit] = behind[hit], False
            color[hit] = 200 + rng.uniform(-30, 30)
    for number, solid in enumerate(solids):
        enter = solid.enter(eye_W, ray_W)
        hit = enter < depth
        depth[hit], label[hit] = enter[hit], solid.label
        color[hit] = solid.color
        on_table[hit] = solid.label > 0 or (room.table is not None and number == 0)
    if room.table is not None or wall_y is None:
        on_table &= depth < 6
    color += _texture(depth, ray_W, eye_W, rng)
    measured = structured_light if room.structured_light else stereo
    depth = measured(depth, intrinsics, rng)
    color = np.clip(np.rint(color + rng.normal(0, 2.5, color.shape)), 0, 255).astype(np.uint8)
    nothing = np.zeros(depth.shape, bool)
    frame = Frame(0, 0.0, intrinsics, color, depth.astype(np.float32), X_WC, nothing)
    return frame, label, float(np.mean(on_table))


def _camera(room: Room, rng: np.random.Generator) -> NDArray:
    """Looks along W's y, and down."""
    elevation, distance = np.radians(rng.uniform(*room.elevation)), rng.uniform(*room.distance)
    yaw, roll = rng.uniform(-0.25, 0.25), rng.uniform(-0.08, 0.08)
    R_WC = (
        Rotation.from_euler("z", yaw) * Rotation.from_euler("x", -np.pi / 2 - elevation)
    ) * Rotation.from_euler("z", roll)
    target = np.array([*rng.uniform(-room.aim, room.aim, 2), 0.02])
    X_WC = np.eye(4)
    X_WC[:3, :3] = R_WC.as_matrix()
    X_WC[:3, 3] = target - distance * X_WC[:3, 2]
    return X_WC


def _at(x: float, y: float, z: float, yaw: float = 0.0) -> NDArray:
    X = np.eye(4)
    X[:3, :3] = Rotation.from_euler("z", yaw).as_matrix()
    X[:3, 3] = x, y, z
    return X


def _solids(room: Room, rng: np.random.Generator) -> tuple[list[Solid], float | None]:
    """Table first, then chairs, then objects; and where the wall stands."""
    width, length = room.table or (1.6, 1.2)
    gray = lambda: rng.uniform(30, 220, 3)  # noqa: E731
    solids = []
    if room.table is not None:
        top = np.array([width, length, 0.03])
        solids.append(Solid("box", top, _at(0, 0, -0.015), 0, gray()))
        for x in (-1, 1):
            for y in (-1, 1):
                leg = np.array([0.05, 0.05, 0.69])
                place = _at(x * (width / 2 - 0.05), y * (length / 2 - 0.05), -0.375)
                solids.append(Solid("box", leg, place, 0, gray()))
    wall_y = None if room.wall is None else length / 2 + rng.uniform(*room.wall)
    for _ in range(room.chairs):
        solids += _chair(room, width, length, wall_y, rng, gray())
    solids += _objects(room, width, length, wall_y, rng)
    return solids, wall_y


def _chair(
    room: Room, width: float, length: float, wall_y: float | None, rng: np.random.Generator, color: NDArray
) -> list[Solid]:
    """Seat, back and legs, at a free side of the table: behind it, or to its left or right."""
    floor = FLOOR if room.table is not None else 0.0
    sides = ["left", "right"] + (["behind"] if wall_y is None or wall_y > length / 2 + 0.6 else [])
    side, gap = rng.choice(sides), rng.uniform(0.05, 0.4)
    along = rng.uniform(-0.3, 0.3)
    x, y, yaw = {
        "behind": (along, length / 2 + gap + 0.22, 0.0),
        "left": (-width / 2 - gap - 0.22, along, np.pi / 2),
        "right": (width / 2 + gap + 0.22, along, -np.pi / 2),
    }[str(side)]
    X = _at(x, y, floor, yaw + rng.uniform(-0.4, 0.4))
    parts = [((0.42, 0.42, 0.05), (0, 0, 0.45)), ((0.42, 0.04, 0.40), (0, 0.2, 0.72))]
    parts += [((0.04, 0.04, 0.45), (a * 0.18, b * 0.18, 0.22)) for a in (-1, 1) for b in (-1, 1)]
    return [Solid("box", np.array(size), X @ _at(*place), 0, color) for size, place in parts]


def _objects(
    room: Room, width: float, length: float, wall_y: float | None, rng: np.random.Generator
) -> list[Solid]:
    """Things of random shape that do not overlap, some on top of others, some tilted against nothing."""
    placed: list[tuple[NDArray, float, Solid]] = []
    spread = np.array([min(0.45, width / 2 - 0.08), min(0.35, length / 2 - 0.08)])
    for number in range(1, room.objects + 1):
        for _ in range(60):
            kind = str(rng.choice(["box", "box", "cylinder", "ball"]))
            height = rng.uniform(*room.heights)
            flat = height < 0.03
            size = np.array([rng.uniform(0.05, 0.2), rng.uniform(0.04, 0.13), height])
            if kind == "cylinder" or flat:
                kind, size[:2] = ("cylinder", rng.uniform(0.05, 0.1)) if not flat else ("box", size[:2])
            if kind == "ball":
                size[:] = rng.uniform(0.05, 0.12)
            spot, radius, base = rng.uniform(-spread, spread), float(np.hypot(*size[:2])) / 2, 0.0
            where = rng.random()
            yaw = rng.uniform(-np.pi, np.pi)
            if where < room.near_wall and wall_y is not None:
                spot[1], yaw = wall_y - size[1] / 2 - 0.002, 0.0
            elif where < room.near_wall + room.at_edge:
                spot[1] = length / 2 - rng.uniform(-0.2, 0.6) * radius
                if kind == "ball":
                    spot[1] = length / 2 - radius
            below = [p for p in placed if np.hypot(*(p[0] - spot)) < p[1] + radius]
            if below and rng.random() < 0.15 and kind != "ball":
                under = below[0][2]
                if under.kind == "box" and len(below) == 1:
                    spot, base = under.X_WB[:2, 3], under.X_WB[2, 3] + under.size[2] / 2
                    below = []
            if not below:
                X = _at(*spot, base + size[2] / 2, yaw)
                solid = Solid(kind, size, X, number, rng.uniform(20, 240, 3))
                placed.append((spot, 0.8 * radius, solid))
                break
    return [solid for _, _, solid in placed]


def _texture(depth: NDArray, ray_W: NDArray, eye_W: NDArray, rng: np.random.Generator) -> NDArray:
    """Grain of wood along a direction, and checks, on everything alike."""
    p_WQ = eye_W + np.where(np.isfinite(depth), depth, 0)[..., None] * ray_W
    across = p_WQ @ Rotation.random(None, rng).as_matrix()
    grain = 10 * np.sin(across[..., 0] * 90 + 3 * np.sin(across[..., 1] * 9))
    checks = 8 * np.sign(np.sin(across[..., 1] * 60) * np.sin(across[..., 2] * 60))
    return (rng.choice([0.0, 1.0]) * grain + rng.choice([0.0, 1.0]) * checks)[..., None]


def structured_light(depth: NDArray, k: Intrinsics, rng: np.random.Generator) -> NDArray:
    """Kinect: disparity in eighths of a pixel, 75 mm baseline, a shadow to the left of what is near."""
    baseline, z = 0.075, np.where((depth > 0.45) & (depth < 4.5), depth, 0)
    with np.errstate(divide="ignore"):
        disparity = np.where(z > 0, k.fx * baseline / z, 0)
    v, u = np.mgrid[: k.height, : k.width]
    column = np.clip(np.rint(u + disparity).astype(int), 0, k.width + 99)
    nearest = np.zeros((k.height, k.width + 100))
    np.maximum.at(nearest, (v, column), disparity)
    nearest = cv2.dilate(nearest, np.ones((1, 3)))
    shadow = nearest[v, column] > disparity + 1.5
    wobble = cv2.GaussianBlur(rng.normal(size=z.shape), (0, 0), 1.2) * 4.3  # of unit variance
    bend = cv2.resize(rng.normal(0, 0.05, (4, 5)), (k.width, k.height), interpolation=cv2.INTER_CUBIC)
    steps = np.rint(8 * (disparity + 0.09 * wobble + bend)) / 8
    with np.errstate(divide="ignore"):
        z = np.where((disparity > 0) & (steps > 0), k.fx * baseline / steps, 0)
    return _with_holes(np.rint(1000 * z) / 1000, depth, rng) * ~shadow


def stereo(depth: NDArray, k: Intrinsics, rng: np.random.Generator) -> NDArray:
    """RealSense D415: 0.08 px of disparity, correlated over a few pixels; whole millimetres."""
    z = np.where((depth > 0.3) & (depth < 5), depth, 0)
    wobble = cv2.GaussianBlur(rng.normal(size=z.shape), (0, 0), 1.5) * 5.3  # of unit variance
    bend = cv2.resize(rng.normal(0, 0.001, (4, 5)), (k.width, k.height), interpolation=cv2.INTER_CUBIC)
    return _with_holes(np.rint(1000 * (z + z**2 * (0.0023 * wobble + bend))) / 1000, depth, rng) * (z > 0)


def _with_holes(z: NDArray, true: NDArray, rng: np.random.Generator) -> NDArray:
    """No depth along outlines, and in a few specks."""
    window = np.ones((3, 3), np.uint8)
    far = np.where(np.isfinite(true), true, 20).astype(np.float32)
    step = cv2.dilate(far, window) - cv2.erode(far, window) > 0.03 * far
    outline = step & (cv2.blur(rng.random(z.shape), (3, 3)) > 0.47)
    specks = cv2.GaussianBlur(rng.normal(size=z.shape), (0, 0), 2.5)
    return np.where(outline | (specks > np.quantile(specks, 0.99)), 0, z)


KINDS: dict[str, Room] = {
    "table in a room": Room(),
    "floor": Room(table=None, chairs=1, wall=(0.2, 1.5), distance=(1.2, 1.9), heights=(0.05, 0.3)),
    "boxes and cups": Room(
        table=(1.4, 0.9), objects=6, distance=(0.85, 1.15), elevation=(35, 55), wall=(0.5, 2), chairs=0
    ),
    "a third": Room(table=(0.85, 0.75), objects=6, distance=(0.95, 1.15), elevation=(35, 55)),
    "a fifth": Room(table=(0.75, 0.6), objects=6, distance=(1.1, 1.4), elevation=(30, 50)),
    "over the edge": Room(table=(0.8, 0.55), distance=(0.9, 1.2), elevation=(25, 50), at_edge=0.5),
    "against a wall": Room(wall=(0.0, 0.004), chairs=1, near_wall=0.25),
    "full": Room(table=(0.9, 0.7), objects=18, distance=(0.9, 1.3), elevation=(30, 55)),
    "flat": Room(objects=8, heights=(0.012, 0.03), distance=(0.7, 1.1), elevation=(40, 65)),
    "near, stereo": Room(
        objects=10, distance=(0.6, 0.9), elevation=(35, 70), structured_light=False, heights=(0.02, 0.2)
    ),
    "wall, stereo": Room(
        wall=(0.0, 0.004), distance=(0.7, 1.2), structured_light=False, near_wall=0.3, elevation=(20, 45)
    ),
}
