import numpy as np

from riseg_drake.pictures.panels import panels
from riseg_drake.pictures.similarity import plot_similarity, show_similarity_graph

SIMILARITY = np.array([[1.0, 0.0, 0.8], [0.0, 1.0, 0.001], [0.8, 0.001, 1.0]])
GROUP = np.array([0, 1, 0])


def test_only_what_is_alike_is_joined_by_an_edge():
    _, (axes,) = panels([""])
    pixel = np.array([[5, 6], [10, 20], [15, 40]])
    show_similarity_graph(axes, np.zeros((48, 64, 3), np.uint8), pixel, SIMILARITY, GROUP)
    (edge,) = axes.collections[0].get_segments()
    np.testing.assert_array_equal(edge, [[6, 5], [40, 15]])


def test_the_matrix_is_sorted_by_group_with_those_of_none_last():
    _, (axes,) = panels([""])
    plot_similarity(axes, SIMILARITY, np.array([-1, 1, 0]))
    np.testing.assert_array_equal(axes.images[0].get_array(), SIMILARITY[np.ix_([2, 1, 0], [2, 1, 0])])
