"""Boxes on a table, drawn by intersecting rays: depth, labels and texture are exact, and it is quick."""

from dataclasses import dataclass, field
from itertools import product

import numpy as np
from numpy.typing import NDArray
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix

from riseg_drake.geometry.camera import WHOLE, Intrinsics, Region, project, rays
from riseg_drake.geometry.rgbd import Frame, FramePair
from riseg_drake.segmentation.above_table import AboveTable
from riseg_drake.segmentation.belief import Belief, BeliefParameters
from riseg_drake.segmentation.comparison import Comparison
from riseg_drake.segmentation.motions import flow_difference
from riseg_drake.segmentation.next_keyframe import first_belief
from riseg_drake.segmentation.noise import MeasurementNoise

CAMERA = Intrinsics(320, 240, 308.1, 307.9, 158.2, 119.4)


def looking_down(x: float = 0.0, y: float = 0.0, z: float = 0.45, tilt: float = 0.0) -> NDArray:
    """X_WC of a camera over (x, y), image right along W's x, tilted about it."""
    R_WC = RotationMatrix(np.diag([1.0, -1.0, -1.0])) @ RotationMatrix.MakeXRotation(tilt)
    return RigidTransform(R_WC, [x, y, z]).GetAsMatrix4()


def planar(x: float, y: float, yaw: float = 0.0) -> NDArray:
    """X_WB of a box that stands on the table."""
    return RigidTransform(RollPitchYaw(0, 0, yaw), [x, y, 0]).GetAsMatrix4()


def intersection_over_union(a: NDArray[np.bool_], b: NDArray[np.bool_]) -> float:
    return np.count_nonzero(a & b) / np.count_nonzero(a | b)


@dataclass
class Texture:
    """A sum of waves in the body's own coordinates: it can be evaluated between pixels, and moves along."""

    seed: int
    contrast: float = 24.0
    waves: int = 12
    wave_vectors: NDArray = field(init=False)
    phases: NDArray = field(init=False)

    def __post_init__(self) -> None:
        rng = np.random.default_rng(self.seed)
        lengths = rng.uniform(0.006, 0.03, (3, self.waves, 1))
        directions = rng.normal(size=(3, self.waves, 3))
        directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
        self.wave_vectors = 2 * np.pi * directions / lengths
        self.phases = rng.uniform(0, 2 * np.pi, (3, self.waves))

    def color(self, p_BQ: NDArray) -> NDArray:
        """[N, 3] gray values of points [N, 3]."""
        waves = np.sin(np.einsum("cwi,ni->ncw", self.wave_vectors, p_BQ) + self.phases)
        return 128 + self.contrast * waves.sum(-1) * np.sqrt(2 / self.waves)


class Blank:
    """A surface without any texture."""

    def __init__(self, gray: float = 230.0) -> None:
        self.gray = gray

    def color(self, p_BQ: NDArray) -> NDArray:
        return np.full((len(p_BQ), 3), self.gray)


@dataclass
class DrawnScene:
    """Boxes of sizes (length x, length y, height), at any poses, seen from any pose."""

    sizes: list[tuple[float, float, float]]
    textures: list["Texture | Blank"] = field(default_factory=list)
    """One for each box; waves of its own if none is given."""
    table: "Texture | Blank" = field(default_factory=Blank)
    intrinsics: Intrinsics = CAMERA
    depth_noise: float = 0.0023
    """Standard deviation of depth at 1 m, m, where a scene is drawn with noise."""
    color_noise: float = 2.0

    def __post_init__(self) -> None:
        if not self.textures:
            self.textures = [Texture(seed) for seed in range(len(self.sizes))]

    def frame(
        self,
        sequence: int,
        X_WC: NDArray,
        X_WBs: list[NDArray],
        rng: np.random.Generator | None = None,
        robot: NDArray[np.bool_] | None = None,
    ) -> tuple[Frame, NDArray[np.uint16]]:
        """The frame, and the true labels (1.. for the boxes, 0 for the table and what the robot hides).

        `rng` adds noise to depth and colour.
        """
        eye_W = X_WC[:3, 3]
        ray_W = rays(self.intrinsics).astype(float) @ X_WC[:3, :3].T
        depth = -eye_W[2] / ray_W[..., 2]
        depth[~(depth > 0)] = 0
        label = np.zeros(depth.shape, np.uint16)
        for number, (size, X_WB) in enumerate(zip(self.sizes, X_WBs, strict=True), 1):
            region = self._where(np.array(size), X_WB, X_WC)
            enter = _enter_box(np.array(size), X_WB, eye_W, ray_W[region])
            hit = enter < np.where(depth[region] > 0, depth[region], np.inf)
            depth[region][hit], label[region][hit] = enter[hit], number
        color = np.full((*depth.shape, 3), 255.0)
        p_WQ = eye_W + depth[..., None] * ray_W
        for number, texture in enumerate([self.table, *self.textures]):
            here = (label == number) & (depth > 0)
            X_WB = np.eye(4) if number == 0 else X_WBs[number - 1]
            color[here] = texture.color((p_WQ[here] - X_WB[:3, 3]) @ X_WB[:3, :3])
        if rng is not None:
            color = color + rng.normal(0, self.color_noise, color.shape)
            depth = np.where(depth > 0, depth + rng.normal(0, self.depth_noise, depth.shape) * depth**2, 0)
        robot = np.zeros(depth.shape, bool) if robot is None else robot
        label[robot] = 0
        color[robot], depth[robot] = 60, np.where(depth[robot] > 0, 0.2, 0)
        frame = Frame(
            sequence=sequence,
            time=sequence / 15,
            intrinsics=self.intrinsics,
            color=np.clip(np.rint(color), 0, 255).astype(np.uint8),
            depth=depth.astype(np.float32),
            X_WC=X_WC,
            robot=robot,
        )
        return frame, label

    def _where(self, size: NDArray, X_WB: NDArray, X_WC: NDArray) -> Region:
        """The rectangle of the image in which a box is seen."""
        corners = np.array(list(product((-0.5, 0.5), (-0.5, 0.5), (0.0, 1.0)))) * size
        X_CB = np.linalg.inv(X_WC) @ X_WB
        uv = project(corners @ X_CB[:3, :3].T + X_CB[:3, 3], self.intrinsics)
        if np.isnan(uv).any():
            return WHOLE
        shape = self.intrinsics.shape[::-1]
        first, last = (np.clip(k, 0, shape).astype(int) for k in (uv.min(0) - 1, uv.max(0) + 2))
        return slice(first[1], last[1]), slice(first[0], last[0])

    def pair(
        self,
        X_WCs: tuple[NDArray, NDArray],
        X_WBs: tuple[list[NDArray], list[NDArray]],
        rng: np.random.Generator | None = None,
    ) -> tuple[FramePair, NDArray[np.uint16], NDArray[np.uint16]]:
        """Two frames as a pair, and the true labels of both."""
        (frame_0, label_0), (frame_1, label_1) = (self.frame(n, X_WCs[n], X_WBs[n], rng) for n in (0, 1))
        return FramePair(frame_0, frame_1), label_0, label_1


