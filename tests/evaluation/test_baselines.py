import numpy as np
import pytest

from riseg_drake.evaluation import baselines
from riseg_drake.evaluation.baselines import BASELINES, BaselineParameters, depth_clusters, graph_segments
from riseg_drake.geometry.camera import Intrinsics

SHAPE = (120, 160)
INTRINSICS = Intrinsics(160, 120, 154.0, 154.0, 79.5, 59.5)
PARAMETERS = BaselineParameters()
LEFT, RIGHT = np.s_[30:90, 20:60], np.s_[30:90, 60:110]


def table_scene():
    """Colour, depth and above-table mask of a white table 0.5 m away with nothing on it."""
    return np.full((*SHAPE, 3), 240, np.uint8), np.full(SHAPE, 0.5, np.float32), np.zeros(SHAPE, bool)


def put(scene, where, color, height):
    image, depth, above = scene
    image[where], depth[where], above[where] = color, 0.5 - height, True


def test_a_depth_step_divides_what_touches():
    scene = table_scene()
    put(scene, LEFT, (200, 30, 30), 0.03)
    put(scene, RIGHT, (200, 30, 30), 0.05)
    labels = depth_clusters(*scene, INTRINSICS, PARAMETERS)
    assert set(np.unique(labels[LEFT])) == {2}
    assert set(np.unique(labels[RIGHT])) == {1}  # the larger one
    assert not labels[~scene[2]].any()


def test_depth_alone_takes_two_of_equal_height_for_one_and_colour_tells_them_apart():
    scene = table_scene()
    put(scene, LEFT, (200, 30, 30), 0.04)
    put(scene, RIGHT, (30, 30, 200), 0.04)
    assert set(np.unique(depth_clusters(*scene, INTRINSICS, PARAMETERS))) == {0, 1}
    labels = graph_segments(*scene, INTRINSICS, PARAMETERS)
    inner_left, inner_right = labels[32:88, 22:56], labels[32:88, 64:108]
    assert len(np.unique(inner_left)) == len(np.unique(inner_right)) == 1
    assert inner_left[0, 0] != inner_right[0, 0]


def test_a_depth_step_counts_in_the_graph_where_colours_are_equal():
    scene = table_scene()
    put(scene, LEFT, (200, 30, 30), 0.01)
    put(scene, RIGHT, (200, 30, 30), 0.12)
    labels = graph_segments(*scene, INTRINSICS, PARAMETERS)
    assert labels[60, 40] != labels[60, 85]


def test_noise_of_depth_does_not_cut():
    scene = table_scene()
    put(scene, LEFT, (200, 30, 30), 0.03)
    scene[1][LEFT] += np.random.default_rng(0).normal(0, 4e-4, (60, 40)).astype(np.float32)
    labels = depth_clusters(*scene, INTRINSICS, PARAMETERS)
    assert np.mean(labels[LEFT] == 1) > 0.99


@pytest.mark.parametrize("segment", BASELINES.values(), ids=BASELINES)
def test_an_empty_table_has_no_objects(segment):
    assert not segment(*table_scene(), INTRINSICS, PARAMETERS).any()


@pytest.mark.parametrize("segment", BASELINES.values(), ids=BASELINES)
def test_specks_and_pixels_without_depth_are_no_objects(segment):
    scene = table_scene()
    put(scene, LEFT, (200, 30, 30), 0.03)
    put(scene, np.s_[100:103, 100:103], (30, 30, 200), 0.03)
    scene[1][50:52, 30:32] = 0
    labels = segment(*scene, INTRINSICS, PARAMETERS)
    assert not labels[100:103, 100:103].any()
    assert not labels[50:52, 30:32].any()
    assert labels[40, 40] > 0


def test_the_graph_is_asked_in_metres_whatever_the_camera(monkeypatch):
    """Colour from 0 to 1, a metre of depth as 5; areas and lengths in pixels of what stands at its distance."""
    asked = []

    def segmented(image, **others):
        asked.append((image, others))
        return np.ones(image.shape[:2], int)

    monkeypatch.setattr(baselines, "felzenszwalb", segmented)
    scene = table_scene()
    put(scene, LEFT, (51, 102, 255), 0.1)
    scene[1][30, 20] = 0.41
    scene[1][31, 20] = 0  # no depth: as good as not there
    labels = graph_segments(*scene, Intrinsics(160, 120, 200.0, 128.0, 79.5, 59.5), PARAMETERS)
    ((image, others),) = asked
    per_m2 = 200 * 128 / 0.4**2  # 160 000 pixels a square metre, 400 x 400
    assert others == {
        "scale": pytest.approx(3e-4 * per_m2),
        "sigma": pytest.approx(0.001 * 400),
        "min_size": 64,
        "channel_axis": -1,
    }
    assert image.shape == (62, 42, 4)  # a pixel around
    np.testing.assert_allclose(image[1, 1], [0.2, 0.4, 1.0, 0.05], atol=1e-6)
    np.testing.assert_allclose(image[1, 2], [0.2, 0.4, 1.0, 0.0], atol=1e-6)
    for outside in (image[0, 0], image[-1, -1], image[2, 1]):
        np.testing.assert_array_equal(outside, [0, 0, 0, 10])
    expected = np.zeros(SHAPE, int)
    expected[LEFT] = 1
    expected[31, 20] = 0
    np.testing.assert_array_equal(labels, expected)
