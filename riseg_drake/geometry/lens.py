"""Cameras with a lens: images and pixels freed from its distortion."""

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.camera import Intrinsics, pixel_grid, rays_at

COEFFICIENTS = (0, 4, 5, 8, 12, 14)
"""How many numbers of distortion OpenCV takes: k1 k2 p1 p2, then k3, k4 k5 k6, s1 s2 s3 s4, t1 t2."""
FISHEYE_COEFFICIENTS = 4


@dataclass(frozen=True)
class Lens:
    """A camera whose images are distorted, as OpenCV describes it."""

    intrinsics: Intrinsics
    distortion: tuple[float, ...] = ()
    """OpenCV's coefficients; none for a pinhole."""
    fisheye: bool = False
    """Whether they are those of OpenCV's fisheye model (k1 to k4; ROS: equidistant)."""

    @property
    def is_pinhole(self) -> bool:
        """Whether there is nothing to set right."""
        return not any(self.distortion)

    def rays_at(self, uv: NDArray) -> NDArray[np.float64]:
        """The points at unit depth behind distorted pixels (u, v) [..., 2], [..., 3]."""
        if self.is_pinhole:
            return rays_at(np.asarray(uv, np.float64), self.intrinsics)
        points = np.asarray(uv, np.float64).reshape(-1, 1, 2)
        K, D = _matrix(self.intrinsics), np.array(self.distortion)
        undistort_points = cv2.fisheye.undistortPoints if self.fisheye else cv2.undistortPoints
        xy = undistort_points(points, K, D)
        return np.concatenate([xy, np.ones_like(xy[..., :1])], axis=-1).reshape(*uv.shape[:-1], 3)

    def undistorted(self, image: NDArray, *, nearest: bool = False) -> NDArray:
        """An image [H, W] or [H, W, C] as a pinhole with the same intrinsics would have taken it; 0 where it
        would have seen more than the lens did.

        Between pixels values are mixed; with `nearest`, as for depth and labels, they are taken as they are.
        """
        if self.is_pinhole:
            return image
        u, v = _sources(self)
        return cv2.remap(image, u, v, cv2.INTER_NEAREST if nearest else cv2.INTER_LINEAR)


@lru_cache(maxsize=4)
def _sources(lens: Lens) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Where in the distorted image each pixel of the pinhole's comes from."""
    K, D = _matrix(lens.intrinsics), np.array(lens.distortion)
    size = (lens.intrinsics.width, lens.intrinsics.height)
    if lens.fisheye:
        return cv2.fisheye.initUndistortRectifyMap(K, D, np.eye(3), K, size, cv2.CV_32FC1)
    return cv2.initUndistortRectifyMap(K, D, None, K, size, cv2.CV_32FC1)


@lru_cache(maxsize=8)
def grid_rays(lens: Lens, du: float, dv: float) -> NDArray[np.float64]:
    """The points at unit depth behind places (du, dv) off the centre of every pixel, [H, W, 3]. Read-only."""
    uv = pixel_grid(lens.intrinsics.height, lens.intrinsics.width) + np.array([du, dv])
    directions = lens.rays_at(uv)
    directions.flags.writeable = False
    return directions


def _matrix(k: Intrinsics) -> NDArray[np.float64]:
    return np.array([[k.fx, 0, k.cx], [0, k.fy, k.cy], [0, 0, 1]])
