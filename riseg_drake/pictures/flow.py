"""Optical flow as colour: hue says where to, saturation how far."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle
from numpy.typing import NDArray

from riseg_drake.geometry.camera import WHOLE, Region, pixel_grid
from riseg_drake.pictures.color_vision import srgb_from_oklab
from riseg_drake.pictures.panels import INK, show_image

_UNKNOWN = np.array([205, 205, 205], np.uint8)
"""Where flow is NaN."""
_LIGHTNESS = (1.0, 0.68)
"""Of no flow, and of the longest; equal in all directions, so that none looks stronger than another."""
_CHROMA = 0.125
_WHEEL = 61
"""Pixels across the wheel that explains the colours."""


def flow_colors(flow: NDArray, longest: float) -> NDArray[np.uint8]:
    """RGB [H, W, 3] of flow [H, W, 2]; white is none, full colour `longest` pixels or more, gray NaN."""
    share = np.clip(np.linalg.norm(flow, axis=-1) / longest, 0, 1)
    direction = np.arctan2(flow[..., 1], flow[..., 0])
    low, high = _LIGHTNESS
    lab = np.stack(
        [low + (high - low) * share, _CHROMA * share * np.cos(direction), _CHROMA * share * np.sin(direction)],
        axis=-1,
    )
    known = np.isfinite(share)
    colors = np.round(255 * srgb_from_oklab(np.where(known[..., None], lab, 0)))
    return np.where(known[..., None], colors.astype(np.uint8), _UNKNOWN)


def show_flow(axes: Axes, flow: NDArray, longest: float, region: Region = WHOLE, arrow: int = 32) -> None:
    """Flow [H, W, 2] as colour with the wheel that explains it, and an arrow every `arrow` pixels.

    Args:
        axes: to draw on.
        flow: pixels; NaN where it is unknown.
        longest: what has the full colour, and an arrow as long as their distance, pixels.
        region: of the image, to be shown.
        arrow: distance of the arrows, pixels.
    """
    shown = flow[region]
    show_image(axes, flow_colors(shown, longest))
    half = arrow // 2
    uv = pixel_grid(*shown.shape[:2])[half::arrow, half::arrow].reshape(-1, 2)
    d_uv = shown[half::arrow, half::arrow].reshape(-1, 2)
    with np.errstate(invalid="ignore"):
        far = np.linalg.norm(d_uv, axis=1) > 0.08 * longest
    uv, d_uv = uv[far], d_uv[far] * (arrow / longest)
    axes.quiver(
        *uv.T,
        *d_uv.T,
        angles="xy",
        scale_units="xy",
        scale=1,
        width=0.004,
        color=INK,
        headwidth=4,
        headlength=4,
    )
    _show_wheel(axes, longest)


def _show_wheel(axes: Axes, longest: float) -> None:
    offset = (pixel_grid(_WHEEL, _WHEEL) - _WHEEL // 2) / (_WHEEL // 2)
    wheel = flow_colors(offset.astype(float), 1.0)
    outside = np.linalg.norm(offset, axis=-1, keepdims=True) > 1
    inset = axes.inset_axes((0.82, 0.02, 0.17, 0.29))
    inset.imshow(np.concatenate([wheel, np.where(outside, 0, 255).astype(np.uint8)], axis=-1))
    inset.add_patch(Circle((_WHEEL // 2, _WHEEL // 2), _WHEEL // 2, fill=False, ec=INK, lw=0.6))
    inset.set_axis_off()
    inset.set_title(f"{longest:g} px", fontsize=7, color=INK, pad=2)
