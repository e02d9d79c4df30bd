"""Where a surface may go on behind what stands before it: superpixels that do not touch, and may be one body.

Along a line of the picture heights rise to what is in front, and fall again behind it. What is as high on both
sides may be one thing that is seen in two pieces; only motion can tell.
"""

import numpy as np
from numpy.typing import NDArray

from riseg_drake.segmentation.scales import LOWEST

_BESIDE = 3
"""Pixels from a border at which heights are read: nearer they are blurred."""
_EVERY = 2
"""Lines of the picture between two that are looked at."""


def seen_in_pieces(
    label: NDArray[np.intp], height: NDArray[np.float32], level: float
) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Pairs of superpixels that may be one behind what is between them.

    Args:
        label: [H, W], 0..N-1 of superpixels, -1 where nothing stands.
        height: [H, W], m above the table.
        level: m; surfaces on both sides whose heights differ by more are two.

    Returns:
        Pairs [M, 2], the smaller number first, rising, and how wide what each shares is, pixels [M].
    """
    pairs: dict[tuple[int, int], float] = {}
    for labels, heights in ((label, height), (label.T, height.T)):
        for line in range(_EVERY // 2, len(labels), _EVERY):
            for a, b in _along(labels[line], heights[line], level):
                if a != b:
                    pair = (min(a, b), max(a, b))
                    pairs[pair] = pairs.get(pair, 0.0) + _EVERY
    found = sorted(pairs)
    return np.array(found, np.intp).reshape(-1, 2), np.array([pairs[pair] for pair in found], float)


def _along(label: NDArray[np.intp], height: NDArray[np.float32], level: float) -> list[tuple[int, int]]:
    """The pairs of superpixels along one line [W] of the picture."""
    border = np.flatnonzero(label[1:] != label[:-1])  # between that pixel and the next one
    before = height[np.maximum(border - _BESIDE + 1, 0)]
    after = height[np.minimum(border + _BESIDE, len(height) - 1)]
    sides = np.stack([label[border], label[border + 1]], axis=1)
    found: list[tuple[int, int]] = []
    waiting: list[tuple[int, float]] = []  # what went behind something, the lowest first, and its height
    for (a, b), h_0, h_1 in zip(sides.tolist(), before.tolist(), after.tolist(), strict=True):
        if a < 0 or b < 0:
            waiting = []  # the table is seen
        elif h_1 > h_0 + LOWEST:
            waiting.append((a, h_0))
        elif h_1 < h_0 - LOWEST:
            lower = []
            while waiting and waiting[-1][1] > h_1 - level:
                behind, h = waiting.pop()
                if h < h_1 + level:
                    found.append((behind, b))
                if h < h_1 - LOWEST:  # what is higher may be in front of it, too
                    lower.append((behind, h))
            waiting += reversed(lower)
    return found
