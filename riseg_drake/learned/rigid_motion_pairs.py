"""Image pairs of bodies that move rigidly over a table, drawn, with the flow that they have: to learn from.

Boxes and ellipsoids with waves, patches or one colour are met by each pixel's ray, so flow is exact. Some of
them are blank: where nothing can be seen to move, the network must learn from edges and from what is around.
The table always has a texture, often a faint one: on a blank one any flow would do, and the pipeline asks for
none there.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from riseg_drake.geometry.camera import Intrinsics, back_project, project, rays
from riseg_drake.geometry.se3 import inverse, move_points


@dataclass
class PairParameters:
    """What is drawn; lengths in m, the camera's as for the wrist camera at half its resolution."""

    width: int = 128
    """Pixels, a multiple of 8."""
    height: int = 128
    """Pixels, a multiple of 8."""
    focal_length: float = 308.0
    """Pixels."""
    bodies_max: int = 6
    """Bodies in one image, from 1 up."""
    body_motion: float = 0.02
    """m; largest displacement of a body on the table ..."""
    body_turn: float = 0.25
    """... and its largest turn, rad; one body in three stands still."""
    camera_motion: float = 0.006
    """m; standard deviation of the camera's displacement along each axis ..."""
    camera_turn: float = 0.01
    """... and of its turn about each, rad."""
    color_noise: float = 2.0
    """Standard deviation of gray values, of 255."""
    blank_bodies: float = 0.15
    """Share of the bodies that have one colour."""
    faintest: float = 0.15
    """Contrast of the faintest texture, as a share of the strongest."""


@dataclass(frozen=True)
class FlowPair:
    """Two images and the true flow from the first to the second."""

    color_0: NDArray[np.uint8]
    """[H, W, 3], RGB."""
    color_1: NDArray[np.uint8]
    """[H, W, 3], RGB."""
    flow: NDArray[np.float32]
    """[H, W, 2], pixels."""
    on_body: NDArray[np.bool_]
    """[H, W]; the pixels of image 0 that see a body, not the table."""


def draw_pair(rng: np.random.Generator, parameters: PairParameters) -> FlowPair:
    """One pair; the same generator state gives the same pair."""
    intrinsics = _intrinsics(rng, parameters)
    X_WC0 = _camera(rng)
    X_WC1 = X_WC0 @ _motion(
        rng.normal(0, parameters.camera_turn, 3), rng.normal(0, parameters.camera_motion, 3)
    )
    bodies = [_Body(rng, X_WC0, parameters) for _ in range(rng.integers(1, parameters.bodies_max + 1))]
    paint_table = _Paint(rng, parameters.faintest)
    light_W = rng.normal([0.0, 0.0, 3.0], 1.0)
    light_W /= np.linalg.norm(light_W)

    def look(X_WC: NDArray, poses: list[NDArray]) -> tuple[NDArray, NDArray, NDArray]:
        """Colour, depth and the number of the body (0: table)."""
        depth, number, normal_W = _see(intrinsics, X_WC, bodies, poses)
        p_WQ = move_points(X_WC, back_project(depth, intrinsics).astype(float))
        color: NDArray = paint_table.color(p_WQ)
        for k, (body, X_WB) in enumerate(zip(bodies, poses, strict=True), start=1):
            here = number == k
            color[here] = body.paint.color(move_points(inverse(X_WB), p_WQ[here]))
        brightness = 0.55 + 0.45 * np.clip(normal_W @ light_W, 0, 1)
        color = color * brightness[..., None] + rng.normal(0, parameters.color_noise, color.shape)
        return np.clip(np.rint(color), 0, 255).astype(np.uint8), depth, number

    color_0, depth_0, number = look(X_WC0, [body.X_WB0 for body in bodies])
    color_1, _, _ = look(X_WC1, [body.X_WB1 for body in bodies])
    p_WQ = move_points(X_WC0, back_project(depth_0, intrinsics).astype(float))
    for k, body in enumerate(bodies, start=1):
        here = number == k
        p_WQ[here] = move_points(body.X_WB1 @ inverse(body.X_WB0), p_WQ[here])
    uv_1 = project(move_points(inverse(X_WC1), p_WQ), intrinsics)
    uv_0 = np.stack(np.meshgrid(np.arange(intrinsics.width), np.arange(intrinsics.height)), axis=-1)
    return FlowPair(color_0, color_1, (uv_1 - uv_0).astype(np.float32), number > 0)


class _Paint:
    """What colour a body has where; it goes with the body."""

    def __init__(self, rng: np.random.Generator, faintest: float) -> None:
        """Draw a texture of any contrast down to `faintest`; 0: one colour."""
        self._base = rng.uniform(40, 255, 3).astype(np.float32)
        if rng.random() < 0.3:
            self._base[:] = rng.uniform(120, 250)  # gray or white, as much is
        contrast = np.exp(rng.uniform(np.log(faintest), 0)) if faintest else 0.0
        self._other = self._base + np.float32(contrast) * (
            rng.uniform(0, 255, 3).astype(np.float32) - self._base
        )
        self._steepness = rng.choice([0.4, 4.0])  # waves or patches
        lengths = np.exp(rng.uniform(np.log(0.006), np.log(0.05), 8))
        directions = rng.normal(size=(8, 3))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        self._waves = (2 * np.pi * directions / lengths[:, None]).astype(np.float32)
        self._phases = rng.uniform(0, 2 * np.pi, (8, 1)).astype(np.float32)

    def color(self, p_BQ: NDArray) -> NDArray[np.float32]:
        """[..., 3] of points [..., 3]."""
        waves = np.sin(self._waves @ p_BQ.reshape(-1, 3).T.astype(np.float32) + self._phases)
        height = waves.sum(0) / np.sqrt(len(waves))
        share = np.clip(0.5 + self._steepness * height, 0, 1).reshape(*p_BQ.shape[:-1], 1)
        return self._base + share * (self._other - self._base)