def standing(frame: Frame, mask: NDArray[np.bool_]) -> AboveTable:
    """The mask of what stands on the table in a frame, as if it had been measured."""
    z = frame.depth[mask & (frame.depth > 0)]
    height = np.where(mask, np.float32(0.03), np.float32(0))
    distance = float(np.median(z)) if len(z) else 1.0
    return AboveTable(mask, height, np.array([0.0, 0.0, 1.0, 0.0]), 0.002, distance)


def first_compared(pair: FramePair, label: NDArray) -> tuple[Belief, Comparison]:
    """What is believed of a pair's first frame, in which a label image [H, W] stands, and the pair compared."""
    above = standing(pair.reference, label > 0)
    belief = first_belief(pair.reference, above, MeasurementNoise(), BeliefParameters())
    return belief, Comparison(belief.keyframe, pair.current, depth_noise=0.0023, view_error=0.01)


def flow_error(compared: Comparison, on: NDArray[np.bool_], motion: NDArray, true: NDArray) -> float:
    """Pixels (root mean square) by which a motion [4, 4] differs from the true one where a mask [H, W] is."""
    edges = compared.keyframe.edges
    v, u = edges.surface.pixel
    return flow_difference(edges.p_C0Q[on[v, u]], motion, true, CAMERA.fx)


def motion_seen_from(X_WC0: NDArray, X_WB0: NDArray, X_WB1: NDArray) -> NDArray:
    """The motion [4, 4] of a body as C0 sees it: takes its points at t-1 to where they are at t."""
    X_C0W = np.linalg.inv(X_WC0)
    return X_C0W @ X_WB1 @ np.linalg.inv(X_WB0) @ X_WC0


def flow_of_bodies(
    pair: FramePair, label_0: NDArray[np.uint16], motions_C0: dict[int, NDArray]
) -> NDArray[np.float32]:
    """The true flow [H, W, 2] from pair.reference to pair.current, where the bodies move so."""
    intrinsics = pair.current.intrinsics
    p_C0Q = rays(intrinsics).astype(float) * pair.reference.depth[..., None]
    p_C1Q = np.zeros_like(p_C0Q)
    for number in np.unique(label_0):
        here = label_0 == number
        X = pair.X_C1C0 @ motions_C0.get(int(number), np.eye(4))
        p_C1Q[here] = p_C0Q[here] @ X[:3, :3].T + X[:3, 3]
    v, u = np.mgrid[: intrinsics.height, : intrinsics.width]
    with np.errstate(divide="ignore", invalid="ignore"):
        u_1 = p_C1Q[..., 0] / p_C1Q[..., 2] * intrinsics.fx + intrinsics.cx
        v_1 = p_C1Q[..., 1] / p_C1Q[..., 2] * intrinsics.fy + intrinsics.cy
    return np.nan_to_num(np.stack([u_1 - u, v_1 - v], -1)).astype(np.float32)


def _enter_box(size: NDArray, X_WB: NDArray, eye_W: NDArray, ray_W: NDArray) -> NDArray:
    """Depth [H, W] at which rays enter a box that stands on its frame's origin; inf where they miss."""
    eye_B = (eye_W - X_WB[:3, 3]) @ X_WB[:3, :3]
    ray_B = ray_W @ X_WB[:3, :3]
    lower, upper = np.array([-size[0] / 2, -size[1] / 2, 0.0]), np.array([size[0] / 2, size[1] / 2, size[2]])
    enter, leave = between_planes(lower - eye_B, upper - eye_B, ray_B)
    return np.where((enter < leave) & (enter > 0), enter, np.inf)


def between_planes(lower: NDArray, upper: NDArray, ray: NDArray) -> tuple[NDArray, NDArray]:
    """Where rays [H, W, n] from the origin enter and leave what is between two planes across each axis [n]."""
    enter, leave = np.full(ray.shape[:2], -np.inf), np.full(ray.shape[:2], np.inf)
    with np.errstate(divide="ignore", invalid="ignore"):
        for axis in range(ray.shape[2]):
            a, b = lower[axis] / ray[..., axis], upper[axis] / ray[..., axis]
            enter, leave = np.maximum(enter, np.minimum(a, b)), np.minimum(leave, np.maximum(a, b))
    return enter, leave
