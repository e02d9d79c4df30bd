"""Body frames on the image they were drawn from, with the motion that each one's twist stands for."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import EllipseCollection
from numpy.typing import NDArray

from riseg_drake.geometry.camera import Intrinsics, project
from riseg_drake.geometry.se3 import exp_se3
from riseg_drake.pictures.object_colors import hex_color
from riseg_drake.pictures.panels import show_image

_PALE = 0.55
"""How much of the image is left under what is drawn on it; the rest is white."""
_NO_GROUP = "#777777"


def group_colors(group: NDArray) -> list[str]:
    """A colour for each member of groups 0, 1, ... [K], that of object 1, 2, ...; gray for -1."""
    return [_NO_GROUP if g < 0 else hex_color(int(g) + 1) for g in group]


def pale(color: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """An image [H, W, 3] as a background to draw on."""
    return (255 - _PALE * (255.0 - color)).astype(np.uint8)


def twist_flow(V_S: NDArray, p_C0S: NDArray, p_C0Q: NDArray, intrinsics: Intrinsics) -> NDArray[np.float64]:
    """Where the twists V_S [K, 6] take the points p_C0Q [K, 3] in the image, (du, dv) [K, 2], pixels.

    {s} has its origin at p_C0S [3] and the axes of C0.
    """
    X = exp_se3(V_S)
    p_SQ = p_C0Q - p_C0S
    moved = np.einsum("kij,kj->ki", X[:, :3, :3], p_SQ) + X[:, :3, 3] + p_C0S
    return project(moved, intrinsics) - project(p_C0Q, intrinsics)


def show_body_frames(
    axes: Axes,
    color: NDArray[np.uint8],
    pixel: NDArray,
    diameter: NDArray,
    group: NDArray,
    flow: NDArray | None = None,
    magnified: float = 4.0,
) -> None:
    """Each body frame as a circle around its points, in its group's colour, with an arrow for its motion.

    Args:
        axes: to draw on.
        color: [H, W, 3], the image at t-1.
        pixel: [K, 2], the seeds (v, u).
        diameter: [K], of the frames' points, pixels.
        group: [K], 0, 1, ...; -1 for none.
        flow: [K, 2], where each one's twist takes it, pixels; no arrows if None.
        magnified: how many times too long arrows are.
    """
    show_image(axes, pale(color))
    colors, uv = group_colors(group), pixel[:, ::-1]
    circles = EllipseCollection(
        diameter,
        diameter,
        np.zeros(len(uv)),
        units="x",
        offsets=uv,
        offset_transform=axes.transData,
        facecolors=[c + "40" for c in colors],
        edgecolors=colors,
        linewidths=0.8,
    )
    axes.add_collection(circles)
    if flow is not None and len(uv):
        axes.quiver(
            *uv.T,
            *flow.T,
            angles="xy",
            scale_units="xy",
            scale=1 / magnified,
            width=0.0045,
            color=colors,
            edgecolor="black",
            linewidth=0.3,
        )
