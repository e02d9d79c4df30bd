"""How badly many slides and turns on a plane explain some points, all at once and in blurred images.

There a step of a grid of motions leads into the right valley, which others go down.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.se3 import skew
from riseg_drake.segmentation.comparison import Comparison
from riseg_drake.segmentation.likelihood import EXPECTED


class SlideCosts:
    """A keyframe and a frame, prepared for many motions, given in the keyframe's camera K."""

    def __init__(self, compared: Comparison, standing: NDArray[np.bool_], blur: float, residual_max: float):
        """With objMask of the frame [H, W], the standard deviation of the blur, pixels, and what squared
        residuals count at most."""
        self._compared, self._residual_max = compared, residual_max
        gray_0 = compared.keyframe.frame.gray
        self._gray_0, self._gray_1 = (cv2.GaussianBlur(g, (0, 0), blur) for g in (gray_0, compared.frame.gray))
        gradient = np.hypot(*(cv2.Sobel(gray_0, cv2.CV_32F, *d, scale=0.125) for d in ((1, 0), (0, 1))))
        self._variance = 8 + (0.5 * blur * cv2.GaussianBlur(gradient, (0, 0), blur)) ** 2
        self._standing = standing.astype(np.float32)

    def of(self, p_KQ: NDArray, v: NDArray, u: NDArray, motions_K: NDArray) -> NDArray:
        """Mean squared residuals [G] under motions [G, 4, 4] of points [S, 3], m, at pixels v, u [S]."""
        frame, most = self._compared.frame, self._residual_max
        u_1, v_1, z = self._places(p_KQ, motions_K)
        found = cv2.remap(self._gray_1, u_1, v_1, cv2.INTER_LINEAR, borderValue=0)
        z_1 = cv2.remap(frame.unhidden_depth, u_1, v_1, cv2.INTER_NEAREST, borderValue=0)
        cost = np.minimum((found - self._gray_0[v, u]) ** 2 / self._variance[v, u], most)
        sigma = np.float32(2 * np.sqrt(2) * self._compared.depth_noise) * z**2
        cost += np.where(z_1 > 0, np.minimum(((z_1 - z) / sigma) ** 2, most), EXPECTED / 2)
        return cost.mean(1)

    def taken(self, p_KQ: NDArray, motions_K: NDArray) -> NDArray:
        """Squared residuals [G] for free points [S, 3], m, that motions [G, 4, 4] take where it is not free."""
        u, v, _ = self._places(p_KQ, motions_K)
        taken = cv2.remap(self._standing, u, v, cv2.INTER_LINEAR, borderValue=0)
        return self._residual_max * taken.mean(1)

    def _places(self, p_KQ: NDArray, motions_K: NDArray) -> tuple[NDArray, NDArray, NDArray]:
        """Where motions [G, 4, 4] take points [S, 3] in the frame: u, v, pixels, and depth, m, [G, S]."""
        k = self._compared.frame.intrinsics
        K = np.array([[k.fx, 0, k.cx], [0, k.fy, k.cy], [0, 0, 1]])
        P = (K @ (self._compared.X_C1K @ motions_K)[:, :3]).astype(np.float32)
        homogeneous = np.column_stack([p_KQ, np.ones(len(p_KQ))]).astype(np.float32)
        zu, zv, z = np.moveaxis((P.reshape(-1, 4) @ homogeneous.T).reshape(len(P), 3, -1), 1, 0)
        u, v = zu / z, zv / z
        return u, v, z


def slides(normal: NDArray, centre: NDArray, amounts: NDArray) -> NDArray[np.float64]:
    """Motions [G, 4, 4] of things on a plane: shifted along it by two of `amounts` [G, 3], m, and turned about
    its normal [3] through a centre [3] by the third, rad."""
    n = normal / np.linalg.norm(normal)
    first = np.cross(n, np.eye(3)[np.abs(n).argmin()])
    first /= np.linalg.norm(first)
    along = np.stack([first, np.cross(n, first)])
    K = skew(n)
    sine, cosine = np.sin(amounts[:, 2, None, None]), np.cos(amounts[:, 2, None, None])
    X = np.tile(np.eye(4), (len(amounts), 1, 1))
    X[:, :3, :3] += sine * K + (1 - cosine) * (K @ K)
    X[:, :3, 3] = centre - X[:, :3, :3] @ centre + amounts[:, :2] @ along
    return X
