"""Alg. 2, line 5: the body frame-invariant feature, a spatial twist, of each body frame.

Two body frames on one rigid body have the same twist in one fixed space frame {s} (eq. 2). Over a
frame pair the twist is the logarithm of T_sb(t) T_sb(t-1)^-1. Triplets get T_sb from their axes as in
the paper; patches get the motion itself by weighted least squares, and with it its covariance.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.se3 import adjoint, exp_se3, inverse, log_se3, translation
from riseg_drake.segmentation.body_frames import BodyFrames
from riseg_drake.segmentation.noise import depth_sigma
from riseg_drake.segmentation.scales import OUTLIER

_GAUSS_NEWTON_STEPS = 3


@dataclass(frozen=True)
class Twists:
    """The spatial twists V_S of K body frames, all in one space frame {s}."""

    V_S: NDArray[np.float64]
    """[K, 6], [omega; v], radian and metre per pair."""
    covariance: NDArray[np.float64]
    """[K, 6, 6], of each twist."""
    p_C0S: NDArray[np.float64]
    """[3], where {s} lies; its axes are those of C0."""
    misfit: NDArray[np.float64]
    """[K], mean squared normalised residual of a frame's points: 1 where the noise explains it."""

    def subset(self, which: NDArray[np.bool_]) -> "Twists":
        """The twists of some of the body frames, by a mask [K]."""
        return Twists(self.V_S[which], self.covariance[which], self.p_C0S, self.misfit[which])


def triplet_pose(p_0: NDArray, p_1: NDArray, p_2: NDArray) -> NDArray[np.float64]:
    """T_sb [..., 4, 4] of the body frame through three points [..., 3], as the paper builds it.

    Origin at p_0, x perpendicular to the triplet's plane, y towards p_1, z perpendicular to both.
    """
    y = p_1 - p_0
    x = np.cross(y, p_2 - p_0)
    T = np.zeros((*p_0.shape[:-1], 4, 4))
    y = y / np.linalg.norm(y, axis=-1, keepdims=True)
    x = x / np.linalg.norm(x, axis=-1, keepdims=True)
    T[..., :3, 0], T[..., :3, 1], T[..., :3, 2] = x, y, np.cross(x, y)
    T[..., :3, 3] = p_0
    T[..., 3, 3] = 1.0
    return T


def spatial_twist(T_0: NDArray, T_1: NDArray) -> NDArray[np.float64]:
    """V_s [..., 6] with [V_s] = log(T_1 T_0^-1): eq. 2 over one frame pair."""
    return log_se3(T_1 @ inverse(T_0))


def change_space_frame(V_A: NDArray, covariance: NDArray, p_BA: NDArray) -> tuple[NDArray, NDArray]:
    """The twists [..., 6] and covariances in a space frame B with A's axes; p_BA [..., 3] is A in B."""
    Ad = adjoint(translation(p_BA))
    V_B = np.einsum("...ij,...j->...i", Ad, V_A)
    return V_B, Ad @ covariance @ np.swapaxes(Ad, -1, -2)


def triplet_twists(frames: BodyFrames, p_C0S: NDArray) -> Twists:
    """The literal BFIFs of triplets, about S at p_C0S [3], m. Of their noise they know the sample's alone."""
    move = translation(-p_C0S)
    T_0, T_1 = (move @ triplet_pose(p[:, 0], p[:, 1], p[:, 2]) for p in (frames.p_C0Q0, frames.p_C0Q1))
    V_S = spatial_twist(T_0, T_1)
    K = len(frames)
    sample = np.cov(V_S.T) if K > 1 else np.eye(6)
    # Fewer than seven span no six dimensions: a touch of noise keeps their distances solvable.
    sample = sample + 1e-12 * max(np.trace(sample), 1e-12) * np.eye(6)
    return Twists(V_S, np.broadcast_to(sample, (K, 6, 6)), p_C0S, np.ones(K))


def patch_twists(
    frames: BodyFrames,
    p_C0S: NDArray,
    precision: NDArray[np.float64],
    prior: NDArray | None = None,
) -> Twists:
    """BFIFs of patches by weighted least squares, each with its own covariance.

    Args:
        frames: K patches.
        p_C0S: [3], where the space frame lies.
        precision: [K, M, 3, 3], of the points' displacements, see `point_precision`.
        prior: [6, 6], what is known of a twist before (see `sliding_prior`); nothing if None.
    """
    centre = (frames.p_C0Q0 * frames.used[..., None]).sum(1) / frames.used.sum(1)[:, None]
    q_0, q_1 = (p - centre[:, None] for p in (frames.p_C0Q0, frames.p_C0Q1))
    V_B, covariance, misfit = fit_motion(q_0, q_1, precision, frames.used, prior)
    V_S, covariance = change_space_frame(V_B, covariance, centre - p_C0S)
    return Twists(V_S, covariance, p_C0S, misfit)


