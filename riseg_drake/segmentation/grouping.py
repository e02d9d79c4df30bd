"""Alg. 2, line 6: body frames with equal twists, by Mahalanobis distance and Markov clustering."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components

from riseg_drake.segmentation.twists import Twists


@dataclass
class GroupingParameters:
    """How twists become groups. The paper names the methods and no figures."""

    covariance: str = field(default="propagated", metadata={"choices": ("propagated", "sample")})
    """"propagated" (each pair of twists with their own covariances) or "sample" (one for all, as the
    paper's Mahalanobis distance is usually read)."""
    kernel_width: float = 2.5
    """Mahalanobis distance at which similarity falls to exp(-1/2)."""
    similarity_min: float = 1e-3
    """Weaker edges are cut."""
    inflation: float = 2.0
    """Markov clustering: the exponent that strengthens strong paths."""
    iterations: int = 60
    """Markov clustering: at most so many rounds."""
    members_min: int = 3
    """A group of fewer body frames is dropped."""


def mahalanobis_own(V: NDArray, covariance: NDArray) -> NDArray[np.float64]:
    """Distances [K, K] of twists [K, 6], each pair measured by the sum of its two covariances."""
    a, b = np.triu_indices(len(V), 1)
    difference = (V[a] - V[b])[..., None]
    squared = difference.swapaxes(1, 2) @ np.linalg.solve(covariance[a] + covariance[b], difference)
    distance = np.zeros((len(V), len(V)))
    distance[a, b] = distance[b, a] = np.sqrt(squared[:, 0, 0].clip(0))
    return distance


def mahalanobis_sample(V: NDArray) -> NDArray[np.float64]:
    """Distances [K, K] of twists [K, 6] by the covariance of the whole sample (pseudo-inverse)."""
    precision = np.linalg.pinv(np.atleast_2d(np.cov(V.T)), rcond=1e-9, hermitian=True)
    difference = V[:, None] - V[None]
    return np.sqrt(np.einsum("abi,ij,abj->ab", difference, precision, difference).clip(0))


def gaussian_similarity(distance: NDArray, width: float) -> NDArray[np.float64]:
    """exp(-d^2 / (2 width^2)) of Mahalanobis distances d [K, K]; d and width count standard deviations."""
    return np.exp(-0.5 * (distance / width) ** 2)


def markov_clusters(
    similarity: NDArray, inflation: float = 2.0, iterations: int = 60, prune: float = 1e-3
) -> NDArray[np.intp]:
    """Markov clustering (van Dongen 2000) of a weighted graph [K, K]: a label 0.. for each node.

    Expansion lets random walks spread, inflation favours the strong ones, until nothing changes. The
    similarity's diagonal is the self loop. Labels are numbered by their first node.
    """
    flow = _column_stochastic(similarity)
    for _ in range(iterations):
        inflated = (flow @ flow) ** inflation
        inflated[inflated < prune * inflated.max(axis=0)] = 0
        following = _column_stochastic(inflated)
        change = np.abs(following - flow).max()
        flow = following
        if change < 1e-2:
            break
    return _attractor_labels(flow)


def group_twists(twists: Twists, parameters: GroupingParameters) -> NDArray[np.intp]:
    """The group 0.. of each body frame [K]; -1 for those in groups too small to be believed.

    Raises ValueError for an unknown kind of covariance.
    """
    if parameters.covariance not in ("propagated", "sample"):
        raise ValueError(f"no covariance {parameters.covariance!r}: choose propagated or sample")
    K = len(twists.V_S)
    if parameters.members_min > K:
        return np.full(K, -1)
    if parameters.covariance == "propagated":
        distance = mahalanobis_own(twists.V_S, twists.covariance)
    else:
        distance = mahalanobis_sample(twists.V_S)
    similarity = gaussian_similarity(distance, parameters.kernel_width)
    similarity[similarity < parameters.similarity_min] = 0
    label = markov_clusters(similarity, parameters.inflation, parameters.iterations)
    return renumbered(label, parameters.members_min)


def renumbered(label: NDArray[np.intp], members_min: int) -> NDArray[np.intp]:
    """Labels [K] numbered from the largest group down; -1 for groups of fewer than `members_min`."""
    if not len(label):
        return label
    size = np.bincount(label[label >= 0], minlength=1)
    kept = np.flatnonzero(size >= members_min)
    kept = kept[np.argsort(-size[kept], kind="stable")]
    number = np.full(len(size), -1)
    number[kept] = np.arange(len(kept))
    return np.where(label >= 0, number[label], -1)


def _column_stochastic(matrix: NDArray) -> NDArray[np.float64]:
    return matrix / matrix.sum(axis=0, keepdims=True).clip(1e-300)


def _attractor_labels(flow: NDArray) -> NDArray[np.intp]:
    """Each column's flow ends in attractors; columns that share one belong together."""

    _, label = connected_components(csr_matrix(flow > 1e-3), directed=False)
    _, first, label = np.unique(label, return_index=True, return_inverse=True)
    return np.argsort(np.argsort(first))[label]