class _Body:
    """A box or an ellipsoid on the table, and where it is at both times."""

    def __init__(self, rng: np.random.Generator, X_WC: NDArray, parameters: PairParameters) -> None:
        self.half_size = rng.uniform([0.012, 0.012, 0.008], [0.05, 0.05, 0.03])
        self.is_box = rng.random() < 0.6
        is_blank = rng.random() < parameters.blank_bodies
        self.paint = _Paint(rng, 0.0 if is_blank else parameters.faintest)
        span = 0.7 * X_WC[2, 3] * parameters.width / parameters.focal_length
        x, y = X_WC[:2, 3] + rng.uniform(-span, span, 2) / 2
        self.X_WB0 = _motion([0, 0, rng.uniform(-np.pi, np.pi)], [x, y, self.half_size[2]])
        share = 0.0 if rng.random() < 1 / 3 else rng.uniform()
        direction, turn = rng.uniform(-np.pi, np.pi), rng.uniform(-1, 1) * share * parameters.body_turn
        step = share * parameters.body_motion * np.array([np.cos(direction), np.sin(direction), 0])
        self.X_WB1 = _motion([0, 0, turn], [0, 0, 0])
        self.X_WB1 = self.X_WB1 @ self.X_WB0
        self.X_WB1[:3, 3] = self.X_WB0[:3, 3] + step

    def enter(self, eye_B: NDArray, ray_B: NDArray) -> tuple[NDArray, NDArray]:
        """Depth [N] at which rays [3, N] enter (inf: never), and the normals [3, N] there."""
        half_size, eye_B = self.half_size[:, None], eye_B[:, None]
        with np.errstate(divide="ignore", invalid="ignore"):
            if self.is_box:
                t = np.stack([(-half_size - eye_B) / ray_B, (half_size - eye_B) / ray_B])
                near, far = t.min(0), t.max(0)
                depth = near.max(0)
                normal = -np.sign(ray_B) * (near == depth)
                return np.where(depth < far.min(0), depth, np.inf), normal
            e, r = eye_B / half_size, ray_B / half_size
            a, b, c = (r * r).sum(0), (r * e).sum(0), (e * e).sum() - 1
            root = np.sqrt(b * b - a * c)  # not a number where the ray misses
            depth = np.nan_to_num((-b - root) / a, nan=np.inf)
            normal = (eye_B + np.where(np.isfinite(depth), depth, 0) * ray_B) / half_size**2
            return depth, normal / np.linalg.norm(normal, axis=0)


def _see(
    intrinsics: Intrinsics, X_WC: NDArray, bodies: list[_Body], poses: list[NDArray]
) -> tuple[NDArray, NDArray, NDArray]:
    """Depth [H, W], the body's number [H, W] and the normal in the world [H, W, 3] behind every pixel."""
    ray_W = X_WC[:3, :3] @ rays(intrinsics).astype(float).reshape(-1, 3).T  # [3, N]: sums over 3 are fast so
    depth = -X_WC[2, 3] / ray_W[2]
    number = np.zeros(depth.shape, np.uint16)
    normal_W = np.tile([[0.0], [0.0], [1.0]], depth.shape)
    for k, (body, X_WB) in enumerate(zip(bodies, poses, strict=True), start=1):
        R_WB = X_WB[:3, :3]
        enter, normal_B = body.enter(R_WB.T @ (X_WC[:3, 3] - X_WB[:3, 3]), R_WB.T @ ray_W)
        nearer = enter < depth
        depth[nearer], number[nearer] = enter[nearer], k
        normal_W[:, nearer] = R_WB @ normal_B[:, nearer]
    return (
        depth.reshape(intrinsics.shape),
        number.reshape(intrinsics.shape),
        normal_W.T.reshape(*intrinsics.shape, 3),
    )


def _intrinsics(rng: np.random.Generator, parameters: PairParameters) -> Intrinsics:
    width, height, f = parameters.width, parameters.height, parameters.focal_length
    return Intrinsics(width, height, f, f, (width - 1) / 2, (height - 1) / 2)


def _camera(rng: np.random.Generator) -> NDArray:
    """X_WC of a camera that looks down, more or less."""
    upside_down = np.eye(4)
    upside_down[:3, :3] = np.diag([1.0, -1.0, -1.0])
    tilt = [*rng.normal(0, 0.15, 2), rng.uniform(-np.pi, np.pi)]
    return _motion([0, 0, 0], [0, 0, rng.uniform(0.3, 0.5)]) @ upside_down @ _motion(tilt, [0, 0, 0])


def _motion(turn: NDArray | list, displacement: NDArray | list) -> NDArray[np.float64]:
    """[4, 4] of a rotation vector, rad, and a displacement, m."""
    X = np.eye(4)
    X[:3, :3] = Rotation.from_rotvec(turn).as_matrix()
    X[:3, 3] = displacement
    return X
