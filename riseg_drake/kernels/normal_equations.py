"""Gauss-Newton's normal equations for a rigid motion, `segmentation.alignment`."""

import numpy as np
from numpy.typing import NDArray

from riseg_drake.kernels.compiled import compiled
from riseg_drake.kernels.reading import between, nearest, projected


@compiled(
    "Tuple((float64[:, ::1], float64[::1]))(float32[:, ::1], float64[:, ::1], float32[::1], float32[::1],"
    "float32[::1], float32[:, ::1], float64[:, ::1], float64[:, ::1], float64[::1], UniTuple(float64, 2),"
    "float32[:, ::1], float32[:, ::1], float64, float64)"
)
def normal_equations(
    pixel: NDArray[np.float32],
    p_C0Q: NDArray[np.float64],
    gray: NDArray[np.float32],
    variance: NDArray[np.float32],
    alike: NDArray[np.float32],
    M: NDArray[np.float32],
    X: NDArray[np.float64],
    X_C1C0: NDArray[np.float64],
    centre: NDArray[np.float64],
    focal_lengths: tuple[float, float],
    gray_1: NDArray[np.float32],
    depth_1: NDArray[np.float32],
    depth_noise: float,
    outlier: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Sum of w J^T J [6, 6] and of -w J^T r [6] over the residuals r of gray values and depths of N pixels.

    Args:
        pixel: [4, N or more], (u, v, 1, 1 / z) of the pixels.
        p_C0Q: [N, 3], their points, m.
        gray: [N], their gray values.
        variance: [N], of the difference between that and where it should reappear.
        alike: [N], how many of them have much the same noise of depth.
        M: [3, 4], see `pixel_projection`, of X_C1C0 X.
        X: [4, 4], the motion so far, in C0.
        X_C1C0: [4, 4], the camera's.
        centre: [3], about which twists turn, m.
        focal_lengths: along u and v, pixels.
        gray_1: [H, W], of the other view; NaN where there is nothing to compare.
        depth_1: [H, W], m; 0 where there is none.
        depth_noise: of the difference of two depths at 1 m, m.
        outlier: squared residual from which a pixel counts ever less.
    """
    normal, rhs = np.zeros((6, 6)), np.zeros(6)
    J, d_p, p, q = np.empty(6), np.empty(3), np.empty(3), np.empty(3)
    one = np.float32(1)
    for n in range(len(gray)):
        u, v, c = projected(M, pixel, n)
        if np.isnan(c):
            continue
        for k in range(3):
            p[k] = X[k, 0] * p_C0Q[n, 0] + X[k, 1] * p_C0Q[n, 1] + X[k, 2] * p_C0Q[n, 2] + X[k, 3]
        for k in range(3):
            q[k] = X_C1C0[k, 0] * p[0] + X_C1C0[k, 1] * p[1] + X_C1C0[k, 2] * p[2] + X_C1C0[k, 3]
        for of_depth in (False, True):
            if of_depth:
                z_1, z = nearest(depth_1, u, v), c / pixel[3, n]
                if not z_1 > 0:
                    continue
                sigma, count = depth_noise * z * z, alike[n]
                residual = (z_1 - z) / sigma
                for k in range(3):
                    d_p[k] = -X_C1C0[2, k] / sigma
            else:
                sigma, count = np.sqrt(variance[n]), one
                residual = (between(gray_1, u, v) - gray[n]) / sigma
                g_u = 0.5 * (between(gray_1, u + one, v) - between(gray_1, u - one, v)) / sigma
                g_v = 0.5 * (between(gray_1, u, v + one) - between(gray_1, u, v - one)) / sigma
                along_u, along_v = g_u * focal_lengths[0] / q[2], g_v * focal_lengths[1] / q[2]
                ahead = -(along_u * q[0] + along_v * q[1]) / q[2]
                for k in range(3):
                    d_p[k] = along_u * X_C1C0[0, k] + along_v * X_C1C0[1, k] + ahead * X_C1C0[2, k]
            for k in range(3):
                i, j = (k + 1) % 3, (k + 2) % 3
                J[k] = (p[i] - centre[i]) * d_p[j] - (p[j] - centre[j]) * d_p[i]
                J[3 + k] = d_p[k]
            if not np.isfinite(residual + J.sum()):
                continue  # what is not known tells nothing
            weight = 1 / (1 + residual**2 / outlier) / count
            for k in range(6):
                rhs[k] -= J[k] * weight * residual
                for m in range(6):
                    normal[k, m] += J[k] * weight * J[m]
    return normal, rhs
