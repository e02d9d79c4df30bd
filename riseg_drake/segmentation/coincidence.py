"""How much of a motion two neighbours must show alike before that is a coincidence.

A blank round thing shows where it is, not how it is turned. Two such things that touch and are pushed along
stay as far apart as they were, and however they roll about each other, one rigid motion explains both. What two
things show alike is what both of them show: of three freedoms in the image, two shifts and a turn, those that
the gray values of either one determine. One of them things that touch have in common anyway, as they go on
touching.
"""

import numpy as np
from numpy.typing import NDArray

from riseg_drake.segmentation.alignment import EdgePixels

FREEDOMS = 3
"""Of a rigid motion in the image: two shifts and a turn."""
_FAINT = 0.05
"""A freedom is shown where there is more than this share of what shows a shift best: shading and noise turn
gradients aside a little. Set by hand."""


def freedoms_shown(
    edges: EdgePixels, gray: NDArray[np.float32], part: NDArray[np.intp], borders: NDArray[np.intp]
) -> NDArray[np.float64]:
    """[M], of how many freedoms, 0 to 3, both sides of a border tell; 3 inside a part.

    Args:
        edges: pixels that tell where they are, of N superpixels.
        gray: [H, W], of their picture.
        part: [N], 0.., which superpixels may be one body.
        borders: [M, 2], pairs of superpixels.
    """
    a, b = np.sort(part[borders], axis=1).T
    known = np.full(len(borders), float(FREEDOMS))
    count = int(part.max(initial=-1)) + 1
    pairs, which = np.unique((a * count + b)[a != b], return_inverse=True)
    if not len(pairs):
        return known
    information, middle = _information(edges, gray, part[edges.piece], count)
    i, j = np.divmod(pairs, count)
    # About the point between them, a turn by one over the radius moves both as far as a shift by one.
    origin = (middle[i] + middle[j]) / 2
    radius = np.maximum(np.linalg.norm(middle[i] - middle[j], axis=1) / 2, 1.0)
    I_i, I_j = (_about(information[k], origin - middle[k], radius) for k in (i, j))
    best = np.minimum(*(np.linalg.eigvalsh(each[:, :2, :2])[:, -1] for each in (I_i, I_j)))
    faint = _FAINT * np.maximum(best, 1e-9)
    # What two uncertain measurements of one thing say of their being equal.
    both = I_i @ np.linalg.pinv(I_i + I_j, rcond=1e-9, hermitian=True) @ I_j
    clear = np.square(np.linalg.eigvalsh(both) / faint[:, None])
    known[a != b] = (clear / (1 + clear)).sum(1)[which.ravel()]
    return known


def _information(
    edges: EdgePixels, gray: NDArray[np.float32], owner: NDArray[np.intp], count: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Of each part about its middle: the information [P, 3, 3] on its shifts, px, and its turn, rad; the
    middle [P, 2], px."""
    v, u = edges.surface.pixel
    height, width = gray.shape
    right, left = gray[v, np.minimum(u + 1, width - 1)], gray[v, np.maximum(u - 1, 0)]
    below, above = gray[np.minimum(v + 1, height - 1), u], gray[np.maximum(v - 1, 0), u]
    slope = np.stack([right - left, below - above]) / (2 * np.sqrt(edges.variance))
    number = np.maximum(np.bincount(owner, minlength=count), 1)
    at = np.stack([u, v]).astype(float)
    middle = np.stack([np.bincount(owner, x, count) for x in at], axis=1) / number[:, None]
    x, y = at - middle[owner].T
    J = np.array([slope[0], slope[1], slope[1] * x - slope[0] * y])
    total = [[np.bincount(owner, k * m, count) for k in J] for m in J]
    return np.moveaxis(np.array(total), 2, 0), middle


def _about(
    information: NDArray[np.float64], offset: NDArray[np.float64], radius: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Information [K, 3, 3] about other origins, by `offset` [K, 2], px, away, of turns that move what is a
    `radius` [K], px, away by one pixel."""
    T = np.tile(np.eye(FREEDOMS), (len(offset), 1, 1))
    # A turn about the other origin also shifts the middle.
    T[:, 0, 2], T[:, 1, 2] = offset[:, 1], -offset[:, 0]
    T[:, :, 2] /= radius[:, None]
    return np.swapaxes(T, 1, 2) @ information @ T
