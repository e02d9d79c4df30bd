import numpy as np
from matplotlib.quiver import Quiver
from pydrake.geometry import Meshcat

from riseg_drake.geometry.se3 import translation
from riseg_drake.pictures.moving_frames import plot_moving_frames, set_triad
from riseg_drake.pictures.panels import panels


def test_an_arrow_leads_from_each_frame_to_where_it_is_afterwards():
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    before, after = translation(np.array([[0.2, 0.3, 0.0]])), translation(np.array([[0.5, 0.1, 0.0]]))
    _, (axes,) = panels([""])
    plot_moving_frames(axes, corners, corners + np.array([0.3, -0.2]), before, after, "#e69f00")
    (arrows,) = (child for child in axes.get_children() if isinstance(child, Quiver))
    np.testing.assert_allclose([arrows.X, arrows.Y, arrows.U, arrows.V], [[0.2], [0.3], [0.3], [-0.2]])
    assert len(axes.lines) == 2 * 3


def test_a_triad_has_three_rods_below_its_path():
    meshcat = Meshcat()
    set_triad(meshcat, "body/frame", np.eye(4), 0.02)
    assert all(meshcat.HasPath(f"body/frame/{axis}") for axis in "xyz")
