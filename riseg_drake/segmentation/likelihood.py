"""How badly each rigid motion explains each superpixel, in nats: the one likelihood of this room.

A point of the keyframe, moved, should reappear in the current frame with its gray value and its depth.
Residuals are measured in standard deviations of their own noise; how large they really are, over all that is
explained best, tells how far that noise is to be believed.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.se3 import inverse
from riseg_drake.kernels.misfits import misfits
from riseg_drake.segmentation.comparison import Comparison
from riseg_drake.segmentation.expected_flow import of_pixels, pixel_projection
from riseg_drake.segmentation.keyframe import Keyframe
from riseg_drake.segmentation.scales import CORRELATED_DEPTH, CORRELATED_GRAY, EXPECTED, HIDDEN, OUTLIER

_TILTS = 0.1
"""Sine of an angle by which things that slide and turn on a table hardly tilt."""
_SEEN = 0.25
"""Pixels of motion that an image shows."""
_NEARER = 0.01
"""m; what is seen so much in front of a point is something else."""

_USUAL_MOST = 2 * EXPECTED
"""Mean squared residual that is usual where a motion is right, at most: more says that most of what stands
there moves, and is not explained yet. Real films have 1.0 to 1.5, other views up to 2.8."""


@dataclass
class LikelihoodParameters:
    """What residuals are worth."""

    residual_max: float = OUTLIER
    """Squared normalised residuals of gray and of depth count no more than that each (highlights)."""
    light: float = 0.05
    """Standard deviation of the factor by which the light on a superpixel changes, as shading does when things
    turn."""
    light_still: float = 0.02
    """The same where nothing moves: shading stays what it was."""
    light_tilt: float = 0.6
    """So much more of it for the sine of the angle by which things tilt, or roll, as they are lit anew. Set by
    hand."""
    light_view: float = 0.2
    """So much more of it from another view, where gloss shows other lights."""
    shadow: float = 2.0
    """Nats that any change of light costs a superpixel: what a shadow falls on keeps its pattern."""
    correlated_gray: float = CORRELATED_GRAY / 2
    """Errors of gray are alike in so many points, of which every second pixel is one; they count as one."""
    correlated_depth: float = CORRELATED_DEPTH / 2
    """The same of depth."""
    chance: float = 1.5
    """Times the mean squared residual that is usual, up to which a superpixel's may be by chance."""
    view_error: float = 0.005
    """The least that is thought of the view's error, see `Comparison`."""
    view_errors: float = 5.0
    """So many times that depth may err, and what stands still may seem to have moved, at most: real errors have
    long tails."""
    hidden: float = HIDDEN
    """Times the mean squared residual that is usual, by which a hidden point is worse than one that matches:
    few things go just where nobody can see them."""
    covered: float = 0.15
    """The same of a point before which something nearer is seen that stood there before: a thing may well go
    behind another. What came there hides it, as a hand does."""
    superpixel_max: float = 4.0
    """Nats that one superpixel may say for a motion against another: its errors are its own."""


@dataclass(frozen=True)
class Costs:
    """Of G motions for N superpixels."""

    misfit: NDArray[np.float64]
    """[G, N], mean squared residuals of each superpixel's points: 2 where a motion is right, 18 at most."""
    point_count: NDArray[np.float64]
    """[N], how many points each superpixel has."""
    lost: NDArray[np.float64]
    """[G, N], share of them that cannot be compared, as they are behind the robot or out of the image."""
    covered: NDArray[np.float64]
    """[G, N], share of them before which something nearer is seen."""
    leaves: NDArray[np.float64]
    """[N], share of them that the camera's own motion takes out of the image."""

    def with_motion(self, other: "Costs") -> "Costs":
        """These and other motions, for the same superpixels."""
        misfit, lost = np.vstack([self.misfit, other.misfit]), np.vstack([self.lost, other.lost])
        covered = np.vstack([self.covered, other.covered])
        return Costs(misfit, self.point_count, lost, covered, self.leaves)

    @property
    def hidden(self) -> NDArray[np.float64]:
        """[G, N], share of points that a motion takes where they cannot be compared."""
        return np.maximum(self.lost - self.leaves, 0)

    def excess(self, parameters: LikelihoodParameters) -> NDArray[np.float64]:
        """[G, N], how much worse each motion is than one that is right would be, nats, bounded."""
        misfit, level, scale = self._by_noise(parameters)
        excess = np.maximum(misfit - parameters.chance * level, 0) + parameters.hidden * level * self.covered
        return np.minimum(excess * scale, parameters.superpixel_max)

    def nats(
        self, parameters: LikelihoodParameters, *, which: NDArray[np.intp] | None = None
    ) -> NDArray[np.float64]:
        """[G, N], how much worse than the best each motion is, by the noise that is there, bounded.

        A residual within the noise says no more than that: what is better by chance is no better. So a blank
        surface, which any motion along itself explains, speaks for none of them.

        Args:
            parameters: see there.
            which: motions that are known to be there, which alone are compared: those may well take something
                behind another thing. Of any motion that is asked about that says as little as what is hidden.
        """
        misfit, level, scale = self._by_noise(parameters)
        misfit = np.maximum(misfit, parameters.chance * level) + parameters.hidden * level * self.hidden
        if which is None:
            misfit += parameters.hidden * level * self.covered
        else:
            misfit = (misfit + parameters.covered * level * self.covered)[which]
        return np.minimum((misfit - misfit.min(0)) * scale, parameters.superpixel_max)

    def _by_noise(
        self, parameters: LikelihoodParameters
    ) -> tuple[NDArray[np.float64], float, NDArray[np.float64]]:
        """Mean squared residuals [G, N], what cannot be compared at that which is usual where a motion is
        right, the latter, and nats [N] for each more."""
        asked = self.point_count * (1 - self.lost.min(0)) > parameters.correlated_gray
        level = float(np.median(self.misfit.min(0)[asked])) if asked.any() else EXPECTED
        level = min(level, _USUAL_MOST)
        dispersion = max(1.0, level / EXPECTED)
        scale = self.point_count / (2 * parameters.correlated_gray * dispersion)
        return self.misfit + (self.lost + self.covered) * (level - EXPECTED), level, scale


