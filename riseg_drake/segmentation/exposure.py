"""Automatic exposure: between two frames everything may become brighter or darker at once (not in the paper).

Gray values are compared by many stages. So each new frame's are brought to the exposure of its reference
frame, by the median ratio over what both frames see of a scene that mostly stands still.
"""

from dataclasses import replace

import numpy as np

from riseg_drake.geometry.rgbd import FramePair
from riseg_drake.segmentation.surface import seek, surface_pixels

_STEP = 16
"""Every so many pixels in both directions are compared."""
_DARK, _BRIGHT = 12.0, 245.0
"""Gray levels; what is darker is mostly noise, what is brighter may be cut off."""
_SAMPLES_MIN = 60
_CHANGE_MIN = 0.01
"""A smaller relative change is noise, or none."""


def with_equal_exposure(pair: FramePair) -> FramePair:
    """The pair with the current frame's gray values as the reference frame's exposure would have made them."""
    reference, current = pair.reference, pair.current
    some = np.zeros(reference.depth.shape, bool)
    some[::_STEP, ::_STEP] = ~reference.robot[::_STEP, ::_STEP]
    pixels = surface_pixels(some, reference.depth, reference.intrinsics)
    v, u = pixels.pixel
    before = reference.gray[v, u]
    after = seek(pixels, pair.X_C1C0).read_between(current.unhidden_gray)
    # What is cut off shows in the values that the sensor gave.
    sensed = after / np.float32(current.gain), before / np.float32(reference.gain)
    with np.errstate(invalid="ignore"):
        fit = np.logical_and.reduce([(gray > _DARK) & (gray < _BRIGHT) for gray in sensed])
    if np.count_nonzero(fit) < _SAMPLES_MIN:
        return pair
    ratio = float(np.median(before[fit] / after[fit]))
    if abs(ratio - 1) < _CHANGE_MIN:
        return pair
    return replace(pair, current=replace(current, gain=current.gain * ratio))
