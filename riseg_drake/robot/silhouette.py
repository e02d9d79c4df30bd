"""The pixels that the robot covers in its own camera, from its joint angles alone."""

from dataclasses import dataclass
from typing import Protocol

import cv2
import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import Role, SceneGraphInspector, Shape
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, ModelInstanceIndex, RigidBody
from scipy.spatial import ConvexHull

from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.robot.shape_corners import shape_corners

NEAR = 0.01
"""What is nearer to the camera's centre than this is not drawn, m."""
_SUBPIXEL_BITS = 4
_FLAT = 1e-6
"""Share of a mesh's size, below which it has no volume."""
_THIN = 5e-4
"""m; half of how thick it is taken for then."""
_NEARLY_ONE = 0.1
"""Faces that meet at a corner count as one in directions in which their normals differ by less than this."""
_LARGEST = 1e6
"""m; corners farther away are none."""


class UnknownShapeError(ValueError):
    """Which shape of a robot cannot be drawn, and what would be right, in one line."""


class Kinematics(Protocol):
    """A robot with a camera on it: what must be known of it to draw its outline."""

    plant: MultibodyPlant

    @property
    def inspector(self) -> SceneGraphInspector:
        """What shapes it has."""
        ...

    @property
    def models(self) -> tuple[ModelInstanceIndex, ...]:
        """What in `plant` is the robot."""
        ...

    def X_WA(self, q: NDArray, frame: Frame) -> NDArray[np.float64]:
        """Pose [4, 4] of any frame of `plant` at joint angles q, rad."""
        ...

    def X_WC(self, q: NDArray) -> NDArray[np.float64]:
        """Pose [4, 4] of the camera's optical frame at q."""
        ...


@dataclass(frozen=True)
class _Hull:
    """A convex piece of a body: corners [N, 3] in the body's frame, and the edges [M, 2] between."""

    body: RigidBody
    corners: NDArray[np.float64]
    edges: NDArray[np.intp]


class RobotSilhouette:
    """Draws the robot's outline into the camera's picture by projecting the convex hulls of its shapes.

    Depth and colour have their own errors at the robot's edge: everything grows by `margin_m` metres on
    the robot and by `margin_px` pixels in the picture.
    """

    def __init__(
        self,
        kinematics: Kinematics,
        intrinsics: Intrinsics,
        margin_m: float = 0.001,
        margin_px: float = 1.0,
    ):
        self._kinematics = kinematics
        self._intrinsics = intrinsics
        self._margin_px = margin_px
        self._hulls = _visible_hulls(kinematics, margin_m)

    def mask(self, q: NDArray) -> NDArray[np.bool_]:
        """True where the robot at joint angles q is in the way, [H, W]."""
        k = self._intrinsics
        image = np.zeros(k.shape, np.uint8)
        X_CW = np.linalg.inv(self._kinematics.X_WC(q))
        X_CB: dict[RigidBody, NDArray] = {}
        for hull in self._hulls:
            if hull.body not in X_CB:
                X_CB[hull.body] = X_CW @ self._kinematics.X_WA(q, hull.body.body_frame())
            R, p = X_CB[hull.body][:3, :3], X_CB[hull.body][:3, 3]
            corners = _ahead_of_camera(hull.corners @ R.T + p, hull.edges)
            if corners is not None:
                self._draw(image, corners)
        return image.astype(bool)

    def _draw(self, image: NDArray[np.uint8], p_CQ: NDArray) -> None:
        """Fill the outline of points p_CQ [N, 3], all ahead of the camera."""
        k = self._intrinsics
        z = p_CQ[:, 2]
        uv = np.stack([p_CQ[:, 0] / z * k.fx + k.cx, p_CQ[:, 1] / z * k.fy + k.cy], axis=-1)
        margin = self._margin_px
        if (uv.max(axis=0) < -margin).any() or (uv.min(axis=0) > (k.width + margin, k.height + margin)).any():
            return
        # Far outside the picture a coordinate would overflow; out there only its direction counts.
        uv = np.clip(uv, -20 * k.width, 20 * k.width)
        outline = cv2.convexHull(np.round(uv * (1 << _SUBPIXEL_BITS)).astype(np.int32))
        cv2.fillConvexPoly(image, outline, 1, shift=_SUBPIXEL_BITS)
        cv2.polylines(image, [outline], True, 1, round(2 * margin) + 1, shift=_SUBPIXEL_BITS)