def motion_costs(
    compared: Comparison, motions_K: NDArray[np.float64], parameters: LikelihoodParameters
) -> Costs:
    """Costs of motions [G, 4, 4], given in the keyframe's camera K.

    What stands still is nearer or farther than it was measured, by a few errors of the view, where that
    explains it better: so it seems to move along its epipolar lines.
    """
    keyframe = compared.keyframe
    errs = parameters.view_errors * compared.view_error
    seen = parameters.view_errors * compared.shift > _SEEN
    depth_factors = 1 + errs * np.array([0.0, -1.0, -0.5, 0.5, 1.0]) if seen else np.ones(1)
    seen_otherwise = parameters.light_view * compared.another_view
    misfit, lost, covered = np.empty((3, len(motions_K), keyframe.count))
    for k, motion in enumerate(motions_K):
        still = np.array_equal(motion, np.eye(4))
        light = np.hypot(parameters.light_still if still else parameters.light, seen_otherwise)
        tilt = _tilt(keyframe, motion)
        light = np.hypot(light, parameters.light_tilt * tilt)
        factors = depth_factors if still else np.ones(1)
        tries = [_misfit(compared, motion, factor, float(light), tilt, parameters) for factor in factors]
        misfit[k] = np.min([each for each, _, _ in tries], axis=0)
        _, lost[k], covered[k] = tries[0]
    return Costs(misfit, keyframe.point_count.astype(float), lost, covered, compared.leaves)


def nats_of_parts(nats: NDArray[np.float64], part: NDArray[np.intp]) -> NDArray[np.float64]:
    """[G, P], how badly each of G motions explains all of each part.

    Args:
        nats: [G, N], how much worse than the best each motion explains each superpixel.
        part: [N], 0.., of each superpixel.
    """
    count = int(part.max(initial=-1)) + 1
    return np.array([np.bincount(part, n, count) for n in nats])


def unexplained_parts(nats: NDArray[np.float64], part: NDArray[np.intp]) -> NDArray[np.float64]:
    """[P], nats by which the one motion that explains a part best falls short of the best of each of its
    superpixels; of what `nats_of_parts` takes."""
    return np.asarray(nats_of_parts(nats, part).min(0))


def _misfit(
    compared: Comparison,
    motion_K: NDArray[np.float64],
    depth_factor: float,
    light: float,
    tilt: float,
    parameters: LikelihoodParameters,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Mean squared residuals [N] of a motion [4, 4], the share [N] of points that cannot be compared, and that
    before which something nearer is seen.

    Depth is really that of both views by a factor, and light changes by a factor of the standard deviation
    `light`.
    """
    keyframe, frame = compared.keyframe, compared.frame
    projection = pixel_projection(compared.X_C1K @ motion_K, frame.intrinsics)
    projection[:, 3] /= depth_factor
    total, lost, covered = misfits(
        keyframe.points.homogeneous,
        keyframe.gray,
        compared.per_variance,
        keyframe.owner,
        keyframe.count,
        projection,
        _rises(keyframe, motion_K),
        frame.unhidden_gray,
        frame.unhidden_depth,
        compared.back,
        pixel_projection(inverse(compared.X_C1K @ motion_K), frame.intrinsics),
        tilt > _TILTS,
        keyframe.frame.depth,
        compared.whole_image,
        compared.whole,
        float(np.sqrt(2)) * compared.depth_noise,
        compared.depth_error,
        parameters.correlated_gray / light**2,
        2 * parameters.correlated_gray * parameters.shadow,
        parameters.correlated_gray / parameters.correlated_depth,
        parameters.residual_max,
        EXPECTED,
        _NEARER,
    )
    points = np.maximum(keyframe.point_count, 1)
    return np.where(keyframe.point_count > 0, total / points, EXPECTED), lost / points, covered / points


def _tilt(keyframe: Keyframe, motion_K: NDArray[np.float64]) -> float:
    """Sine of the angle by which a motion [4, 4] turns what was across the table."""
    n_K = keyframe.plane_K[:3]
    return float(np.linalg.norm(np.cross(n_K, motion_K[:3, :3] @ n_K)))


def _rises(keyframe: Keyframe, motion_K: NDArray[np.float64]) -> NDArray[np.float32]:
    """[4], of which the product with a point's (u, v, 1, 1 / z) is by how much a motion [4, 4] raises it above
    the table, divided by its depth z."""
    rises = keyframe.plane_K @ (motion_K - np.eye(4))
    return of_pixels(rises[None], keyframe.frame.intrinsics)[0].astype(np.float32)
