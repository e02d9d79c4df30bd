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
    pixels: NDArray[np.intp],
    cost_max: float,
    certainty: float,
) -> NDArray[np.float32]:
    """Squared normalised residuals [N] of gray values, those of each piece in the light that fits it best.

    Args:
        before: [N], gray values at t-1.
        after: [N], those found at t; NaN where none was.
        per_variance: [N], 1 / variance of the difference, where they belong together.
        piece: [N], 0..P-1, each changes its light as one.
        pixels: [P], how many there are of each piece.
        cost_max: squared residuals count no more than that.
        certainty: 1 / variance of the factor by which a piece's light changes, in the measure of the squared
            residuals of all of its pixels; what that costs is shared out among them.

    Returns:
        [N]; NaN where there is nothing to compare.
    """
    ceiling, count = np.float32(cost_max), len(pixels)
    cost = np.square(after - before)
    cost *= per_variance
    np.minimum(cost, ceiling, out=cost)
    unknown = np.isnan(cost)
    lost = np.flatnonzero(unknown)
    pixels = pixels - np.bincount(piece.take(lost), minlength=count)
    cost[lost] = 0
    total = np.bincount(piece, cost, count)
    cost[lost] = np.nan
    mine = np.flatnonzero((total > 0.5 * pixels).take(piece) & ~unknown)
    if not len(mine):
        return cost
    piece, weight = piece.take(mine), per_variance.take(mine)
    before, after = before.take(mine), after.take(mine)
    # The likeliest factor, by least squares.
    weighted = weight * before
    products = np.bincount(piece, weighted * after, count) + certainty
    factor = (products / (np.bincount(piece, weighted * before, count) + certainty)).astype(np.float32)
    price = (certainty * (factor - 1) ** 2 / np.maximum(pixels, 1)).astype(np.float32)
    # With it the noise of the first image is amplified.
    noise = np.square(np.maximum(factor, 1))
    other = np.square(after - factor.take(piece) * before)
    other *= weight
    other /= noise.take(piece)
    np.minimum(other, ceiling, out=other)
    other += price.take(piece)
    better = (np.bincount(piece, other, count) < total).take(piece)
    cost[mine[better]] = other[better]
    return cost
