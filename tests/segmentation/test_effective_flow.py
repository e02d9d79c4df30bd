"""X_t = O_t - E_t: nothing where only the camera moves, the body where a body moves."""

from dataclasses import replace

import numpy as np
import pytest

from riseg_drake.segmentation.effective_flow import MovingParameters, effective_flow, moving_pixels
from riseg_drake.segmentation.expected_flow import expected_flow
from riseg_drake.segmentation.noise import MeasurementNoise
from riseg_drake.segmentation.optical_flow import DisFlow
from tests.segmentation.drawn_scene import (
    CAMERA,
    Blank,
    DrawnScene,
    Texture,
    flow_of_bodies,
    looking_down,
    motion_seen_from,
    planar,
    standing,
)

SIZES = [(0.07, 0.06, 0.03), (0.06, 0.08, 0.05)]
PLACES = [planar(-0.06, 0.0, 0.3), planar(0.06, 0.02)]
SHIFTED = [planar(-0.06, 0.004, 0.3), PLACES[1]]
CAMERAS = (looking_down(), looking_down(x=0.006, y=-0.004, z=0.447))
ERODED = (slice(12, -12), slice(12, -12))


def moving(pair, label_0, o_t=None) -> np.ndarray:
    """||X_t|| >> 0 with the flow of dense inverse search, or with any other."""
    e_t = expected_flow(pair.reference.depth, pair.X_C1C0, CAMERA)
    o_t = DisFlow()(pair.reference.color, pair.current.color) if o_t is None else o_t
    return moving_pixels(
        pair, e_t, o_t, standing(pair.reference, label_0 > 0), MeasurementNoise(), MovingParameters()
    )


def test_the_true_flow_of_a_still_scene_is_all_expected() -> None:
    pair, label_0, _ = DrawnScene(SIZES).pair(CAMERAS, (PLACES, PLACES))
    o_t = flow_of_bodies(pair, label_0, {})
    x_t = effective_flow(o_t, expected_flow(pair.reference.depth, pair.X_C1C0, CAMERA))
    np.testing.assert_allclose(x_t, 0, atol=1e-3)
    assert np.median(np.linalg.norm(o_t, axis=-1)) > 2


def test_over_a_textured_still_scene_the_flow_seen_is_the_flow_expected() -> None:
    scene = DrawnScene(SIZES, table=Texture(7))
    pair, _, _ = scene.pair(CAMERAS, (PLACES, PLACES), np.random.default_rng(0))
    o_t = DisFlow()(pair.reference.color, pair.current.color)
    x_t = effective_flow(o_t, expected_flow(pair.reference.depth, pair.X_C1C0, CAMERA))
    assert np.median(np.linalg.norm(x_t[ERODED], axis=-1)) < 0.3


def test_there_is_no_effective_flow_where_there_is_no_depth() -> None:
    pair, label_0, _ = DrawnScene(SIZES).pair(CAMERAS, (PLACES, PLACES))
    pair.reference.depth[label_0 == 1] = 0
    e_t = expected_flow(pair.reference.depth, pair.X_C1C0, CAMERA)
    assert np.isnan(effective_flow(np.zeros_like(e_t), e_t)[label_0 == 1]).all()
    assert not moving(pair, label_0)[label_0 == 1].any()


@pytest.mark.parametrize("table", [Texture(7), Blank()], ids=["textured table", "white table"])
@pytest.mark.parametrize("seed", range(3))
def test_nothing_moves_where_only_the_camera_does(table, seed: int) -> None:
    scene = DrawnScene(SIZES, table=table)
    pair, label_0, _ = scene.pair(CAMERAS, (PLACES, PLACES), np.random.default_rng(seed))
    assert not moving(pair, label_0).any()


def test_a_blank_body_that_stands_still_does_not_move() -> None:
    scene = DrawnScene(SIZES, textures=[Blank(180), Blank(200)])
    pair, label_0, _ = scene.pair(CAMERAS, (PLACES, PLACES), np.random.default_rng(3))
    assert np.mean(moving(pair, label_0)[label_0 > 0]) < 0.02


@pytest.mark.parametrize("cameras", [CAMERAS[:1] * 2, CAMERAS], ids=["camera still", "camera moving"])
def test_where_a_body_moves_its_pixels_do_and_no_others(cameras) -> None:
    scene = DrawnScene(SIZES)
    pair, label_0, _ = scene.pair(cameras, (PLACES, SHIFTED), np.random.default_rng(4))
    found = moving(pair, label_0)
    assert np.mean(found[label_0 == 1]) > 0.7
    assert np.mean(found[label_0 == 2]) < 0.03
    assert not found[label_0 == 0].any()


def test_flow_invented_where_the_images_disagree_is_not_believed() -> None:
    pair, label_0, _ = DrawnScene(SIZES).pair(CAMERAS, (PLACES, PLACES), np.random.default_rng(5))
    invented = flow_of_bodies(pair, label_0, {}) + np.float32([3.0, -2.0])
    assert not moving(pair, label_0, invented).any()


def test_with_the_true_flow_the_body_is_found_nearly_whole() -> None:
    pair, label_0, _ = DrawnScene(SIZES).pair(CAMERAS, (PLACES, SHIFTED))
    X = motion_seen_from(CAMERAS[0], PLACES[0], SHIFTED[0])
    found = moving(pair, label_0, flow_of_bodies(pair, label_0, {1: X}))
    assert np.mean(found[label_0 == 1]) > 0.9
    assert not found[label_0 != 1].any()


def test_a_mask_without_a_pixel_has_none_that_moves() -> None:
    pair, label_0, _ = DrawnScene(SIZES).pair(CAMERAS, (PLACES, SHIFTED))
    assert not moving(pair, np.zeros_like(label_0)).any()


def test_what_the_robot_comes_to_hide_does_not_move() -> None:
    scene = DrawnScene(SIZES)
    pair, label_0, _ = scene.pair(CAMERAS, (PLACES, PLACES), np.random.default_rng(6))
    robot = np.zeros(CAMERA.shape, bool)
    robot[:, :120] = True
    current, _ = scene.frame(1, CAMERAS[1], PLACES, np.random.default_rng(7), robot)
    assert np.any(robot & (label_0 == 1))
    assert not moving(replace(pair, current=current), label_0).any()
