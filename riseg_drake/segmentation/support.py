"""Where one thing may lie on another: pushed, both go as one, and that says little of their being one.

A thing that lies on another ends above it in a step. So does the rim of a mug above its floor, but that is a
hollow: all around it the wall is higher, and water would stay in it. So does a foot or a knob, but that ends
amid what it belongs to, while a thing that lies on another mostly sticks out over its edge.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from riseg_drake.segmentation.border_pixels import BorderPixels, border_pixels
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
    along = [(places, _steps(places, height, hollow)) for places in border_pixels(cut)]
    contour = np.zeros(height.shape, bool)
    for places, step in along:
        contour[*places.pixel[:, step]] = True
    over = _reaching(contour, cut.label < 0)
    steps, pixels = np.zeros(len(cut.borders)), np.zeros(len(cut.borders))
    for places, step in along:
        steps += np.bincount(places.border, step & over[*places.pixel], len(steps))
        pixels += np.bincount(places.border, minlength=len(steps))
    return 2 * steps > pixels


def _steps(places: BorderPixels, height: NDArray[np.float32], hollow: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """At which of K places heights step by more than what goes on as a slope, down to what is no hollow."""
    before, after = (places.beside(height, offset) for offset in (-_NEAR, 1 + _NEAR))
    slopes = [np.abs(near - places.beside(height, far)) for near, far in ((before, -_FAR), (after, 1 + _FAR))]
    below = np.where(before < after, places.beside(hollow, -_NEAR), places.beside(hollow, 1 + _NEAR))
    return (np.abs(after - before) - np.maximum(*slopes) > LOWEST) & ~below


def _reaching(contour: NDArray[np.bool_], outside: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """[H, W], those connected parts of a contour that reach the outline of all that stands there, or the end of
    the image; places at most two times two pixels from each other are connected."""
    reach = np.ones((2 * _NEAR + 1, 2 * _NEAR + 1), np.uint8)
    number, label = cv2.connectedComponents(cv2.dilate(contour.view(np.uint8), reach))
    beyond = cv2.dilate(np.pad(outside, 1, constant_values=True).view(np.uint8), reach)[1:-1, 1:-1]
    reaches = np.zeros(number, bool)
    reaches[label[beyond > 0]] = True
    return contour & reaches.take(label)


def in_a_hollow(height: NDArray[np.float32]) -> NDArray[np.bool_]:
    """[H, W], what is deeper than all ways out of it, by more than the least step."""
    few = np.pad(height[::_COARSE, ::_COARSE], 1)  # all around it is the table
    hollow = np.zeros(few.shape, bool)
    for level in np.arange(LOWEST, float(few.max(initial=0.0)), LOWEST):
        label = cv2.connectedComponents((few <= level).view(np.uint8), connectivity=4)[1]
        hollow |= (few < level - LOWEST) & (label != label[0, 0])
    inner = hollow[1:-1, 1:-1].repeat(_COARSE, axis=0).repeat(_COARSE, axis=1)
    return inner[: height.shape[0], : height.shape[1]]
