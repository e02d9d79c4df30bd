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

from riseg_drake.geometry.camera import Intrinsics, bounding_region, project
from riseg_drake.geometry.nearest import nearest_places
from riseg_drake.geometry.rgbd import Frame, FramePair
from riseg_drake.geometry.se3 import inverse
from riseg_drake.kernels.drawing import drawn_labels
from riseg_drake.segmentation.above_table import AboveTable
from riseg_drake.segmentation.expected_flow import pixel_projection
from riseg_drake.segmentation.surface import SurfacePixels, seek, surface_pixels

UNKNOWN = np.uint16(65535)
"""Label of pixels above the table that no object has claimed yet; never leaves the propagator."""

DEPTH_AGREES = 0.008
"""m; a point and the surface it is looked up on are the same within that (noise, slopes, edges)."""

_REACH = 0.005
"""m; how far from its surroundings a pixel may take its label, where it has none of its own."""

_BOUNDARY = np.ones((7, 7), np.uint8)
"""Three pixels on each side of an outline have no depth of their own."""

_CLOSE = 5
"""Pixels; smaller gaps between points of one thing are closed."""

_BEHIND = 0.03
"""Share of its depth by which what shows through such a gap lies behind."""


def carry_labels(
    pair: FramePair,
    label_0: NDArray[np.uint16],
    motion_of: Mapping[int, NDArray[np.float64]],
    above_1: AboveTable,
    remembered_1: NDArray[np.uint16],
) -> NDArray[np.uint16]:
    """The labels of the reference frame, in the view of the current one.

    Args:
        pair: reference and current frame.
        label_0: [H, W], ids, UNKNOWN or 0, at the reference frame.
        motion_of: for the ids that moved, the motion [4, 4] in C0 from t-1 to t.
        above_1: objMask of the current frame.
        remembered_1: [H, W], ids where points that the reference frame did not see should be now.

    Returns:
        [H, W], ids, UNKNOWN or 0: every pixel above the table has a label, no other has one.
    """
    current = pair.current
    if not above_1.mask.any():
        return np.zeros(above_1.mask.shape, np.uint16)
    surface = surface_pixels(above_1.mask, current.depth, current.intrinsics)
    label = np.zeros(len(surface), np.uint16)
    gap = np.full(len(surface), DEPTH_AGREES, np.float32)
    for moves, motion in _by_motion(motion_of):
        found, apart = _look_up(surface, inverse(pair.X_C1C0 @ motion), label_0, pair.reference)
        better = (apart < gap) & moves.take(found)
        np.copyto(label, found, where=better)
        np.copyto(gap, apart, where=better)

    out = np.zeros(above_1.mask.shape, np.uint16)
    out.ravel()[surface.index] = np.where(label > 0, label, remembered_1.ravel().take(surface.index))
    return nearest_label(
        out, above_1.mask, current.depth, _REACH * above_1.pixels_per_metre(current.intrinsics)
    )


def draw_labels(
    reference: Frame,
    current: Frame,
    label_0: NDArray[np.uint16],
    motion_of: Mapping[int, NDArray[np.float64]],
) -> tuple[NDArray[np.uint16], NDArray[np.float32]]:
    """The labels [H, W] of the reference frame drawn into the current one by the depth of the former, and the
    depth [H, W] that they have there, m, 0 where nothing is drawn.

    For pixels where the current frame has no depth to look anything up by. `motion_of`: for the labels that
    moved, the motion [4, 4] in C0.
    """
    X_C1C0 = inverse(current.X_WC) @ reference.X_WC
    surface = surface_pixels(label_0 > 0, reference.depth, reference.intrinsics)
    label = label_0.ravel().take(surface.index)
    groups = _by_motion(motion_of)
    group = np.argmax([moves.take(label) for moves, _ in groups], axis=0)
    M = np.array([pixel_projection(X_C1C0 @ motion, reference.intrinsics) for _, motion in groups])
    drawn, spots = drawn_labels(surface.homogeneous, label, group, M, current.intrinsics.shape)
    # Nearer than it was, a thing is larger: its points leave gaps, through which others show.
    closed = cv2.morphologyEx(spots, cv2.MORPH_CLOSE, np.ones((_CLOSE, _CLOSE), np.uint8))
    drawn[closed > (1 + _BEHIND) * spots] = 0
    drawn = nearest_label(drawn, closed > 0, np.zeros_like(closed), _CLOSE)
    drawn[drawn == UNKNOWN] = 0
    depth = np.divide(1, closed, out=np.zeros_like(closed), where=drawn > 0)
    return drawn, depth