def point_precision(
    p_CQ: NDArray, depth_1: NDArray, flow_noise: NDArray, depth_noise: float, focal_length: float
) -> NDArray[np.float64]:
    """Inverse covariance [..., 3, 3] of a point's displacement: flow noise across, depth along the ray."""
    z = np.maximum(p_CQ[..., 2], 1e-3)
    across = (z * flow_noise / focal_length) ** -2.0
    along = 1.0 / (depth_sigma(z, depth_noise) ** 2 + depth_sigma(np.maximum(depth_1, z), depth_noise) ** 2)
    ray = p_CQ / np.maximum(np.linalg.norm(p_CQ, axis=-1, keepdims=True), 1e-9)
    return across[..., None, None] * np.eye(3) + (along - across)[..., None, None] * (
        ray[..., :, None] * ray[..., None, :]
    )


def sliding_prior(normal_C0: NDArray, tilt: float, lift: float) -> NDArray[np.float64]:
    """Inverse covariance [6, 6] of a twist about a body's own centre, of a body that slides on a table.

    Args:
        normal_C0: [3], the table's unit normal.
        tilt: standard deviation of turning about axes in the table, rad.
        lift: standard deviation of moving along the normal, m.
    """
    n = normal_C0[:, None] @ normal_C0[None]
    prior = np.zeros((6, 6))
    prior[:3, :3] = (np.eye(3) - n) / tilt**2
    prior[3:, 3:] = n / lift**2
    return prior


def fit_motion(
    q_0: NDArray,
    q_1: NDArray,
    W: NDArray,
    used: NDArray[np.bool_],
    prior: NDArray | None = None,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Motions V with q_1 = exp(V) q_0, by robust Gauss-Newton; a stack of K fits at once.

    Args:
        q_0: [K, M, 3] and
        q_1: [K, M, 3], points before and after, m, best given about their own centre.
        W: [K, M, 3, 3], inverse covariance of the displacements.
        used: [K, M], which points take part.
        prior: [6, 6], inverse covariance of the motions before anything is measured; none if None.

    Returns:
        V [K, 6]; its covariance [K, 6, 6], enlarged where the points disagree more than W allows;
        mean squared normalised residual [K].
    """
    K = len(q_0)
    X, V = np.broadcast_to(np.eye(4), (K, 4, 4)), np.zeros((K, 6))
    J = np.zeros((*q_0.shape, 6))
    J[..., 3:] = np.eye(3)
    for _ in range(_GAUSS_NEWTON_STEPS):
        moved = q_0 @ X[:, :3, :3].swapaxes(1, 2) + X[:, None, :3, 3]
        residual = (q_1 - moved)[..., None]
        W_residual = W @ residual
        squared = (residual * W_residual).sum((-2, -1))
        # Cauchy weights: a point on another body pulls less the less it fits.
        weight = used / (1.0 + squared / OUTLIER)
        _fill_jacobian(J, moved)
        J_W = ((W * weight[..., None, None]) @ J).reshape(K, -1, 6).swapaxes(1, 2)
        normal = J_W @ J.reshape(K, -1, 6)
        rhs = (J_W @ residual.reshape(K, -1, 1))[..., 0]
        # A touch of prior keeps patches that are nearly lines solvable; it is far below any data.
        normal = normal + 1e-9 * np.trace(normal, axis1=1, axis2=2)[:, None, None] * np.eye(6)
        if prior is not None:
            normal = normal + prior
            # The motion is small: its twist is, nearly, the sum of the steps.
            rhs = rhs - V @ prior
        step = np.linalg.solve(normal, rhs[..., None])[..., 0]
        X, V = exp_se3(step) @ X, V + step
    misfit = (squared * weight).sum(1) / np.maximum(3.0 * weight.sum(1), 1e-9)
    covariance = np.linalg.inv(normal) * np.maximum(1.0, misfit)[:, None, None]
    return log_se3(X), covariance, misfit


def _fill_jacobian(J: NDArray, q: NDArray) -> None:
    """Set the first half of d(exp(V) q)/dV = [-[q], I], [..., 3, 6], for points q [..., 3]."""
    x, y, z = np.moveaxis(q, -1, 0)
    J[..., 0, 1], J[..., 0, 2] = z, -y
    J[..., 1, 0], J[..., 1, 2] = -z, x
    J[..., 2, 0], J[..., 2, 1] = y, -x
