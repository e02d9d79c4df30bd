"""Objects out of sight: points remembered in the world, so that ids survive occlusion and the view."""

from collections.abc import Mapping

import cv2
import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.camera import rays
from riseg_drake.geometry.rgbd import Frame, FramePair
from riseg_drake.geometry.se3 import inverse, move_points, seen_from
from riseg_drake.segmentation.propagation import UNKNOWN, pixels_of

_EVERY = 2
"""Every second pixel in each direction is remembered; the gaps close when they are drawn again."""
_DEPTH_AGREES = 0.015
"""m; what is seen within that of a remembered point may be it."""

Memory = Mapping[int, NDArray[np.float64]]
"""Points p_WQ [N, 3] of each id that the frame it belongs to does not see."""


def moved_memory(memory: Memory, motion_of: Mapping[int, NDArray], X_WC0: NDArray) -> Memory:
    """The memory with each object's points where its motion [4, 4] in C0 has taken them."""
    return {
        a: move_points(seen_from(X_WC0, motion_of[a]), p_WQ) if a in motion_of else p_WQ
        for a, p_WQ in memory.items()
    }


def draw_memory(memory: Memory, frame: Frame) -> NDArray[np.uint16]:
    """Where remembered points should be seen in a frame, [H, W], ids; 0 where nothing agrees with depth."""
    out = np.zeros(frame.depth.shape, np.uint16)
    for a, p_WQ in memory.items():
        p_CQ = move_points(inverse(frame.X_WC), p_WQ)
        vu, inside = pixels_of(p_CQ, frame.intrinsics)
        v, u, z = vu[inside, 0], vu[inside, 1], p_CQ[inside, 2]
        agrees = np.abs(frame.depth[v, u] - z) < _DEPTH_AGREES
        spots = np.zeros(out.shape, np.uint8)
        spots[v[agrees], u[agrees]] = 1
        spots = cv2.morphologyEx(spots, cv2.MORPH_CLOSE, np.ones((2 * _EVERY + 3,) * 2, np.uint8))
        out[(spots > 0) & (out == 0)] = a
    return out


def remember(
    memory: Memory,
    pair: FramePair,
    label_0: NDArray[np.uint16],
    motion_of: Mapping[int, NDArray],
) -> dict[int, NDArray[np.float64]]:
    """What the current frame no longer sees of each object.

    Args:
        memory: what the reference frame did not see, at that time.
        pair: reference and current frame.
        label_0: [H, W], ids at the reference frame.
        motion_of: motions in C0, for the ids that moved.
    """
    reference, current = pair.reference, pair.current
    coarse = (slice(None, None, _EVERY), slice(None, None, _EVERY))
    label = label_0[coarse]
    depth = reference.depth[coarse]
    visible = (label > 0) & (label != UNKNOWN) & (depth > 0)
    p_C0Q = rays(reference.intrinsics)[coarse][visible].astype(float) * depth[visible, None]
    p_WQ = move_points(reference.X_WC, p_C0Q)
    owner = label[visible]
    ids = np.union1d(np.unique(owner), list(memory)).astype(int)
    everything = {int(a): np.concatenate([memory.get(int(a), np.empty((0, 3))), p_WQ[owner == a]]) for a in ids}
    hidden = {}
    for a, points in moved_memory(everything, motion_of, reference.X_WC).items():
        out_of_sight = points[_out_of_sight(points, current)]
        if len(out_of_sight):
            hidden[a] = out_of_sight
    return hidden


def _out_of_sight(p_WQ: NDArray, frame: Frame) -> NDArray[np.bool_]:
    """Which points [N, 3] the frame does not see: out of the view, behind something, or without depth.

    A stereo camera has no depth beside near things. A point through which the frame looks at something
    further away is not hidden: it is no longer there.
    """
    p_CQ = move_points(inverse(frame.X_WC), p_WQ)
    vu, inside = pixels_of(p_CQ, frame.intrinsics)
    hidden = ~inside
    v, u = vu[inside].T
    depth = frame.unhidden_depth[v, u]
    hidden[inside] = (depth == 0) | (depth < p_CQ[inside, 2] - _DEPTH_AGREES)
    return hidden
