"""How badly each rigid motion explains each superpixel, in nats: the one likelihood of this room.

A point of the keyframe, moved, should reappear in the current frame with its gray value and its depth.
Residuals are measured in standard deviations of their own noise; how large they really are, over all that is
explained best, tells how far that noise is to be believed.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.rgbd import Frame
from riseg_drake.geometry.se3 import inverse
from riseg_drake.segmentation.frame_pairs import camera_span
from riseg_drake.segmentation.keyframe import Keyframe
from riseg_drake.segmentation.lighting import gray_costs
from riseg_drake.segmentation.noise import depth_sigma
from riseg_drake.segmentation.surface import seek

ANOTHER_VIEW = 100.0
"""Pixels of the camera's motion from which smooth errors of depth are others."""
EXPECTED = 2.0
"""Squared residuals of gray and depth, both, where a motion is right."""


@dataclass
class LikelihoodParameters:
    """What residuals are worth."""

    residual_max: float = 9.0
    """Squared normalised residuals of gray and of depth count no more than that each (highlights)."""
    light: float = 0.05
    """Standard deviation of the factor by which the light on a superpixel changes, as shading does when things
    turn."""
    light_still: float = 0.02
    """The same where nothing moves: shading stays what it was."""
    correlated_pixels: float = 6.0
    """Errors of gray are alike in about so many pixels (pose, interpolation); they count as one."""
    correlated_depth: float = 28.0
    """The same of depth, whose errors are those of matching windows: 4 pi sigma^2 for noise that is smoothed
    over 1.5 pixels (docs/sensing.md)."""
    chance: float = 1.5
    """Times the mean squared residual that is usual, up to which a superpixel's may be by chance."""
    view_error: float = 0.01
    """Share of the camera's motion, pixels, and of depth from another view, by which what stands still seems to
    have moved: poses err, and depth errs smoothly by the view (a per cent and more on real films)."""
    superpixel_max: float = 4.0
    """Nats that one superpixel may say for a motion against another: its errors are its own."""


@dataclass(frozen=True)
class Costs:
    """Of G motions for N superpixels."""

    misfit: NDArray[np.float64]
    """[G, N], mean squared residuals of each superpixel's witnesses: 2 where a motion is right, 18 at most."""
    witnesses: NDArray[np.float64]
    """[N], how many witnesses each superpixel has."""

    def with_motion(self, other: "Costs") -> "Costs":
        """These and other motions, for the same superpixels."""
        return Costs(np.vstack([self.misfit, other.misfit]), self.witnesses)

    def nats(self, parameters: LikelihoodParameters) -> NDArray[np.float64]:
        """[G, N], how much worse than the best each motion is, by the noise that is there, bounded.

        A residual within the noise says no more than that: what is better by chance is no better. So a blank
        surface, which any motion along itself explains, speaks for none of them.
        """
        asked = self.witnesses > parameters.correlated_pixels
        level = float(np.median(self.misfit.min(0)[asked])) if asked.any() else EXPECTED
        misfit = np.maximum(self.misfit, parameters.chance * level)
        dispersion = max(1.0, level / EXPECTED)
        scale = self.witnesses / (2 * parameters.correlated_pixels * dispersion)
        return np.minimum((misfit - misfit.min(0)) * scale, parameters.superpixel_max)


def motion_costs(
    keyframe: Keyframe,
    frame: Frame,
    motions_K: NDArray[np.float64],
    depth_noise: float,
    parameters: LikelihoodParameters,
) -> Costs:
    """Costs of motions [G, 4, 4], given in the keyframe's camera K.

    `depth_noise` is the standard deviation of depth at 1 m, m.
    """
    X_C1K = inverse(frame.X_WC) @ keyframe.frame.X_WC
    gray_1, depth_1 = frame.unhidden_gray, frame.unhidden_depth
    ceiling = np.float32(parameters.residual_max)
    span = camera_span(keyframe.frame, frame)
    shift = np.float32(parameters.view_error * span)
    per_variance = 1 / (keyframe.variance + shift**2 * keyframe.gradient_squared)
    smooth = np.float32(parameters.view_error * min(1.0, span / ANOTHER_VIEW))
    of_depth = np.float32(parameters.correlated_pixels / parameters.correlated_depth)
    witnesses = np.bincount(keyframe.owner, minlength=keyframe.count).astype(float)
    misfit = np.full((len(motions_K), keyframe.count), EXPECTED)
    for mean, motion in zip(misfit, motions_K, strict=True):
        light = parameters.light_still if np.array_equal(motion, np.eye(4)) else parameters.light
        sought = seek(keyframe.witnesses, X_C1K @ motion)
        z_1 = sought.read(depth_1)
        photometric = gray_costs(
            keyframe.gray,
            sought.read_between(gray_1),
            per_variance,
            keyframe.owner,
            keyframe.count,
            parameters.residual_max,
            parameters.correlated_pixels / light**2,
        )
        sigma = np.hypot(depth_sigma(sought.depth, float(np.sqrt(2)) * depth_noise), smooth * sought.depth)
        geometric = np.minimum(((z_1 - sought.depth) / sigma) ** 2, ceiling)
        both = photometric + np.where(z_1 > 0, 1 + of_depth * (geometric - 1), np.float32(1))
        # What cannot be compared speaks neither for nor against: the value expected of a match.
        total = np.bincount(keyframe.owner, np.where(np.isnan(both), EXPECTED, both), keyframe.count)
        np.divide(total, witnesses, out=mean, where=witnesses > 0)
    return Costs(misfit, witnesses)
