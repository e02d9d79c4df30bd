"""Light changes: gray values compared where a surface may have become brighter or darker (not in the paper).

What turns is shaded anew, and shadows come and go: a surface becomes darker by one factor and keeps its
pattern. So each small piece of the image may have become darker or brighter as a whole, by a factor near 1 as
a rule.
"""

import numpy as np
from numpy.typing import NDArray


def gray_costs(
    before: NDArray[np.float32],
    after: NDArray[np.float32],
    per_variance: NDArray,
    piece: NDArray[np.intp],
    count: int,
    cost_max: float,
    certainty: float,
) -> NDArray[np.float32]:
    """Squared normalised residuals [N] of gray values, those of each piece in the light that fits it best.

    Args:
        before: [N], gray values at t-1.
        after: [N], those found at t; NaN where none was.
        per_variance: [N], 1 / variance of the difference, where they belong together.
        piece: [N], 0..count-1, each changes its light as one.
        count: number of pieces.
        cost_max: squared residuals count no more than that.
        certainty: 1 / variance of the factor by which a piece's light changes, in the measure of the squared
            residuals of all of its pixels; what that costs is shared out among them.

    Returns:
        [N]; NaN where there is nothing to compare.
    """
    ceiling = np.float32(cost_max)
    cost = np.minimum((after - before) ** 2 * per_variance, ceiling)
    compared = np.isfinite(cost)
    pixels = np.bincount(piece, compared, count)
    total = np.bincount(piece, np.where(compared, cost, 0), count)
    mine = np.flatnonzero((total > 0.5 * pixels)[piece] & compared)
    if not len(mine):
        return cost
    piece, before, after, weight = piece[mine], before[mine], after[mine], per_variance[mine]
    # The likeliest factor, by least squares.
    products = np.bincount(piece, weight * before * after, count) + certainty
    factor = (products / (np.bincount(piece, weight * before**2, count) + certainty)).astype(np.float32)
    price = (certainty * (factor - 1) ** 2 / np.maximum(pixels, 1)).astype(np.float32)
    by = factor[piece]
    # With it the noise of the first image is amplified.
    other = np.minimum((after - by * before) ** 2 * weight / np.maximum(by, 1) ** 2, ceiling) + price[piece]
    better = (np.bincount(piece, other, count) < total)[piece]
    cost[mine[better]] = other[better]
    return cost
