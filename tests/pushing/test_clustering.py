import itertools

import numpy as np
import pytest
from scipy.spatial.distance import cdist
from threadpoolctl import threadpool_limits

from riseg_drake.pushing.clustering import METHODS, ClusteringParameters, _k_medoids, clusterings, elbow

MEDOIDS = np.array([[5.0, 1], [17, 15], [9, 11], [27, 6], [26, 28], [12, 17], [4, 8], [18, 1], [23, 4]])
"""Nine points with four pairs of medoids that stay, and of which the best depends on what is summed."""
PLACES = np.array([[0.4, -0.1], [0.6, -0.1], [0.4, 0.1], [0.6, 0.1], [0.5, 0.0], [0.7, 0.0]])


def blobs(k, rng, radius=0.02, points=400):
    """Discs of points around the first k places."""
    r, angle = radius * np.sqrt(rng.random((k, points))), 2 * np.pi * rng.random((k, points))
    offset = np.stack([r * np.cos(angle), r * np.sin(angle)], axis=-1)
    return (PLACES[:k, None] + offset).reshape(-1, 2)


@pytest.mark.parametrize("method", ["k-means", "k-medoids"])
@pytest.mark.parametrize("k", [1, 2, 3, 4, 5, 6])
def test_elbow_finds_the_number_of_drawn_blobs(k, method):
    rng = np.random.default_rng(0)
    clustering = next(clusterings(blobs(k, rng), ClusteringParameters(method=method), rng))
    assert len(clustering.centers) == k


@pytest.mark.parametrize("method", METHODS)
def test_each_method_puts_a_center_into_each_blob(method):
    rng = np.random.default_rng(0)
    clustering = next(clusterings(blobs(4, rng), ClusteringParameters(method=method), rng))
    distance = np.linalg.norm(PLACES[:4, None] - clustering.centers, axis=-1)
    assert distance.shape == (4, 4)
    assert (distance.min(axis=1) < 0.005).all()
    assert (np.bincount(clustering.labels) == 400).all()


def test_medoids_are_points_themselves():
    rng = np.random.default_rng(0)
    points = blobs(3, rng)
    centers = next(clusterings(points, ClusteringParameters(method="k-medoids"), rng)).centers
    assert all((points == center).all(axis=1).any() for center in centers)


def test_further_clusterings_are_ever_finer():
    rng = np.random.default_rng(0)
    k = [len(c.centers) for c in clusterings(blobs(2, rng), ClusteringParameters(finer=3), rng)]
    assert k == [2, 3, 4, 5]


def test_curve_without_a_bend_is_one_cluster():
    assert elbow(1.0 / np.arange(1, 9), 0.25) == 1


@pytest.mark.parametrize("method", METHODS)
def test_same_seed_gives_the_same_clusters(method):
    points = blobs(5, np.random.default_rng(0), points=900)
    first, second = (
        next(clusterings(points, ClusteringParameters(method=method), np.random.default_rng(3)))
        for _ in range(2)
    )
    assert np.array_equal(first.centers, second.centers)
    assert np.array_equal(first.labels, second.labels)


def test_single_point_is_a_cluster():
    (clustering,) = clusterings(np.zeros((1, 2)), ClusteringParameters(), np.random.default_rng(0))
    assert clustering.centers.tolist() == [[0.0, 0.0]]


def test_unknown_method_is_an_error_that_names_the_known_ones():
    with pytest.raises(ValueError, match="k-medoids"):
        next(clusterings(np.zeros((1, 2)), ClusteringParameters(method="x"), np.random.default_rng(0)))


def test_the_clusters_are_the_same_to_the_last_bit_whatever_the_number_of_threads():
    points = blobs(5, np.random.default_rng(0))
    answers = []
    for threads in (1, 2):
        with threadpool_limits(threads):
            rng = np.random.default_rng(1)
            answers.append([c.centers for c in clusterings(points, ClusteringParameters(), rng)])
    for one, two in zip(*answers, strict=True):
        np.testing.assert_array_equal(one, two)


def test_of_two_medoids_those_with_the_smallest_sum_of_squares_are_taken_and_it_is_told():
    """Against all pairs of points that are the middles of their own clusters (Park and Jun 2009)."""
    points = MEDOIDS
    distance = cdist(points, points)
    stable = []
    for pair in itertools.combinations(range(len(points)), 2):
        nearest = distance[:, pair].argmin(1)
        middles = [
            np.flatnonzero(nearest == k)[distance[np.ix_(nearest == k, nearest == k)].sum(1).argmin()]
            for k in range(2)
        ]
        if middles == list(pair):
            stable.append(pair)
    best = [min(stable, key=lambda pair: (distance[:, pair].min(1) ** power).sum()) for power in (1, 2, 3, 4)]
    assert len(set(best)) > 2  # other powers would choose others
    assert best[1] not in (best[0], best[2], best[3])
    centers, inertia = _k_medoids(points, 2, 60, np.random.default_rng(0))
    np.testing.assert_array_equal(np.sort(centers, axis=0), np.sort(points[list(best[1])], axis=0))
    assert inertia == pytest.approx((distance[:, best[1]].min(1) ** 2).sum())
