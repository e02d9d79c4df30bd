"""Pixels of one view drawn into another, the nearest on top, `segmentation.propagation`."""

import numpy as np
from numpy.typing import NDArray

from riseg_drake.kernels.compiled import compiled
from riseg_drake.kernels.reading import projected


@compiled(
    "Tuple((uint16[:, ::1], float32[:, ::1]))(float32[:, ::1], uint16[::1], intp[::1], float32[:, :, ::1],"
    "UniTuple(intp, 2))"
)
def drawn_labels(
    pixel: NDArray[np.float32],
    label: NDArray[np.uint16],
    motion: NDArray[np.intp],
    M: NDArray[np.float32],
    shape: tuple[int, int],
) -> tuple[NDArray[np.uint16], NDArray[np.float32]]:
    """The labels [H, W] of what is nearest at each pixel of the other view, and 1 / depth there [H, W], 1/m; 0
    where nothing is.

    Args:
        pixel: [4, N or more], (u, v, 1, 1 / z) of N pixels.
        label: [N].
        motion: [N], 0..G-1, that of each.
        M: [G, 3, 4], see `pixel_projection`, of each motion.
        shape: (H, W).
    """
    out, per_depth = np.zeros(shape, np.uint16), np.zeros(shape, np.float32)
    for n in range(len(label)):
        u, v, c = projected(M[motion[n]], pixel, n)
        j, i = np.rint(u), np.rint(v)
        if j >= 0 and i >= 0 and j < shape[1] and i < shape[0]:  # never of NaN
            nearness = pixel[3, n] / c
            if nearness > per_depth[int(i), int(j)]:
                per_depth[int(i), int(j)], out[int(i), int(j)] = nearness, label[n]
    return out, per_depth
