"""How wide, thick and long a tool is, and what room is below the rest of it, by its collision geometry.

The tool is looked at upright, as it pushes: E's z axis points down, x along the push. Its tip is all of it that
is at most TIP_REACH above E; what is beside the tip's cross section further up hangs over the table, and things
must be low enough to stand below.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import SceneGraphInspector
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, ModelInstanceIndex
from scipy.spatial import ConvexHull, QhullError

from riseg_drake.robot.shape_corners import shape_corners
from riseg_drake.robot.tool import ToolError

TIP_REACH = 0.015
"""So high above its end face the tool counts as its tip, m."""
ASKEW = 0.001
"""The frame `tip` lies so near to the middle of the end face, m."""
_SLAB = 0.010
"""Above the tip the tool is measured in slabs of this height, m."""


@dataclass(frozen=True)
class Overhang:
    """A part of the tool beside its tip, as the rectangle in E around it and all that is above."""

    bottom: float
    """Height of its lowest point above E, m."""
    x: tuple[float, float]
    """From and to, along E's x, m."""
    y: tuple[float, float]
    """From and to, along E's y, m."""

    def covers(self, other: "Overhang") -> bool:
        """Whether nothing that has room below this one could touch the other."""
        return (
            self.bottom <= other.bottom + 1e-9
            and self.x[0] <= other.x[0] + 1e-6
            and self.x[1] >= other.x[1] - 1e-6
            and self.y[0] <= other.y[0] + 1e-6
            and self.y[1] >= other.y[1] - 1e-6
        )

    def turned(self) -> "Overhang":
        """The same of a tool that pushes with its back."""
        return Overhang(self.bottom, (-self.x[1], -self.x[0]), (-self.y[1], -self.y[0]))


@dataclass(frozen=True)
class ToolShape:
    """A tool as a push needs to know it: a tip with a rectangular cross section, and what hangs over."""

    thickness: float
    """Extent of the tip along E's x, the push direction, m."""
    width: float
    """Extent of the tip along E's y, m."""
    length: float
    """From the flange (panda_link8) to the end face, m."""
    overhangs: tuple[Overhang, ...] = ()

    def turned(self) -> "ToolShape":
        """The same tool, pushing with its back."""
        return replace(self, overhangs=tuple(overhang.turned() for overhang in self.overhangs))


def tool_shape(
    plant: MultibodyPlant,
    inspector: SceneGraphInspector,
    tool: ModelInstanceIndex,
    tip_frame: Frame,
    flange: Frame,
    name: str,
) -> ToolShape:
    """Measure a tool in a finalized plant; `name` begins what is said about it.

    Raises ToolError: no collision geometry, or the frame `tip` is not in the middle of the tip's end face.
    """
    context = plant.CreateDefaultContext()
    pieces = []
    for index in plant.GetBodyIndices(tool):
        body = plant.get_body(index)
        X_EB = body.body_frame().CalcPose(context, tip_frame)
        for geometry in plant.GetCollisionGeometriesForBody(body):
            try:
                corners = shape_corners(inspector.GetShape(geometry))
            except (ValueError, RuntimeError) as error:
                raise ToolError(f"{name}: {error}") from None
            p_EQ = (X_EB @ inspector.GetPoseInFrame(geometry)).multiply(corners.T).T
            pieces.append(_Piece(p_EQ * [1.0, 1.0, -1.0]))
    if not pieces:
        raise ToolError(f"{name}: no collision geometry; the tip's thickness and width are measured on it")
    lowest = min(piece.corners[:, 2].min() for piece in pieces)
    if abs(lowest) > ASKEW:
        raise ToolError(
            f"{name}: its collision geometry ends {1e3 * abs(lowest):.1f} mm "
            f"{'above' if lowest > 0 else 'below'} the frame `tip`; that belongs on the end face, z out"
        )
    tip = np.vstack([piece.between(lowest, lowest + TIP_REACH) for piece in pieces])[:, :2]
    middle = (tip.min(axis=0) + tip.max(axis=0)) / 2
    if np.abs(middle).max() > ASKEW:
        raise ToolError(
            f"{name}: the middle of its tip is {1e3 * middle[0]:.1f} mm along x and {1e3 * middle[1]:.1f} mm "
            "along y from the frame `tip`; that belongs in it"
        )
    thickness, width = np.ptp(tip, axis=0)
    if min(thickness, width) < ASKEW:
        raise ToolError(
            f"{name}: its tip is {1e3 * thickness:.1f} x {1e3 * width:.1f} mm; nothing can be pushed by it"
        )
    X_EF = flange.CalcPose(context, tip_frame)
    return ToolShape(
        thickness=round(float(thickness), 9),
        width=round(float(width), 9),
        length=round(-float(X_EF.translation()[2]), 9),
        overhangs=_overhangs(pieces, tip, lowest + TIP_REACH),
    )


class _Piece:
    """A convex piece of the tool, seen from E with z upwards."""

    def __init__(self, corners: NDArray):
        self.corners = corners
        """[N, 3], m."""
        try:
            sides = ConvexHull(corners).simplices
            self._edges = np.vstack([sides[:, [i, (i + 1) % 3]] for i in range(3)])
        except QhullError:  # flat
            self._edges = np.array([(i, j) for i in range(len(corners)) for j in range(i)])

    def between(self, low: float, high: float) -> NDArray[np.float64]:
        """The corners [N, 3] of the part at heights from low to high, m; none where it is not there."""
        z = self.corners[:, 2]
        cut = [self.corners[(z >= low - 1e-9) & (z <= high + 1e-9)]]
        start, end = self.corners[self._edges[:, 0]], self.corners[self._edges[:, 1]]
        for level in (low, high):
            crossing = (start[:, 2] < level) != (end[:, 2] < level)
            a, b = start[crossing], end[crossing]
            cut.append(a + (level - a[:, 2:]) / (b[:, 2:] - a[:, 2:]) * (b - a))
        return np.vstack(cut)


def _overhangs(pieces: Sequence[_Piece], tip: NDArray, above: float) -> tuple[Overhang, ...]:
    """What is beside the tip's corners [N, 2] from a height on, m, lowest first."""
    kept = [_around(tip, 0.0)]
    for piece in pieces:
        top = piece.corners[:, 2].max()
        for low in np.arange(above, top, _SLAB):
            corners = piece.between(low, min(low + _SLAB, top))
            if len(corners):
                kept.append(_around(corners[:, :2], float(corners[:, 2].min())))
    kept.sort(key=lambda overhang: overhang.bottom)
    apart: list[Overhang] = []
    for each in kept:  # of two that cover each other, the first
        if not any(other.covers(each) for other in apart):
            apart.append(each)
    return tuple(each for each in apart if each.bottom > 0)


def _around(corners: NDArray, bottom: float) -> Overhang:
    (x_min, y_min), (x_max, y_max) = corners.min(axis=0), corners.max(axis=0)
    return Overhang(bottom, (float(x_min), float(x_max)), (float(y_min), float(y_max)))
