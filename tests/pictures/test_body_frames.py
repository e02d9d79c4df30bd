import numpy as np
from matplotlib.collections import EllipseCollection

from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.pictures.body_frames import group_colors, show_body_frames, twist_flow
from riseg_drake.pictures.object_colors import hex_color
from riseg_drake.pictures.panels import panels

CAMERA = Intrinsics(64, 48, 60.0, 60.0, 31.5, 23.5)


def test_a_twist_along_x_moves_a_point_by_focal_length_over_depth():
    V_S = np.array([[0, 0, 0, 0.01, 0, 0]])
    flow = twist_flow(V_S, np.array([0.1, 0.2, 0.3]), np.array([[0.0, 0.0, 0.5]]), CAMERA)
    np.testing.assert_allclose(flow, [[60 * 0.01 / 0.5, 0]])


def test_a_turn_about_the_space_frame_moves_nothing_at_its_origin():
    p_C0S = np.array([0.05, 0.0, 0.5])
    V_S = np.array([[0, 0, 0.1, 0, 0, 0]] * 2)
    flow = twist_flow(V_S, p_C0S, np.array([p_C0S, p_C0S + np.array([0.1, 0, 0])]), CAMERA)
    np.testing.assert_allclose(flow[0], 0, atol=1e-9)
    np.testing.assert_allclose(flow[1], 120 * 0.1 * np.array([np.cos(0.1) - 1, np.sin(0.1)]), atol=1e-9)


def test_groups_have_the_colours_of_objects_counted_from_one_and_none_is_gray():
    colors = group_colors(np.array([0, 1, -1]))
    assert colors[:2] == [hex_color(1), hex_color(2)]
    assert len({colors[2][k : k + 2] for k in (1, 3, 5)}) == 1


def test_circles_stand_at_the_seeds_u_right_and_v_down():
    _, (axes,) = panels([""])
    pixel, group = np.array([[10, 40], [30, 5]]), np.array([0, -1])
    show_body_frames(axes, np.zeros((48, 64, 3), np.uint8), pixel, np.full(2, 6.0), group)
    (circles,) = (c for c in axes.collections if isinstance(c, EllipseCollection))
    np.testing.assert_array_equal(circles.get_offsets(), [[40, 10], [5, 30]])
    assert axes.get_ylim()[0] > axes.get_ylim()[1]


def test_no_body_frames_are_an_empty_picture():
    _, (axes,) = panels([""])
    nothing = np.empty((0, 2), int)
    show_body_frames(
        axes, np.zeros((48, 64, 3), np.uint8), nothing, np.empty(0), np.empty(0, int), np.empty((0, 2))
    )
