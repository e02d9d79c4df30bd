"""Fewer pixels of a frame, for work that must keep up with a camera."""

from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.geometry.rgbd import Frame

_AROUND = np.ones((3, 3), np.uint8)
_NEIGHBOURS = [(dv, du) for dv in (-1, 0, 1) for du in (-1, 0, 1) if dv or du]


def reduced(frame: Frame, width: int) -> Frame:
    """A frame in as few pixels as are at least `width` to a row, a whole number of the camera's to each.

    Colour is the mean of what a pixel covers; depth is that of one of these, since the mean of two surfaces is
    neither; the robot is wherever it covers some of a pixel. What is made has the frame as its `source`; where
    the frame is too small, or `width` is 0, it is the frame itself.
    """
    n = frame.intrinsics.width // width if width > 0 else 1
    if n < 2:
        return frame
    return replace(
        frame,
        intrinsics=reduced_intrinsics(frame.intrinsics, n),
        color=mean_of_each(frame.color, n),
        depth=np.ascontiguousarray(one_of_each(frame.depth, n)),
        robot=mean_of_each(frame.robot.view(np.uint8) * np.uint8(255), n) > 0,
        source=frame,
    )


def mean_of_each(image: NDArray[np.uint8], n: int) -> NDArray[np.uint8]:
    """Mean of each n x n pixels of an image [H, W, ...], as [H // n, W // n, ...]."""
    height, width = (k // n for k in image.shape[:2])
    return cv2.resize(image[: n * height, : n * width], (width, height), interpolation=cv2.INTER_AREA)


def one_of_each(image: NDArray, n: int) -> NDArray:
    """The middle one of each n x n pixels of an image [H, W, ...], as [H // n, W // n, ...]; a view of it."""
    height, width = (k // n for k in image.shape[:2])
    return image[n // 2 : n * height : n, n // 2 : n * width : n]


def reduced_intrinsics(intrinsics: Intrinsics, n: int) -> Intrinsics:
    """Of a camera each of whose pixels is n x n pixels of another; rows and columns that are left over are
    dropped."""
    return Intrinsics(
        width=intrinsics.width // n,
        height=intrinsics.height // n,
        fx=intrinsics.fx / n,
        fy=intrinsics.fy / n,
        cx=(intrinsics.cx + 0.5) / n - 0.5,
        cy=(intrinsics.cy + 0.5) / n - 0.5,
    )


def enlarged(label: NDArray[np.uint16], frame: Frame) -> NDArray[np.uint16]:
    """Labels [h, w] of a reduced frame in all pixels [H, W] of the whole one.

    Beside an outline a pixel takes the label of the one around it that is nearest to it in depth (joint
    upsampling, Kopf et al. 2007): the outlines are those of the whole depth image.
    """
    n, whole = frame.reduction, frame.whole.depth
    if n == 1:
        return label
    v, u = (np.minimum(np.arange(k) // n, few - 1) for k, few in zip(whole.shape, label.shape, strict=True))
    out = label.take(v, axis=0).take(u, axis=1)
    v, u = np.nonzero(cv2.morphologyEx(label, cv2.MORPH_GRADIENT, _AROUND))
    # A margin of one, so that all have eight neighbours.
    labels, depths = (cv2.copyMakeBorder(x, 1, 1, 1, 1, cv2.BORDER_REPLICATE) for x in (label, frame.depth))
    depths[depths == 0] = np.inf
    own = (v + 1) * labels.shape[1] + u + 1
    for inner in np.ndindex(n, n):
        place = (v * n + inner[0]) * whole.shape[1] + u * n + inner[1]
        z = whole.ravel().take(place)
        found, gap = labels.ravel().take(own), np.abs(depths.ravel().take(own) - z)
        gap[z == 0] = 0  # nothing tells which is nearer
        for dv, du in _NEIGHBOURS:
            beside = own + dv * labels.shape[1] + du
            apart = np.abs(depths.ravel().take(beside) - z)
            nearer = apart < gap
            np.copyto(found, labels.ravel().take(beside), where=nearer)
            np.copyto(gap, apart, where=nearer)
        out.ravel()[place] = found
    return out
