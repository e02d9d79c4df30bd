"""Alg. 2, line 7, first half: the mask L_t-1 carried to t.

The labels stay where they were decided, in the view of the reference frame, and each pixel of the
current view looks up where its point was: carried back by the camera's motion and by the motion of
the object, in float, without rounding from frame to frame. The current depth image then draws the
outline, so nothing creeps.
"""

from collections.abc import Mapping

import cv2
import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.camera import Intrinsics, Region, bounding_region, project, rays
from riseg_drake.geometry.rgbd import FramePair
from riseg_drake.geometry.se3 import inverse
from riseg_drake.segmentation.association import UNKNOWN
from riseg_drake.segmentation.expected_flow import flow_of_motion, where_to

_DEPTH_AGREES = 0.008
"""m; a point and the surface it is looked up on are the same within that (noise, slopes, edges)."""

_REACH = 0.005
"""m; how far from its surroundings a pixel may take its label, where it has none of its own."""


def carry_labels(
    pair: FramePair,
    label_0: NDArray[np.uint16],
    motion_of: Mapping[int, NDArray[np.float64]],
    above_1: NDArray[np.bool_],
    remembered_1: NDArray[np.uint16],
) -> NDArray[np.uint16]:
    """The labels of the reference frame, in the view of the current one.

    Args:
        pair: reference and current frame.
        label_0: [H, W], ids, UNKNOWN or 0, at the reference frame.
        motion_of: for the ids that moved, the motion [4, 4] in C0 from t-1 to t.
        above_1: [H, W], objMask of the current frame.
        remembered_1: [H, W], ids where points that the reference frame did not see should be now.

    Returns:
        [H, W], ids, UNKNOWN or 0: every pixel above the table has a label, no other has one.
    """
    current = pair.current
    if not above_1.any():
        return np.zeros(above_1.shape, np.uint16)
    everywhere = bounding_region(above_1)
    label = np.zeros(above_1.shape, np.uint16)
    gap = np.full(above_1.shape, _DEPTH_AGREES, np.float32)
    z_1 = np.where(above_1, current.depth, np.float32(0))

    still = np.ones(65536, bool)
    still[[0, *motion_of]] = False
    for ids, motion in _by_motion(motion_of):
        region, moves = everywhere, still
        if ids:
            moves = np.zeros(65536, bool)
            moves[ids] = True
            region = _where_to(pair, motion, moves[label_0])
        found, apart = _look_up(z_1[region], inverse(pair.X_C1C0 @ motion), region, label_0, pair)
        better = (apart < gap[region]) & moves[found]
        label[region][better] = found[better]
        gap[region][better] = apart[better]

    out = label
    lost = above_1 & (out == 0) & (remembered_1 > 0)
    out[lost] = remembered_1[lost]
    seen = z_1[everywhere][above_1[everywhere]]
    reach = _REACH * current.intrinsics.fx / max(float(np.median(seen)), 1e-3)
    return nearest_label(out, above_1, reach)


def nearest_label(label: NDArray[np.uint16], inside: NDArray[np.bool_], reach: float) -> NDArray[np.uint16]:
    """Give each unlabelled pixel inside the label nearest to it, UNKNOWN beyond `reach` pixels.

    Objects that come into view, or are put there, must not become part of their neighbours.
    """
    if not inside.any():
        return label
    region = bounding_region(inside, margin=1)
    out, old = label.copy(), label[region]
    empty = inside[region] & (old == 0)
    filled = np.where(empty, UNKNOWN, old)
    if empty.any() and old.any():
        distance, index = cv2.distanceTransformWithLabels(
            (old == 0).astype(np.uint8), cv2.DIST_L2, 3, labelType=cv2.DIST_LABEL_PIXEL
        )
        value = np.zeros(index.max() + 1, np.uint16)
        value[index[old > 0]] = old[old > 0]
        near = empty & (distance <= reach)
        filled[near] = value[index[near]]
    out[region] = filled
    return out


def pixels_of(p_CQ: NDArray, intrinsics: Intrinsics) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
    """Nearest pixels (v, u) [N, 2] of points [N, 3], and which of them lie in the image."""
    uv = project(p_CQ, intrinsics)
    vu = np.rint(np.nan_to_num(uv[:, ::-1], nan=-1.0)).astype(np.intp)
    v, u = vu.T
    inside = (v >= 0) & (u >= 0) & (v < intrinsics.height) & (u < intrinsics.width)
    return vu, inside


def _by_motion(motion_of: Mapping[int, NDArray]) -> list[tuple[list[int], NDArray]]:
    """Ids that share a motion, together; standing still (no ids) first."""
    groups: list[tuple[list[int], NDArray]] = [([], np.eye(4))]
    for a, motion in motion_of.items():
        for ids, shared in groups[1:]:
            if shared is motion or np.array_equal(shared, motion):
                ids.append(a)
                break
        else:
            groups.append(([a], motion))
    return groups


def _where_to(pair: FramePair, motion: NDArray, mine: NDArray[np.bool_]) -> Region:
    """The part of the current view in which pixels `mine` [H, W] of the reference view must be sought."""
    if not mine.any():
        return slice(0, 0), slice(0, 0)
    rows, columns = bounding_region(mine)
    coarse = slice(rows.start, rows.stop, 4), slice(columns.start, columns.stop, 4)
    depth = np.where(mine[coarse], pair.reference.depth[coarse], np.float32(0))
    flow = flow_of_motion(depth, pair.X_C1C0 @ motion, pair.reference.intrinsics, coarse)
    v, u = np.nonzero(np.isfinite(flow[..., 0]))
    if not len(v):
        return slice(0, 0), slice(0, 0)
    spans = []
    for start, index, shift, size in (
        (coarse[0].start, v, flow[v, u, 1], mine.shape[0]),
        (coarse[1].start, u, flow[v, u, 0], mine.shape[1]),
    ):
        place = start + 4 * index + shift
        low, high = np.clip([place.min() - 8, place.max() + 9], 0, size).astype(int)
        spans.append(slice(int(low), int(high)))
    return spans[0], spans[1]


def _look_up(
    z_1: NDArray[np.float32],
    X_C0C1: NDArray[np.float64],
    region: Region,
    label_0: NDArray[np.uint16],
    pair: FramePair,
) -> tuple[NDArray[np.uint16], NDArray[np.float32]]:
    """Where the points of a region of C1 were in C0: the label there, and how far (m) the surface is.

    Args:
        z_1: [h, w], depth in the region, 0 = leave out.
        X_C0C1: [4, 4], takes the points back.
        region: the part of C1.
        label_0: [H, W], labels in C0.
        pair: for depth and intrinsics of C0.
    """
    intrinsics = pair.reference.intrinsics
    source, z_expected = where_to(rays(intrinsics)[region], z_1, X_C0C1, intrinsics)
    found = cv2.remap(label_0, source, None, cv2.INTER_NEAREST, borderValue=0)
    z_0 = cv2.remap(pair.reference.depth, source, None, cv2.INTER_NEAREST, borderValue=0)
    # Where depth has a hole the label alone must do, but any measured agreement is better.
    apart = np.where(z_0 > 0, np.abs(z_0 - z_expected), np.float32(0.99 * _DEPTH_AGREES))
    return np.where(z_1 > 0, found, np.uint16(0)), apart