def _ahead_of_camera(p_CQ: NDArray, edges: NDArray) -> NDArray | None:
    """The part of a convex body at z >= NEAR: corners there, and where edges pierce that plane."""
    z = p_CQ[:, 2]
    if z.max() <= NEAR:
        return None
    if z.min() >= NEAR:
        return p_CQ
    crossing = edges[(z[edges[:, 0]] < NEAR) != (z[edges[:, 1]] < NEAR)]
    start, end = p_CQ[crossing[:, 0]], p_CQ[crossing[:, 1]]
    share = (NEAR - start[:, 2]) / (end[:, 2] - start[:, 2])
    return np.concatenate([p_CQ[z >= NEAR], start + share[:, None] * (end - start)])


def _visible_hulls(kinematics: Kinematics, margin: float) -> list[_Hull]:
    plant, inspector = kinematics.plant, kinematics.inspector
    hulls = []
    for instance in kinematics.models:
        for body_index in plant.GetBodyIndices(instance):
            body = plant.get_body(body_index)
            frame = plant.GetBodyFrameIdOrThrow(body_index)
            for geometry in inspector.GetGeometries(frame, Role.kPerception):
                corners, edges = _grown(hull_corners(inspector.GetShape(geometry)), margin)
                X_BG = inspector.GetPoseInFrame(geometry)
                hulls.append(_Hull(body, (X_BG @ corners.T).T, edges))
    return hulls


def _grown(points: NDArray, margin: float) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """Corners [N, 3] and edges [M, 2] of the convex hull of points, every face moved out by `margin`."""
    hull = ConvexHull(points)
    corners = points[hull.vertices]
    triangles = np.searchsorted(np.sort(hull.vertices), hull.simplices)
    triangles = np.argsort(hull.vertices)[triangles]
    edges = np.concatenate([triangles[:, [i, (i + 1) % 3]] for i in range(3)])
    # A corner moves to where all its faces go; of faces that are nearly one, as far as these say.
    faces = np.column_stack([triangles.ravel(), np.repeat(hull.equations[:, :3], 3, axis=0).round(6)])
    faces = np.unique(faces, axis=0)
    corner, normal = faces[:, 0].astype(int), faces[:, 1:]
    A, b = np.zeros((len(corners), 3, 3)), np.zeros((len(corners), 3))
    np.add.at(A, corner, normal[:, :, None] * normal[:, None])
    np.add.at(b, corner, margin * normal)
    moved = corners + np.einsum("nij,nj->ni", np.linalg.pinv(A, rcond=_NEARLY_ONE**2, hermitian=True), b)
    return moved, np.unique(np.sort(edges, axis=1), axis=0)


def hull_corners(shape: Shape) -> NDArray[np.float64]:
    """Points [N, 3], m, whose convex hull is a shape's, or very nearly.

    Something flat, as a sticker is, becomes a millimetre thick. Raises UnknownShapeError.
    """
    try:
        corners = shape_corners(shape)
    except (RuntimeError, ValueError) as error:
        reason = " ".join(str(error).split())
        raise UnknownShapeError(
            f"a visual of the robot cannot be read; a mesh should be .obj, .gltf or .vtk ({reason})"
        ) from None
    return _with_volume(corners)


def _with_volume(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Corners [N, 3] as they are, or [8 N, 3] about them where they are flat."""
    if not (np.abs(points) < _LARGEST).all():
        raise UnknownShapeError("a mesh has corners that are nowhere")
    extents = np.linalg.svd(points - points.mean(axis=0), compute_uv=False) if len(points) > 3 else np.zeros(3)
    if extents[-1] > _FLAT * max(float(extents[0]), _FLAT):
        return points
    signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T
    return (points[:, None] + _THIN * signs).reshape(-1, 3)
