"""The groups' motions, sharpened on the images themselves before pixels are asked which one is theirs.

A body frame knows its motion from flow inside a few centimetres. A blank body has flow at its edges
only, each of which tells one direction. Here every pixel with a gradient takes part, wherever on the
body it lies, and others on a grid, by which depth tells how its surface lies: the motion that makes the second
image agree with the first is found by Gauss-Newton from where the group's motion starts. Nothing of it is in
the paper.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.camera import Intrinsics, rays
from riseg_drake.geometry.rgbd import Frame, FramePair, Immutable
from riseg_drake.geometry.se3 import move_points
from riseg_drake.kernels.normal_equations import normal_equations
from riseg_drake.kernels.screw import screwed
from riseg_drake.segmentation.expected_flow import pixel_projection
from riseg_drake.segmentation.motions import flow_difference
from riseg_drake.segmentation.noise import MeasurementNoise, depth_sigma
from riseg_drake.segmentation.scales import EXPECTED, HIDDEN, OUTLIER, SAME_MOTION
from riseg_drake.segmentation.surface import SurfacePixels, seek, surface_pixels

_GRADIENT_MIN = 1.0
"""Squared gray gradient of a pixel that tells where it is, in variances of the sensor's noise."""
_CORRELATED = 6.0
"""Noise of depth is alike in about so many pixels along a line, the root of `CORRELATED_DEPTH`; they count as
one."""
_GRID = 4
"""Pixels between those without a gradient, whose noise of depth is hardly correlated."""


@dataclass
class AlignmentParameters:
    """How motions are sharpened."""

    rounds: int = 2
    """Gauss-Newton steps; 0 leaves the motions as the body frames have them."""
    turn: float = 0.03
    """rad; how well the body frames know a motion's rotation."""
    shift: float = 0.0015
    """m; how well they know where it takes the body's centre."""
    outlier: float = 4.0
    """Squared normalised residual from which a pixel counts ever less."""
    members_min: int = 60
    """Pixels that a motion needs to be sharpened."""
    same_flow: float = SAME_MOTION
    """Pixels (root mean square); motions that predict flow within that are one."""


@dataclass(frozen=True)
class EdgePixels(Immutable):
    """The pixels of the reference frame whose gray values tell where they are at t, and a grid of others."""

    surface: SurfacePixels
    p_C0Q: NDArray[np.float64]
    """[N, 3], their points, m."""
    piece: NDArray[np.intp]
    """[N], of the pieces that decide as one."""
    gray: NDArray[np.float32]
    """[N]."""
    variance: NDArray[np.float32]
    """[N], of the difference between that and where it should reappear."""
    alike: NDArray[np.float32]
    """[N], how many of them have much the same noise of depth."""

    def subset(self, which: NDArray[np.intp]) -> "EdgePixels":
        """Some of the pixels, by their numbers [N]."""
        return EdgePixels(
            self.surface.subset(which),
            self.p_C0Q[which],
            self.piece[which],
            self.gray[which],
            self.variance[which],
            self.alike[which],
        )


def align_motions(
    pair: FramePair,
    edges: EdgePixels,
    motions: NDArray[np.float64],
    depth_noise: float,
    parameters: AlignmentParameters,
) -> NDArray[np.float64]:
    """Motions [G', 4, 4] in C0, sharpened; those that end in the same one are one.

    Args:
        pair: the frames of t-1 and t.
        edges: of the frame of t-1.
        motions: [G, 4, 4] in C0, to start from.
        depth_noise: standard deviation of depth at 1 m, m.
        parameters: see there.
    """
    if not len(edges.piece) or parameters.rounds == 0:
        return motions
    image_1 = rigid_fit(pair, depth_noise)
    # Each piece goes to what explains it best, standing still among them.
    pieces = int(edges.piece.max()) + 1
    cost = [np.bincount(edges.piece, image_1.cost(edges, X), pieces) for X in (np.eye(4), *motions)]
    owner = np.argmin(cost, axis=0)[edges.piece]
    focal_length = pair.current.intrinsics.fx
    aligned: list[NDArray] = []
    for g, motion in enumerate(motions):
        mine = np.flatnonzero(owner == g + 1)
        if len(mine) >= parameters.members_min:
            motion = image_1.align(edges.subset(mine), motion, parameters.rounds, parameters)
        p_C0Q = edges.p_C0Q[mine] if len(mine) else edges.p_C0Q
        if all(flow_difference(p_C0Q, motion, X, focal_length) > parameters.same_flow for X in aligned):
            aligned.append(motion)
    return np.array(aligned).reshape(-1, 4, 4)