def nearest_label(
    label: NDArray[np.uint16], inside: NDArray[np.bool_], depth: NDArray[np.float32], reach: float
) -> NDArray[np.uint16]:
    """Give each unlabelled pixel inside [H, W] the label nearest to it, UNKNOWN beyond `reach` pixels.

    Objects that come into view, or are put there, must not become part of their neighbours; nor what a thing
    uncovers that has moved away: what is more than a line, and at another `depth` [H, W], m.
    """
    if not inside.any():
        return label
    region = bounding_region(inside, margin=1)
    out, old = label.copy(), label[region]
    empty = inside[region] & (old == 0)
    filled = np.where(empty, UNKNOWN, old)
    if empty.any() and old.any():
        places, distance = nearest_places(old > 0)
        near = np.flatnonzero(empty & (distance <= reach))
        nearest = places.of(near)
        broad = cv2.morphologyEx(empty.view(np.uint8), cv2.MORPH_OPEN, _BOUNDARY).ravel()[near] > 0
        if broad.any():
            z = depth[region]
            # On its own occlusion boundary a thing has no depth, or that of what is behind it.
            front = cv2.erode(np.where((old > 0) & (z > 0), z, np.float32(np.inf)), _BOUNDARY)
            z_labelled, z = front.ravel()[nearest], z.ravel()[near]
            other = broad & (z > 0) & np.isfinite(z_labelled) & (np.abs(z - z_labelled) > DEPTH_AGREES)
            near, nearest = near[~other], nearest[~other]
        filled.ravel()[near] = old.ravel()[nearest]
    out[region] = filled
    return out


def pixels_of(p_CQ: NDArray, intrinsics: Intrinsics) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
    """Nearest pixels (v, u) [N, 2] of points [N, 3], and which of them lie in the image."""
    uv = project(p_CQ, intrinsics)
    vu = np.rint(np.nan_to_num(uv[:, ::-1], nan=-1.0)).astype(np.intp)
    v, u = vu.T
    inside = (v >= 0) & (u >= 0) & (v < intrinsics.height) & (u < intrinsics.width)
    return vu, inside


def _by_motion(motion_of: Mapping[int, NDArray]) -> list[tuple[NDArray[np.bool_], NDArray]]:
    """For each motion that ids > 0 have, which of all labels [65536] have it; standing still first."""
    still = np.ones(65536, bool)
    still[[0, *motion_of]] = False
    groups: list[tuple[NDArray[np.bool_], NDArray]] = [(still, np.eye(4))]
    for a, motion in motion_of.items():
        for moves, shared in groups[1:]:
            if shared is motion or np.array_equal(shared, motion):
                moves[a] = True
                break
        else:
            moves = np.zeros(65536, bool)
            moves[a] = True
            groups.append((moves, motion))
    return groups


def _look_up(
    surface: SurfacePixels, X_C0C1: NDArray[np.float64], label_0: NDArray[np.uint16], reference: Frame
) -> tuple[NDArray[np.uint16], NDArray[np.float32]]:
    """Where N points of C1 were in C0, by X_C0C1: the label there, and how far the surface is (m)."""
    sought = seek(surface, X_C0C1)
    z_0 = sought.read(reference.depth)
    # Where depth has a hole the label alone must do, but any measured agreement is better.
    apart = np.where(z_0 > 0, np.abs(z_0 - sought.depth), np.float32(0.99 * DEPTH_AGREES))
    return sought.read(label_0), apart
