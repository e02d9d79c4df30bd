"""Shadows come and go: gray values compared where the light may have changed (not in the paper).

A shadow makes a surface darker by one factor and leaves its pattern. So each small piece of the image
may have become darker or brighter as a whole, at a price: mostly the light is what it was.
"""

import numpy as np
from numpy.typing import NDArray

_TINY = 1e-6
"""Keeps a piece that was black from dividing by zero."""


def gray_costs(
    before: NDArray[np.float32],
    after: NDArray[np.float32],
    per_variance: NDArray,
    piece: NDArray[np.intp],
    count: int,
    cost_max: float,
    relit: float,
) -> NDArray[np.float32]:
    """Squared normalised residuals [N] of gray values, where needed those of a piece in another light.

    Args:
        before: [N], gray values at t-1.
        after: [N], those found at t; NaN where none was.
        per_variance: [N], 1 / variance of the difference, where they belong together.
        piece: [N], 0..count-1, each changes its light as one.
        count: number of pieces.
        cost_max: squared residuals count no more than that.
        relit: what it adds to each pixel of a piece if the light there is taken to have changed.

    Returns:
        [N]; NaN where there is nothing to compare.
    """
    ceiling = np.float32(cost_max)
    cost = np.minimum((after - before) ** 2 * per_variance, ceiling)
    compared = np.isfinite(cost)
    total = np.bincount(piece, np.where(compared, cost, 0), count)
    doubtful = total > (1 + relit) * np.bincount(piece, compared, count)
    mine = np.flatnonzero(doubtful[piece] & compared)
    if not len(mine):
        return cost
    piece, before, after, weight = piece[mine], before[mine], after[mine], per_variance[mine]
    # The factor that fits a piece best, by least squares.
    squares = np.maximum(np.bincount(piece, weight * before**2, count), _TINY)
    by = (np.bincount(piece, weight * before * after, count) / squares).astype(np.float32)[piece]
    # With it the noise of the first image is amplified.
    other = (after - by * before) ** 2 * weight / np.maximum(by, 1) ** 2
    other = np.minimum(other, ceiling) + np.float32(relit)
    better = (np.bincount(piece, other, count) < total)[piece]
    cost[mine[better]] = other[better]
    return cost