def edge_pixels(
    frame: Frame,
    piece: NDArray[np.intp],
    contrast: NDArray[np.bool_],
    variance: NDArray[np.float32],
    pixels_max: int,
) -> EdgePixels:
    """Evenly taken pixels with contrast of the pieces [H, W] (-1 = none), and some of the others.

    Args:
        frame: of t-1.
        piece: [H, W], number of each pixel's piece.
        contrast: [H, W], see `has_contrast`.
        variance: [H, W], see `gray_variance`.
        pixels_max: at most so many are taken.
    """
    asked = contrast.copy()
    asked[::_GRID, ::_GRID] = True
    surface = surface_pixels((piece >= 0) & asked, frame.depth, frame.intrinsics)
    surface = surface.subset(np.arange(0, len(surface), max(1, -(-len(surface) // pixels_max))))
    v, u = surface.pixel
    p_C0Q = rays(frame.intrinsics)[v, u].astype(float) * surface.depth[:, None]
    alike = np.where(contrast[v, u], np.float32(_CORRELATED), np.float32(1))
    return EdgePixels(surface, p_C0Q, piece[v, u], frame.gray[v, u], variance[v, u], alike)


def has_contrast(gradient_squared: NDArray[np.float32], noise: MeasurementNoise) -> NDArray[np.bool_]:
    """Which pixels [...] tell where they are: by `Frame.gradient_squared` more changes than noise does."""
    return gradient_squared > _GRADIENT_MIN * noise.color**2


def rigid_fit(pair: FramePair, depth_noise: float) -> "RigidFit":
    """Of the frame of t of a pair; `depth_noise` is that of depth at 1 m, m."""
    current = pair.current
    noise = float(np.sqrt(2)) * depth_noise
    return RigidFit(pair.X_C1C0, current.intrinsics, current.unhidden_gray, current.unhidden_depth, noise)


@dataclass(frozen=True)
class RigidFit:
    """The frame of t: what pixels of t-1 find there, and the motion that fits them."""

    X_C1C0: NDArray[np.float64]
    """[4, 4]."""
    intrinsics: Intrinsics
    gray: NDArray[np.float32]
    """[H, W]."""
    depth: NDArray[np.float32]
    """[H, W], m."""
    depth_noise: float
    """Of the difference of two depths at 1 m, m."""

    def cost(self, edges: EdgePixels, motion: NDArray) -> NDArray[np.float32]:
        """How badly a motion explains each pixel [N]: 2 where it is right, 18 at most."""
        sought = seek(edges.surface, self.X_C1C0 @ motion)
        z_1 = sought.read(self.depth)
        gray = np.square(sought.read_between(self.gray) - edges.gray) / edges.variance
        depth = np.square((z_1 - sought.depth) / depth_sigma(sought.depth, self.depth_noise))
        squared = np.minimum(gray, np.float32(OUTLIER)) + np.minimum(depth, np.float32(OUTLIER))
        # Depth that is not there says neither.
        squared = np.where(z_1 > 0, squared, np.float32(EXPECTED))
        return np.where(np.isnan(gray), np.float32((1 + HIDDEN) * EXPECTED), squared)

    def align(
        self, edges: EdgePixels, motion: NDArray, rounds: int, parameters: AlignmentParameters
    ) -> NDArray[np.float64]:
        """One motion [4, 4] fitted to its own pixels."""
        centre = move_points(motion, edges.p_C0Q.mean(0)[None])[0]
        precision = np.repeat([parameters.turn**-2.0, parameters.shift**-2.0], 3)
        V, X = np.zeros(6), np.ascontiguousarray(motion)
        for _ in range(rounds):
            normal, rhs = self._normal_equations(edges, X, centre, parameters.outlier)
            normal[np.diag_indices(6)] += precision
            step = np.linalg.solve(normal, rhs - precision * V)
            V = V + step
            X = screwed(step, centre, X)
        return X

    def _normal_equations(
        self, edges: EdgePixels, X: NDArray, centre: NDArray, outlier: float
    ) -> tuple[NDArray, NDArray]:
        """Of a twist about the centre [3], on top of the motion X [4, 4]: [6, 6] and [6]."""
        k = self.intrinsics
        return normal_equations(
            edges.surface.homogeneous,
            edges.p_C0Q,
            edges.gray,
            edges.variance,
            edges.alike,
            pixel_projection(self.X_C1C0 @ X, k),
            X,
            self.X_C1C0,
            centre,
            (k.fx, k.fy),
            self.gray,
            self.depth,
            self.depth_noise,
            outlier,
        )
