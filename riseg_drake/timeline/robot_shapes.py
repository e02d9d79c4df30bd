"""A robot for the viewer: the convex hulls of what is seen of it, moved by its joint angles."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import Role
from pydrake.multibody.tree import Frame
from scipy.spatial import ConvexHull

from riseg_drake.robot.silhouette import Kinematics, hull_corners


@dataclass(frozen=True)
class Piece:
    """One shape of one body."""

    body: str
    """The body's name, with its model's before it."""
    name: str
    corners: NDArray[np.float64]
    """[N, 3], in the body's frame, m."""
    triangles: NDArray[np.intp]
    """[M, 3], of its convex hull, seen from outside counter-clockwise."""


class RobotShapes:
    """The shapes of a robot, and where they are. Raises UnknownShapeError for one that cannot be drawn."""

    def __init__(self, kinematics: Kinematics):
        self._kinematics = kinematics
        self._frames: dict[str, Frame] = {}
        self.pieces: list[Piece] = []
        plant, inspector = kinematics.plant, kinematics.inspector
        for instance in kinematics.models:
            for index in plant.GetBodyIndices(instance):
                body = plant.get_body(index)
                name = f"{plant.GetModelInstanceName(instance)}/{body.name()}"
                shapes = inspector.GetGeometries(plant.GetBodyFrameIdOrThrow(index), Role.kPerception)
                for number, geometry in enumerate(shapes):
                    X_BG = inspector.GetPoseInFrame(geometry)
                    corners = (X_BG @ hull_corners(inspector.GetShape(geometry)).T).T
                    self.pieces.append(Piece(name, f"shape_{number}", corners, _triangles(corners)))
                    self._frames[name] = body.body_frame()

    def poses(self, q: NDArray) -> dict[str, NDArray[np.float64]]:
        """X_WB [4, 4] of each body with a shape, by name, at joint angles q, rad."""
        return {name: self._kinematics.X_WA(q, frame) for name, frame in self._frames.items()}


def _triangles(corners: NDArray) -> NDArray[np.intp]:
    hull = ConvexHull(corners)
    triangles = hull.simplices.copy()
    a, b, c = (corners[triangles[:, k]] for k in range(3))
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), hull.equations[:, :3]) < 0
    triangles[inward] = triangles[inward][:, ::-1]
    return triangles
