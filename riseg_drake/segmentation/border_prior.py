"""What the still picture says of each border: may its two sides be one body? Motion overrules it.

Where one thing ends and another begins there is mostly a step of depth, a dent, or a change of colour: what
static methods know. How much each is worth is about what a logistic regression says on rendered toys and
household things with true labels: rims of bowls and prints are borders inside one thing as often as not.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from riseg_drake.segmentation.keyframe import Keyframe


@dataclass
class BorderPriorParameters:
    """Log-odds, nats, that both sides are one body; worth of each cue, and where it saturates."""

    smooth: float = 2.5
    """Of a border without any cue."""
    step: float = 0.0
    """For each mm of height across the border, up to 10."""
    dent: float = -0.2
    """For each mm that the border lies below the mean of its two sides, up to 10."""
    valley: float = -0.6
    """For each mm that it lies below the lower one, up to 10."""
    color: float = -0.045
    """For each gray level of colour difference, up to 60."""
    hole: float = -1.6
    """For the share of its pixels without depth, as far as that is more than the share on both sides."""
    most: float = 2.0
    """A still picture proves nothing: log-odds, nats, are no more than that, ..."""
    least: float = -1.5
    """... and no less than that, nats."""


_NEAR, _FAR = 2, 4
"""Pixels from the border at which heights are compared."""


def border_prior(keyframe: Keyframe, parameters: BorderPriorParameters) -> NDArray[np.float64]:
    """[M], log-odds that the two sides of each border are one body, by the keyframe alone."""
    cues = border_cues(keyframe)
    weight = np.array(
        [parameters.step, parameters.dent, parameters.valley, parameters.color, parameters.hole], np.float64
    )
    odds = np.clip(parameters.smooth + cues @ weight, parameters.least, parameters.most)
    # Of what may go on behind something the still picture says nothing.
    return np.where(keyframe.superpixels.behind, 0.0, odds)


def border_cues(keyframe: Keyframe) -> NDArray[np.float64]:
    """[M, 5]: step, dent and valley, mm; colour difference, gray levels; share without depth, beyond that of
    both sides; means along each border, saturated."""
    region, count, borders = keyframe.region, keyframe.count, keyframe.borders
    label = keyframe.superpixels.label
    height = cv2.medianBlur(keyframe.height, 5)
    color = cv2.GaussianBlur(keyframe.frame.color[region], (0, 0), 1.0).astype(np.float32)
    measured = keyframe.frame.depth[region] > 0
    code = borders[:, 0] * count + borders[:, 1]  # rising, as the superpixels list them
    sums, pixels = np.zeros((5, len(borders))), np.zeros(len(borders))
    for axis in (0, 1):
        a, b = (label[:-1], label[1:]) if axis == 0 else (label[:, :-1], label[:, 1:])
        vu = np.stack(np.nonzero((a != b) & (a >= 0) & (b >= 0)))
        low, high = np.minimum(a[*vu], b[*vu]), np.maximum(a[*vu], b[*vu])
        border = np.searchsorted(code, low * count + high)

        def beside(image: NDArray, offset: int, vu: NDArray = vu, axis: int = axis) -> NDArray:
            place = vu.copy()
            place[axis] = np.clip(place[axis] + offset, 0, image.shape[axis] - 1)
            return image[*place]

        floor = np.minimum(beside(height, 0), beside(height, 1))
        before, after = beside(height, -_FAR), beside(height, 1 + _FAR)
        cues = (
            1e3 * np.abs(beside(height, -_NEAR) - beside(height, 1 + _NEAR)),
            1e3 * ((before + after) / 2 - floor),
            1e3 * (np.minimum(before, after) - floor),
            np.abs(beside(color, -1) - beside(color, 2)).max(-1),
            ~(beside(measured, 0) & beside(measured, 1)),
        )
        for total, cue in zip(sums, cues, strict=True):
            total += np.bincount(border, np.maximum(cue, 0), len(borders))
        pixels += np.bincount(border, minlength=len(borders))
    means = (sums / np.maximum(pixels, 1)).T
    # What is dark has holes everywhere, of which none tells where it ends.
    without = np.bincount(label[label >= 0], ~measured[label >= 0], count) / np.maximum(keyframe.area, 1)
    means[:, -1] = np.maximum(means[:, -1] - without[borders].mean(1), 0)
    return np.minimum(means, [10.0, 10.0, 10.0, 60.0, 1.0])
