"""Alg. 3, line 6: clusters of the points that are yet to be segmented.

K-Means with k by the elbow method, as in the paper, or K-Medoids or Mean Shift, which the paper says
could be used as well. All work on points of the table in metres.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist
from sklearn.cluster import MeanShift


@dataclass
class ClusteringParameters:
    """How to divide the unsegmented points into clusters."""

    method: str = "k-means"
    """"k-means" (the paper's), "k-medoids" or "mean-shift"."""
    largest_k: int = 8
    """The elbow is looked for in k = 1 .. this many clusters."""
    elbow: float = 0.25
    """How sharply the curve ln(inertia) over ln(k) must bend at k beyond what splitting one compact
    blob would give; where no k does, everything is one cluster."""
    sample: int = 400
    """Points that take part in finding the centers; all are then given to the nearest center."""
    restarts: int = 2
    """K-Means and K-Medoids keep the best of this many random starts."""
    bandwidth: float = 0.03
    """Radius of Mean Shift's window, m."""
    finer: int = 2
    """How many finer clusterings may follow where the chosen one has no valid push."""


METHODS = ("k-means", "k-medoids", "mean-shift")


@dataclass(frozen=True)
class Clustering:
    """Points divided by their nearest center."""

    centers: NDArray[np.float64]
    """[k, 2], m."""
    labels: NDArray[np.intp]
    """[N], which center each of the N points belongs to; every center has a point."""


def clusterings(
    p_WQ: NDArray,
    parameters: ClusteringParameters,
    rng: np.random.Generator,
    *,
    one_first: bool = False,
    least: int = 1,
) -> Iterator[Clustering]:
    """First the clustering that the method chooses, then a few finer ones.

    The finer ones are there for scenes where the first has no valid push: the center of a ring is not
    on the ring, but the centers of its parts are.

    Args:
        p_WQ: [N, 2], N >= 1 points on the table, m.
        parameters: method and its constants.
        rng: subsampling and random starts.
        one_first: begin with a single cluster instead of asking the method.
        least: begin with no fewer clusters than this, where K-Means or K-Medoids is asked.

    Raises:
        ValueError: for a method that does not exist.
    """
    if parameters.method not in METHODS:
        raise ValueError(f"clustering method '{parameters.method}' does not exist; use one of {METHODS}")
    sample = p_WQ
    if len(p_WQ) > parameters.sample:
        sample = p_WQ[rng.choice(len(p_WQ), parameters.sample, replace=False)]
    first = 1 if one_first else None
    if parameters.method == "mean-shift":
        if one_first:
            yield _by_nearest_center(p_WQ, p_WQ.mean(axis=0, keepdims=True))
        for bandwidth in parameters.bandwidth * 0.7 ** np.arange(1 + parameters.finer):
            centers = MeanShift(bandwidth=bandwidth, bin_seeding=True).fit(sample).cluster_centers_
            yield _by_nearest_center(p_WQ, centers)
        return
    fit = _k_means if parameters.method == "k-means" else _k_medoids
    largest_k = min(parameters.largest_k, len(sample))
    fits: dict[int, NDArray] = {}
    if first is None:
        inertia = np.empty(largest_k)
        for k in range(1, largest_k + 1):
            fits[k], inertia[k - 1] = fit(sample, k, parameters.restarts, rng)
        first = min(max(elbow(inertia, parameters.elbow), least), largest_k)
    for k in range(first, min(first + parameters.finer, largest_k) + 1):
        centers = fits[k] if k in fits else fit(sample, k, parameters.restarts, rng)[0]
        yield _by_nearest_center(p_WQ, centers)


def elbow(inertia: NDArray, threshold: float) -> int:
    """The k at which the curve of inertia over k bends most sharply; 1 if it never does.

    Inertia [K], for k = 1 .. K, is the sum of squared distances to the centers. Splitting one compact
    blob in the plane gives about 1/k, a straight line of slope -1 over ln(k). Real clusters make the
    curve steeper up to their number and flatter beyond it. The bend at k is measured as the change of
    ln(inertia * k) before k against after k, so that a blob's own curve has no bend anywhere.
    """
    if len(inertia) < 3:
        return 1
    relative = np.log(np.maximum(inertia, 1e-12 * max(inertia[0], 1e-12)) * np.arange(1, len(inertia) + 1))
    bend = relative[:-2] - 2 * relative[1:-1] + relative[2:]
    sharpest = int(np.argmax(bend))
    return sharpest + 2 if bend[sharpest] > threshold else 1


def _k_means(
    points: NDArray, k: int, restarts: int, rng: np.random.Generator
) -> tuple[NDArray[np.float64], float]:
    """Centers [k, 2] and inertia (Lloyd's iterations, with k-means++ starts)."""
    best: tuple[float, NDArray] = (np.inf, points[:k])
    for _ in range(restarts):
        centers = points[_spread_start(points, k, rng)]
        for _ in range(60):
            nearest = np.argmin(cdist(points, centers, "sqeuclidean"), axis=1)
            count = np.bincount(nearest, minlength=k)[:, None]
            sums = np.stack([np.bincount(nearest, x, k) for x in points.T], axis=1)
            updated = np.where(count > 0, sums / np.maximum(count, 1), centers)
            if np.array_equal(updated, centers):
                break
            centers = updated
        inertia = float(cdist(points, centers, "sqeuclidean").min(axis=1).sum())
        if inertia < best[0]:
            best = inertia, centers
    return best[1], best[0]


def _k_medoids(
    points: NDArray, k: int, restarts: int, rng: np.random.Generator
) -> tuple[NDArray[np.float64], float]:
    """Centers [k, 2] that are points themselves, and the sum of squared distances to them.

    Alternates assignment and the choice of each cluster's most central point (Park and Jun 2009), on
    at most 500 of the points: the distances between all pairs are needed.
    """
    candidates = points
    if len(points) > 500:
        candidates = points[rng.choice(len(points), 500, replace=False)]
    distance = cdist(candidates, candidates)
    best: tuple[float, NDArray] = (np.inf, np.arange(k))
    for _ in range(restarts):
        medoids = _spread_start(candidates, k, rng)
        for _ in range(30):
            nearest = np.argmin(distance[:, medoids], axis=1)
            updated = medoids.copy()
            for label in range(k):
                members = np.flatnonzero(nearest == label)
                if len(members):
                    updated[label] = members[np.argmin(distance[np.ix_(members, members)].sum(axis=1))]
            if np.array_equal(updated, medoids):
                break
            medoids = updated
        cost = float((distance[:, medoids].min(axis=1) ** 2).sum())
        if cost < best[0]:
            best = cost, medoids
    centers = candidates[best[1]]
    return centers, float((cdist(points, centers).min(axis=1) ** 2).sum())


def _spread_start(points: NDArray, k: int, rng: np.random.Generator) -> NDArray[np.intp]:
    """k different points of [N, 2], drawn one by one in proportion to the squared distance to those before."""
    chosen = [int(rng.integers(len(points)))]
    weight = np.full(len(points), np.inf)
    while len(chosen) < k:
        weight = np.minimum(weight, cdist(points, points[chosen[-1:]], "sqeuclidean")[:, 0])
        chosen.append(int(rng.choice(len(points), p=weight / weight.sum())))
    return np.array(chosen)


def _by_nearest_center(p_WQ: NDArray, centers: NDArray) -> Clustering:
    labels = np.argmin(cdist(p_WQ, centers), axis=1)
    used, labels = np.unique(labels, return_inverse=True)
    return Clustering(centers=np.asarray(centers, float)[used], labels=labels)
