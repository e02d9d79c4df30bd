"""A keyframe and a frame: what is compared, and how far measurements differ where nothing has moved.

From another view what stands still seems to have moved a little: poses err, and depth errs smoothly, by a per
cent and more on real films. How much that is, as a share of the camera's own motion in the image, shows where
the poses are set right by the images (`camera_motion`): in what is left between expected and observed flow of
what stands still.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.rgbd import Frame, FramePair, Immutable
from riseg_drake.geometry.se3 import inverse
from riseg_drake.segmentation.expected_flow import pixel_projection
from riseg_drake.segmentation.frame_pairs import camera_span
from riseg_drake.segmentation.keyframe import Keyframe
from riseg_drake.segmentation.surface import seek

_ANOTHER_VIEW = 100.0
"""Pixels of the whole frame by which the camera moves, from which smooth errors of depth are others."""
_PAIRS = 30.0
"""Over about so many pairs is the view's error measured."""
_LOST = 0.1
"""Share of the camera's motion from which a residual says that flow was lost."""
_SPAN_ASSUMED = 20.0
"""Pixels of the camera's motion in a pair that would say what is assumed before any has said something."""


@dataclass(frozen=True)
class ViewError(Immutable):
    """What pairs of frames have shown of the view's error."""

    residual_squares: float = 0.0
    """Sum of the squared residuals of flow where nothing moves, pixels^2."""
    span_squares: float = 0.0
    """Sum of the camera's squared motions in the image, pixels^2."""

    def share(self, assumed: float) -> float:
        """The view's error, a share of the camera's motion in the image; what was `assumed` at least."""
        squares = self.residual_squares + (assumed * _SPAN_ASSUMED) ** 2
        return max(assumed, float(np.sqrt(squares / (self.span_squares + _SPAN_ASSUMED**2))))


def renewed_view_error(known: ViewError, pair: FramePair) -> ViewError:
    """The view's error in the light of one more pair.

    Those whose poses are taken as they are say nothing, nor do those whose flow was lost.
    """
    span = camera_span(pair.reference, pair.current)
    if pair.residual == 0 or pair.residual > _LOST * span:
        return known
    kept = 1 - 1 / _PAIRS
    return ViewError(kept * known.residual_squares + pair.residual**2, kept * known.span_squares + span**2)


@dataclass(frozen=True)
class Comparison(Immutable):
    """A keyframe, in whose camera K motions are given, and a frame."""

    keyframe: Keyframe
    frame: Frame
    depth_noise: float
    """Standard deviation of depth at 1 m, m."""
    view_error: float
    """Share of the camera's motion, pixels, and of depth from another view, by which what stands still seems to
    have moved."""
    pose_error: float = 0.0
    """Pixels of the whole frame by which poses err that are taken as they came."""
    body: NDArray[np.intp] | None = None
    """[N], ids, 0 where nothing has moved yet, as in all of them if it is None."""

    @cached_property
    def whole(self) -> NDArray[np.int32]:
        """[N], the same number for superpixels that are known to be one body, and so do not hide each other."""
        own = -1 - np.arange(self.keyframe.count)
        return (own if self.body is None else np.where(self.body > 0, self.body, own)).astype(np.int32)

    @cached_property
    def whole_image(self) -> NDArray[np.int32]:
        """[H, W] of the keyframe, the same; 0 where nothing stands."""
        return self.keyframe.image_of(self.whole)

    @property
    def pair(self) -> FramePair:
        """The keyframe's own frame and the other one."""
        return FramePair(self.keyframe.frame, self.frame)

    @cached_property
    def X_C1K(self) -> NDArray[np.float64]:
        """[4, 4], from the keyframe's camera to the frame's, as the poses have it."""
        return self.pair.X_C1C0

    @cached_property
    def back(self) -> NDArray[np.float32]:
        """[3, 4], the `pixel_projection` from the frame to the keyframe."""
        return pixel_projection(inverse(self.X_C1K), self.frame.intrinsics)

    @cached_property
    def another_view(self) -> float:
        """How far this is another view, a share: 0 where the camera has not moved, 1 where errors are new."""
        return min(camera_span(self.keyframe.frame, self.frame.whole) / _ANOTHER_VIEW, 1.0)

    @cached_property
    def shift(self) -> float:
        """Pixels by which what stands still seems to have moved."""
        return (self.view_error * self.another_view * _ANOTHER_VIEW + self.pose_error) / self.frame.reduction

    @cached_property
    def per_variance(self) -> NDArray:
        """[W], 1 / variance of the difference between a point's gray value and where it reappears."""
        keyframe = self.keyframe
        return 1 / (keyframe.variance + np.float32(self.shift) ** 2 * keyframe.gradient_squared)

    @cached_property
    def leaves(self) -> NDArray[np.float64]:
        """[N], share of its points that the camera's own motion takes out of the image."""
        sought = seek(self.keyframe.points, self.X_C1K)
        outside = np.flatnonzero(~sought.inside(self.frame.intrinsics.shape))
        return self.keyframe.share_of_points(outside)

    @property
    def depth_error(self) -> float:
        """Share of depth by which it errs otherwise than in the keyframe."""
        return self.view_error * self.another_view
