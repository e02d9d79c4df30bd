"""What the still picture says of each border: may its two sides be one body? Motion overrules it.

Where one thing ends and another begins there is mostly a step of depth, a dent, or a change of colour: what
static methods know. How much each is worth is about what a logistic regression says on rendered toys and
household things with true labels: rims of bowls and prints are borders inside one thing as often as not.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from riseg_drake.segmentation.border_pixels import border_pixels
from riseg_drake.segmentation.keyframe import Keyframe


@dataclass
class BorderPriorParameters:
    """Log-odds, nats, that both sides are one body; worth of each cue, and where it saturates."""

    smooth: float = 2.5
    """Of a border without any cue."""
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


_FAR = 4
"""Pixels from the border at which heights are compared with its own."""


def border_prior(keyframe: Keyframe, parameters: BorderPriorParameters) -> NDArray[np.float64]:
    """[M], log-odds that the two sides of each border are one body, by the keyframe alone."""
    cues, cut = border_cues(keyframe), keyframe.superpixels
    weight = np.array([parameters.dent, parameters.valley, parameters.color, parameters.hole], np.float64)
    odds = np.clip(parameters.smooth + cues @ weight, parameters.least, parameters.most)
    odds = np.where(cut.across, parameters.least, odds)
    # Of what may go on behind something the still picture says nothing.
    return np.where(cut.behind, 0.0, odds)


def border_cues(keyframe: Keyframe) -> NDArray[np.float64]:
    """[M, 4]: dent and valley, mm; colour difference, gray levels; share without depth, beyond that of both
    sides; means along each border, saturated."""
    region, count, borders = keyframe.region, keyframe.count, keyframe.borders
    label = keyframe.superpixels.label
    height = keyframe.height
    color = cv2.GaussianBlur(keyframe.frame.color[region], (0, 0), 1.0).astype(np.float32)
    measured = keyframe.frame.depth[region] > 0
    sums, pixels = np.zeros((4, len(borders))), np.zeros(len(borders))
    for places in border_pixels(keyframe.superpixels):
        floor = np.minimum(places.beside(height, 0), places.beside(height, 1))
        before, after = places.beside(height, -_FAR), places.beside(height, 1 + _FAR)
        cues = (
            1e3 * ((before + after) / 2 - floor),
            1e3 * (np.minimum(before, after) - floor),
            np.abs(places.beside(color, -1) - places.beside(color, 2)).max(-1),
            ~(places.beside(measured, 0) & places.beside(measured, 1)),
        )
        for total, cue in zip(sums, cues, strict=True):
            total += np.bincount(places.border, np.maximum(cue, 0), len(borders))
        pixels += np.bincount(places.border, minlength=len(borders))
    means = (sums / np.maximum(pixels, 1)).T
    # What is dark has holes everywhere, of which none tells where it ends.
    without = np.bincount(label[label >= 0], ~measured[label >= 0], count) / np.maximum(keyframe.area, 1)
    means[:, -1] = np.maximum(means[:, -1] - without[borders].mean(1), 0)
    return np.minimum(means, [10.0, 10.0, 60.0, 1.0])
