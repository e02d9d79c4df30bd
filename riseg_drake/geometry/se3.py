"""Rigid motions and spatial twists, one at a time or in stacks.

`X` is [..., 4, 4]; a twist is [..., 6] = [omega; v], angular part first. `X = exp_se3(V)` moves points
by the screw V in unit time, so a twist here has the units radian and metre.
"""

import numpy as np
from numpy.typing import NDArray

_SMALL_ANGLE = 1e-4
"""rad; below it the closed forms lose digits and their series are exact to 1e-16."""


def skew(a: NDArray) -> NDArray:
    """The matrix [a] with [a] b = a x b, [..., 3, 3] from [..., 3]."""
    out = np.zeros((*a.shape[:-1], 3, 3), a.dtype)
    out[..., 2, 1], out[..., 0, 2], out[..., 1, 0] = a[..., 0], a[..., 1], a[..., 2]
    return out - np.swapaxes(out, -1, -2)


def inverse(X: NDArray) -> NDArray:
    """Inverse of rigid motions [..., 4, 4]."""
    out = np.zeros_like(X)
    R_T = np.swapaxes(X[..., :3, :3], -1, -2)
    out[..., :3, :3] = R_T
    out[..., :3, 3] = -np.einsum("...ij,...j->...i", R_T, X[..., :3, 3])
    out[..., 3, 3] = 1.0
    return out


def move_points(X_AB: NDArray, p_BQ: NDArray) -> NDArray:
    """p_AQ [..., 3] of points p_BQ [..., 3] under one motion X_AB [4, 4]; keeps the points' dtype."""
    R = X_AB[:3, :3].astype(p_BQ.dtype)
    return p_BQ @ R.T + X_AB[:3, 3].astype(p_BQ.dtype)


def seen_from(X_AB: NDArray, motion_B: NDArray) -> NDArray[np.float64]:
    """Motions [..., 4, 4] that B tells, as A sees them, in which B has the pose X_AB [4, 4]."""
    seen: NDArray[np.float64] = X_AB @ motion_B @ inverse(X_AB)
    return seen


def exp_se3(V: NDArray) -> NDArray:
    """The motion [..., 4, 4] of twists V = [omega; v] [..., 6] over unit time."""
    omega, v = V[..., :3], V[..., 3:]
    angle = np.linalg.norm(omega, axis=-1)[..., None, None]
    small = angle < _SMALL_ANGLE
    safe = np.where(small, 1.0, angle)
    a = np.where(small, 1 - angle**2 / 6, np.sin(safe) / safe)
    b = np.where(small, 0.5 - angle**2 / 24, (1 - np.cos(safe)) / safe**2)
    c = np.where(small, 1 / 6 - angle**2 / 120, (safe - np.sin(safe)) / safe**3)
    W = skew(omega)
    WW = W @ W
    identity = np.eye(3)
    X = np.zeros((*V.shape[:-1], 4, 4))
    X[..., :3, :3] = identity + a * W + b * WW
    X[..., :3, 3] = np.einsum("...ij,...j->...i", identity + b * W + c * WW, v)
    X[..., 3, 3] = 1.0
    return X


def log_se3(X: NDArray) -> NDArray:
    """The twist [omega; v] [..., 6] whose `exp_se3` is X [..., 4, 4]; rotations below pi."""
    R, p = X[..., :3, :3], X[..., :3, 3]
    antisymmetric = 0.5 * np.stack(
        [R[..., 2, 1] - R[..., 1, 2], R[..., 0, 2] - R[..., 2, 0], R[..., 1, 0] - R[..., 0, 1]], axis=-1
    )
    sine = np.linalg.norm(antisymmetric, axis=-1)
    cosine = 0.5 * (np.trace(R, axis1=-2, axis2=-1) - 1)
    angle = np.arctan2(sine, cosine)
    small = angle < _SMALL_ANGLE
    safe = np.where(small, 1.0, angle)
    scale = np.where(small, 1 + angle**2 / 6, safe / np.where(small, 1.0, sine))
    omega = scale[..., None] * antisymmetric
    half_cot = np.where(small, 1 / 12 + angle**2 / 720, (1 - 0.5 * safe / np.tan(0.5 * safe)) / safe**2)
    W = skew(omega)
    V_inverse = np.eye(3) - 0.5 * W + half_cot[..., None, None] * (W @ W)
    return np.concatenate([omega, np.einsum("...ij,...j->...i", V_inverse, p)], axis=-1)


def adjoint(X_AB: NDArray) -> NDArray:
    """[..., 6, 6] that takes twists V_B to V_A = Ad(X_AB) V_B (angular part first)."""
    R = X_AB[..., :3, :3]
    out = np.zeros((*X_AB.shape[:-2], 6, 6))
    out[..., :3, :3] = R
    out[..., 3:, 3:] = R
    out[..., 3:, :3] = skew(X_AB[..., :3, 3]) @ R
    return out


def translation(p: NDArray) -> NDArray:
    """The pure translation [..., 4, 4] by p [..., 3]."""
    X = np.zeros((*p.shape[:-1], 4, 4))
    X[...] = np.eye(4)
    X[..., :3, 3] = p
    return X
