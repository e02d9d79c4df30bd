"""Where one thing may lie on another: pushed, both go as one, and that says little of their being one.

A thing that lies on another ends above it in a step. So does the rim of a mug above its floor, but that is a
hollow: all around it the wall is higher, and water would stay in it. From what carries something, it runs off.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from riseg_drake.segmentation.border_pixels import border_pixels
from riseg_drake.segmentation.scales import LOWEST
from riseg_drake.segmentation.superpixels import Superpixels

_NEAR, _FAR = 2, 7
"""Pixels from a border between which a slope is measured: nearer, heights are blurred."""
_COARSE = 2
"""Every so many pixels are asked whether they lie in a hollow."""


def may_lie_on(cut: Superpixels, height: NDArray[np.float32]) -> NDArray[np.bool_]:
    """[M], borders along most of which one side may lie on the other.

    Args:
        cut: N superpixels with M borders.
        height: [H, W], m above the table, smoothed over some pixels; 0 where nothing stands.
    """
    hollow = in_a_hollow(height)
    steps, pixels = np.zeros(len(cut.borders)), np.zeros(len(cut.borders))
    for places in border_pixels(cut):
        before, after = (places.beside(height, offset) for offset in (-_NEAR, 1 + _NEAR))
        # What goes on as it does on either side is a slope.
        slopes = [
            np.abs(near - places.beside(height, far)) for near, far in ((before, -_FAR), (after, 1 + _FAR))
        ]
        step = np.abs(after - before) - np.maximum(*slopes) > LOWEST
        below = np.where(before < after, places.beside(hollow, -_NEAR), places.beside(hollow, 1 + _NEAR))
        step &= ~below
        steps += np.bincount(places.border, step, len(steps))
        pixels += np.bincount(places.border, minlength=len(steps))
    return 2 * steps > pixels


def in_a_hollow(height: NDArray[np.float32]) -> NDArray[np.bool_]:
    """[H, W], what is deeper than all ways out of it, by more than the least step."""
    few = np.pad(height[::_COARSE, ::_COARSE], 1)  # all around it is the table
    hollow = np.zeros(few.shape, bool)
    for level in np.arange(LOWEST, float(few.max(initial=0.0)), LOWEST):
        low = few <= level
        label = cv2.connectedComponents(low.view(np.uint8), connectivity=4)[1]
        hollow |= low & (label != label[0, 0]) & (few < level - LOWEST)
    inner = hollow[1:-1, 1:-1].repeat(_COARSE, axis=0).repeat(_COARSE, axis=1)
    return inner[: height.shape[0], : height.shape[1]]
