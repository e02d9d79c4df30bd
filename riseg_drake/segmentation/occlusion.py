"""Where a surface may go on behind what stands before it: superpixels that do not touch, and may be one body.

What is as high on both sides of what is higher may be one thing that is seen in two pieces; only motion can
tell.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from riseg_drake.segmentation.scales import LOWEST
from riseg_drake.segmentation.superpixels import Superpixels, label_middles, with_more

_FACE = 1.5
"""Sides of a superpixel from its middle within which what is in front rises: from aside its face is seen."""
_ON_THE_WAY = (1, 2, 4, 24)
"""Into how many equal parts the way from one to the other is cut in turn: what is not behind anything is mostly
found out by its middle."""


def with_occlusions(
    cut: Superpixels, height: NDArray[np.float32], table: NDArray[np.bool_], level: float
) -> Superpixels:
    """The superpixels, with borders between those that may be one behind what is in front of them.

    `height` [H, W], m above the `table`, which is seen [H, W]; surfaces on both sides are as high as each other
    within `level`, m.
    """
    pairs, width = seen_in_pieces(cut.label, height, table, level)
    return with_more(cut, pairs, width, across=False)


def seen_in_pieces(
    label: NDArray[np.intp], height: NDArray[np.float32], table: NDArray[np.bool_], level: float
) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Pairs of superpixels that may be one behind what is between them.

    Args:
        label: [H, W], 0..N-1 of superpixels, -1 where nothing stands, or nothing is known.
        height: [H, W], m above the table, where something stands.
        table: [H, W], where it is seen.
        level: m; surfaces on both sides whose heights differ by more are two.

    Returns:
        Pairs [M, 2], the smaller number first, rising, and how wide what each shares is, pixels [M].
    """
    stands = label >= 0
    area = np.bincount(label[stands])
    middle = label_middles(label, len(area)).T
    own = np.bincount(label[stands], height[stands]) / np.maximum(area, 1)
    face = _FACE * np.sqrt(np.median(area)) if len(area) else 0.0
    highest = cv2.dilate(np.where(stands, height, 0.0), np.ones((2 * round(face) + 1,) * 2, np.uint8))
    beside = np.zeros(len(area))
    np.maximum.at(beside, label[stands], highest[stands])
    front = np.flatnonzero(beside > own + LOWEST)
    a, b = front[np.stack(np.triu_indices(len(front), 1))]
    a, b = np.stack([a, b])[:, np.abs(own[a] - own[b]) < level]
    for parts in _ON_THE_WAY:
        at = (np.arange(parts) + 0.5) / parts
        (v_a, u_a), (v_b, u_b) = middle[:, a], middle[:, b]
        v, u = (
            np.rint(p[:, None] + (q - p)[:, None] * at).astype(np.intp) for p, q in ((v_a, v_b), (u_a, u_b))
        )
        between = (label[v, u] != a[:, None]) & (label[v, u] != b[:, None])
        long = np.hypot(v_b - v_a, u_b - u_a)[:, None]
        inner = between & (long * np.minimum(at, 1 - at) > face)
        low = height[v, u] < (np.maximum(own[a], own[b]) + LOWEST)[:, None]
        hidden = ~(between & table[v, u]).any(1) & ~(inner & low & stands[v, u]).any(1)
        a, b = a[hidden], b[hidden]
    hidden = inner[hidden].any(1)
    a, b = a[hidden], b[hidden]
    # What may go on as any of several shares its width with them.
    partners = np.bincount(a, minlength=len(area)) + np.bincount(b, minlength=len(area))
    width = np.sqrt(np.minimum(area[a], area[b])) / np.maximum(partners[a], partners[b])
    return np.stack([a, b], axis=1), width
