import numpy as np
import pytest
from matplotlib.collections import LineCollection, PathCollection
from matplotlib.patches import Ellipse

from riseg_drake.pictures.panels import panels
from riseg_drake.pictures.twists import plot_twist_ellipses, plot_twists

V_S = np.array([[0, 0, np.pi / 180, 0.002, 0, 0], [0, 0, 0, 0, -0.003, 0.0]])
GROUP = np.array([1, 0])


def test_twists_are_shown_in_degrees_and_millimetres_sorted_by_group():
    _, (axes,) = panels([""])
    plot_twists(axes, V_S, GROUP)
    dots = [c.get_offsets()[:, 1] for c in axes.collections if isinstance(c, PathCollection)]
    np.testing.assert_allclose(dots, [[0, 0], [0, 0], [0, 1], [0, 2], [-3, 0], [0, 0]], atol=1e-12)


def test_bars_are_one_standard_deviation_each_way():
    _, (axes,) = panels([""])
    plot_twists(axes, V_S, GROUP, np.broadcast_to(np.diag([1, 1, 1, 4, 4, 4]) * 1e-6, (2, 6, 6)))
    bars = [c.get_segments() for c in axes.collections if isinstance(c, LineCollection)]
    lengths = [np.ptp(segment[:, 1]) for component in bars for segment in component]
    np.testing.assert_allclose(lengths[:2], 2 * np.degrees(1e-3))
    np.testing.assert_allclose(lengths[-2:], 2 * 2.0)


def test_an_ellipse_has_the_axes_of_its_covariance():
    turn = np.array([[np.cos(0.5), -np.sin(0.5)], [np.sin(0.5), np.cos(0.5)]])
    covariance = np.zeros((2, 6, 6))
    covariance[:, 3:5, 3:5] = turn @ np.diag([1e-6, 9e-6]) @ turn.T
    _, (axes,) = panels([""])
    plot_twist_ellipses(axes, V_S, GROUP, covariance, (3, 4))
    first, second = (patch for patch in axes.patches if isinstance(patch, Ellipse))
    np.testing.assert_allclose([first.width, first.height], [2, 6])
    assert first.angle % 180 == pytest.approx(np.degrees(0.5))
    np.testing.assert_allclose([first.center, second.center], [[2, 0], [0, -3]])
