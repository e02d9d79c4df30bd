"""How badly many slides and turns on a plane explain some points, all at once and in blurred images.

There a step of a grid of motions leads into the right valley, which others go down. What rolls is lit anew, and
light that glances off it stays where it is: there only what is printed is compared, without what is broad.
"""

from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.se3 import skew
from riseg_drake.segmentation.comparison import Comparison
from riseg_drake.segmentation.likelihood import EXPECTED

_BROAD = 3.0
"""Standard deviations of the blur, within which gray values differ by what is printed rather than by light."""
_AT_ONCE = 256
"""Motions, about, that are tried at once."""


class SlideCosts:
    """A keyframe and a frame, prepared for many motions, given in the keyframe's camera K."""

    def __init__(self, compared: Comparison, standing: NDArray[np.bool_], blur: float, residual_max: float):
        """With objMask of the frame [H, W], the standard deviation of the blur, pixels, and what squared
        residuals count at most."""
        self._compared, self._residual_max = compared, residual_max
        gray_0 = compared.keyframe.frame.gray
        self._gray_0, self._gray_1 = (cv2.GaussianBlur(g, (0, 0), blur) for g in (gray_0, compared.frame.gray))
        self._blur = blur
        gradient = np.hypot(*(cv2.Sobel(gray_0, cv2.CV_32F, *d, scale=0.125) for d in ((1, 0), (0, 1))))
        self._variance = 8 + (0.5 * blur * cv2.GaussianBlur(gradient, (0, 0), blur)) ** 2
        self._standing = standing.astype(np.float32)

    @cached_property
    def _printed(self) -> tuple[NDArray, NDArray]:
        """Both images without what is broad."""
        first, second = (
            gray - cv2.GaussianBlur(gray, (0, 0), _BROAD * self._blur) for gray in (self._gray_0, self._gray_1)
        )
        return first, second

    def of(
        self, p_KQ: NDArray, v: NDArray, u: NDArray, motions_K: NDArray, *, lit_anew: bool = False
    ) -> NDArray:
        """Mean squared residuals [G] under motions [G, 4, 4] of points [S, 3], m, at pixels v, u [S]."""
        image_0, image_1 = self._printed if lit_anew else (self._gray_0, self._gray_1)
        gray_0, variance = image_0[v, u], self._variance[v, u]
        parts = (self._costs(p_KQ, gray_0, image_1, variance, some) for some in _some_at_once(motions_K))
        return np.concatenate(list(parts))

    def _costs(
        self, p_KQ: NDArray, gray_0: NDArray, image_1: NDArray, variance: NDArray, motions_K: NDArray
    ) -> NDArray:
        """The same of points with gray values and variances [S], in an image [H, W]."""
        frame, most = self._compared.frame, np.float32(self._residual_max)
        u_1, v_1, z = self._places(p_KQ, motions_K)
        cost = cv2.remap(image_1, u_1, v_1, cv2.INTER_LINEAR, borderValue=0)
        cost -= gray_0
        cost *= cost
        cost /= variance
        np.minimum(cost, most, out=cost)
        z_1 = cv2.remap(frame.unhidden_depth, u_1, v_1, cv2.INTER_NEAREST, borderValue=0)
        missing = z_1 == 0
        z_1 -= z
        z *= z
        z *= np.float32(2 * np.sqrt(2) * self._compared.depth_noise)  # the standard deviation
        z_1 /= z
        z_1 *= z_1
        np.minimum(z_1, most, out=z_1)
        np.copyto(z_1, np.float32(EXPECTED / 2), where=missing)
        cost += z_1
        return cost.mean(1)

    def taken(self, p_KQ: NDArray, motions_K: NDArray) -> NDArray:
        """Squared residuals [G] for free points [S, 3], m, that motions [G, 4, 4] take where it is not free."""
        means = []
        for some in _some_at_once(motions_K):
            u, v, _ = self._places(p_KQ, some)
            means.append(cv2.remap(self._standing, u, v, cv2.INTER_LINEAR, borderValue=0).mean(1))
        return self._residual_max * np.concatenate(means)

    def _places(self, p_KQ: NDArray, motions_K: NDArray) -> tuple[NDArray, NDArray, NDArray]:
        """Where motions [G, 4, 4] take points [S, 3] in the frame: u, v, pixels, and depth, m, [G, S]."""
        k = self._compared.frame.intrinsics
        K = np.array([[k.fx, 0, k.cx], [0, k.fy, k.cy], [0, 0, 1]])
        # One product for all motions: beside each other they are the columns of one matrix.
        P = (K @ self._compared.X_C1K[:3]) @ motions_K.swapaxes(0, 1).reshape(4, -1)
        homogeneous = np.column_stack([p_KQ, np.ones(len(p_KQ))]).astype(np.float32)
        u, v, z = P.reshape(3, -1, 4).astype(np.float32) @ homogeneous.T
        u /= z
        v /= z
        return u, v, z


def _some_at_once(motions_K: NDArray) -> list[NDArray]:
    """Motions [G, 4, 4] in parts, few enough for all that is made of them to stay in the processor's cache."""
    return np.array_split(motions_K, max(1, len(motions_K) // _AT_ONCE))


def slides(normal: NDArray, centre: NDArray, amounts: NDArray) -> NDArray[np.float64]:
    """Motions [G, 4, 4] of things on a plane: shifted along it by two of `amounts` [G, 3], m, and turned about
    its normal [3] through a centre [3] by the third, rad."""
    return turned_and_shifted(normal / np.linalg.norm(normal), centre, along_plane(normal), amounts)


def turned_and_shifted(axis: NDArray, point: NDArray, along: NDArray, amounts: NDArray) -> NDArray[np.float64]:
    """Motions [G, 4, 4]: turned about an axis [3], of length 1, through a point [3] by the third of `amounts`
    [G, 3], rad, then shifted by the others along two directions [2, 3], m."""
    K = skew(axis)
    sine, cosine = np.sin(amounts[:, 2, None, None]), np.cos(amounts[:, 2, None, None])
    X = np.tile(np.eye(4), (len(amounts), 1, 1))
    X[:, :3, :3] += sine * K + (1 - cosine) * (K @ K)
    X[:, :3, 3] = point - X[:, :3, :3] @ point + amounts[:, :2] @ along
    return X


def along_plane(normal: NDArray) -> NDArray[np.float64]:
    """Two directions [2, 3], of length 1 and across each other, in a plane of some normal [3]."""
    n = normal / np.linalg.norm(normal)
    first = np.cross(n, np.eye(3)[np.abs(n).argmin()])
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(n, first)])
