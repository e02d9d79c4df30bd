"""Mahalanobis distance and Markov clustering, against graphs worked by hand."""

import numpy as np
import pytest

from riseg_drake.segmentation.grouping import (
    GroupingParameters,
    gaussian_similarity,
    group_twists,
    mahalanobis_own,
    mahalanobis_sample,
    markov_clusters,
    renumbered,
)
from riseg_drake.segmentation.twists import Twists, change_space_frame


def graph(size: int, *edges: tuple[int, int]) -> np.ndarray:
    """Adjacency with self loops."""
    matrix = np.eye(size)
    for a, b in edges:
        matrix[a, b] = matrix[b, a] = 1.0
    return matrix


def test_nodes_without_edges_are_clusters_of_their_own() -> None:
    np.testing.assert_array_equal(markov_clusters(graph(3)), [0, 1, 2])


def test_a_complete_graph_is_one_cluster() -> None:
    np.testing.assert_array_equal(markov_clusters(np.ones((5, 5))), np.zeros(5))


def test_two_triangles_joined_by_one_edge_are_two_clusters() -> None:
    joined = graph(6, (0, 1), (1, 2), (0, 2), (3, 4), (4, 5), (3, 5), (2, 3))
    np.testing.assert_array_equal(markov_clusters(joined), [0, 0, 0, 1, 1, 1])


def test_a_single_step_of_expansion_and_inflation_is_as_worked_by_hand() -> None:
    # Path 0-1-2 with self loops: columns (1/2,1/2,0), (1/3,1/3,1/3), (0,1/2,1/2). Squared, column 0 is
    # (5/12, 5/12, 1/6); inflated by 2 and normalised (25, 25, 4) / 54. The middle wins in the end.
    np.testing.assert_array_equal(markov_clusters(graph(3, (0, 1), (1, 2))), [0, 0, 0])


def test_more_inflation_cuts_finer() -> None:
    chain = graph(12, *((i, i + 1) for i in range(11)))
    coarse, fine = (markov_clusters(chain, inflation=r).max() for r in (1.3, 4.0))
    assert fine > coarse


def test_renaming_nodes_renames_clusters_only() -> None:
    rng = np.random.default_rng(0)
    joined = graph(6, (0, 1), (1, 2), (0, 2), (3, 4), (4, 5), (3, 5), (2, 3))
    order = rng.permutation(6)
    label = markov_clusters(joined)[order]
    shuffled = markov_clusters(joined[np.ix_(order, order)])
    assert all((label == label[k]).tolist() == (shuffled == shuffled[k]).tolist() for k in range(6))


def test_own_covariances_measure_each_pair_by_the_sum() -> None:
    V = np.zeros((2, 6))
    V[1, 3] = 3.0
    covariance = np.stack([np.eye(6) * 4, np.eye(6) * 5])
    np.testing.assert_allclose(mahalanobis_own(V, covariance), [[0, 1], [1, 0]])


def test_sample_covariance_makes_distances_free_of_units() -> None:
    V = np.random.default_rng(1).normal(size=(40, 6))
    scaled = V * [1, 10, 100, 0.1, 1, 5]
    np.testing.assert_allclose(mahalanobis_sample(V), mahalanobis_sample(scaled), rtol=1e-6)


def test_distances_are_the_same_in_every_space_frame() -> None:
    rng = np.random.default_rng(3)
    V, A = rng.normal(size=(12, 6)), rng.normal(size=(12, 6, 6))
    covariance = A @ A.swapaxes(1, 2)
    V_elsewhere, covariance_elsewhere = change_space_frame(V, covariance, np.array([0.4, -0.3, 0.6]))
    own = mahalanobis_own(V_elsewhere, covariance_elsewhere)
    np.testing.assert_allclose(own, mahalanobis_own(V, covariance), rtol=1e-6)
    np.testing.assert_allclose(mahalanobis_sample(V_elsewhere), mahalanobis_sample(V), rtol=1e-6)


def test_similarity_at_the_kernel_width_is_exp_minus_a_half() -> None:
    np.testing.assert_allclose(gaussian_similarity(np.array([0.0, 2.0]), 2.0), [1, np.exp(-0.5)])


def test_twists_of_two_bodies_fall_into_two_groups_and_a_stray_one_into_none() -> None:
    rng = np.random.default_rng(2)
    V = np.repeat([[0, 0, 0, 0.01, 0, 0], [0, 0, 0.1, 0, 0.01, 0]], [20, 12], axis=0)
    V = np.concatenate([V, [[0.5, 0, 0, 0, 0, 0.3]]]) + rng.normal(size=(33, 6)) * 1e-3
    twists = Twists(V, np.tile(np.eye(6) * 1e-6, (33, 1, 1)), np.zeros(3), np.ones(33))
    np.testing.assert_array_equal(group_twists(twists, GroupingParameters()), [0] * 20 + [1] * 12 + [-1])


def test_groups_are_numbered_from_the_largest_down() -> None:
    np.testing.assert_array_equal(renumbered(np.array([5, 5, 2, 2, 2, 0, -1]), 2), [1, 1, 0, 0, 0, -1, -1])


def test_an_unknown_covariance_is_refused_with_the_choices() -> None:
    twists = Twists(np.zeros((4, 6)), np.tile(np.eye(6), (4, 1, 1)), np.zeros(3), np.ones(4))
    with pytest.raises(ValueError, match="propagated or sample"):
        group_twists(twists, GroupingParameters(covariance="other"))
