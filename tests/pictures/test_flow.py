import numpy as np
from matplotlib.quiver import Quiver

from riseg_drake.pictures.color_vision import oklab_from_srgb
from riseg_drake.pictures.flow import flow_colors, show_flow
from riseg_drake.pictures.panels import panels

AROUND = np.stack([np.cos(phi := np.linspace(0, 2 * np.pi, 16, endpoint=False)), np.sin(phi)], axis=-1)


def test_no_flow_is_white_and_unknown_flow_is_gray():
    colors = flow_colors(np.array([[[0.0, 0.0], [np.nan, np.nan]]]), 5.0)
    np.testing.assert_array_equal(colors[0, 0], 255)
    assert len(set(colors[0, 1])) == 1
    assert colors[0, 1, 0] < 250


def test_no_direction_looks_stronger_than_another():
    lightness = oklab_from_srgb(flow_colors(3 * AROUND[None], 5.0) / 255)[..., 0]
    assert np.ptp(lightness) < 0.01


def test_opposite_directions_have_opposite_hues():
    ab = oklab_from_srgb(flow_colors(5 * AROUND[None], 5.0) / 255)[0, :, 1:]
    np.testing.assert_allclose(ab[:8], -ab[8:], atol=0.02)


def test_longer_flow_has_more_colour_up_to_the_longest():
    lengths = np.array([1.0, 2.0, 4.0, 5.0, 50.0])
    ab = oklab_from_srgb(flow_colors((lengths[:, None] * AROUND[3])[None], 5.0) / 255)[0, :, 1:]
    chroma = np.linalg.norm(ab, axis=1)
    assert (np.diff(chroma[:4]) > 0.01).all()
    assert chroma[3] == chroma[4]


def test_the_longest_arrow_is_as_long_as_arrows_are_apart_and_unknown_flow_has_none():
    flow = np.full((96, 128, 2), (3.0, 4.0))
    flow[:, 64:] = np.nan
    _, (axes,) = panels([""])
    show_flow(axes, flow, longest=5.0, arrow=32)
    (arrows,) = (child for child in axes.get_children() if isinstance(child, Quiver))
    assert len(arrows.U) == 3 * 2
    np.testing.assert_allclose(np.hypot(arrows.U, arrows.V), 32)
