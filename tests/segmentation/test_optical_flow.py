"""Dense inverse search against images that are shifted by a known amount."""

from dataclasses import replace

import numpy as np
import pytest

from riseg_drake.segmentation.expected_flow import expected_flow
from riseg_drake.segmentation.optical_flow import DIS_PRESETS, DisFlow, DisFlowParameters, flow_around
from tests.segmentation.drawn_scene import (
    CAMERA,
    DrawnScene,
    Texture,
    flow_of_bodies,
    looking_down,
    motion_seen_from,
    planar,
    standing,
)

HEIGHT, WIDTH = 120, 160
INTERIOR = (slice(16, -16), slice(16, -16))


def shifted(du: float, dv: float) -> np.ndarray:
    """A textured image [H, W, 3], moved by (du, dv) pixels."""
    v, u = np.mgrid[:HEIGHT, :WIDTH].astype(float)
    metres = np.stack([u - du, v - dv, np.zeros_like(u)], axis=-1).reshape(-1, 3) * 0.001
    color = Texture(seed=3).color(metres).reshape(HEIGHT, WIDTH, 3)
    return np.clip(np.rint(color), 0, 255).astype(np.uint8)


@pytest.mark.parametrize("preset", DIS_PRESETS)
@pytest.mark.parametrize("shift", [(0.0, 0.0), (0.5, -0.25), (2.3, 1.7)])
def test_a_shifted_texture_flows_by_its_shift(preset: str, shift: tuple[float, float]) -> None:
    flow = DisFlow(DisFlowParameters(preset=preset))(shifted(0, 0), shifted(*shift))
    assert flow.shape == (HEIGHT, WIDTH, 2)
    assert flow.dtype == np.float32
    error = np.linalg.norm(flow[INTERIOR] - np.float32(shift), axis=-1)
    assert np.median(error) < (0.15 if preset == "medium" else 0.4)


def test_the_same_images_give_the_same_flow_to_the_bit() -> None:
    method, images = DisFlow(), (shifted(0, 0), shifted(1.1, 0.4))
    first = method(*images)
    method(shifted(3.0, 0.0), shifted(0, 0))
    np.testing.assert_array_equal(method(*images), first)
    np.testing.assert_array_equal(DisFlow()(*images), first)


def test_an_unknown_preset_is_refused_with_the_choices() -> None:
    with pytest.raises(ValueError, match=r"'best'.*ultrafast, fast, medium"):
        DisFlow(DisFlowParameters(preset="best"))


@pytest.mark.parametrize("x", [0.0, 0.05])
def test_flow_around_objects_follows_a_camera_that_moves_far(x: float) -> None:
    scene = DrawnScene([(0.07, 0.06, 0.03), (0.06, 0.08, 0.05)])
    places = [planar(-0.06, 0.0, 0.3), planar(0.06, 0.02)]
    pair, label_0, _ = scene.pair((looking_down(), looking_down(x=x)), (places, places))
    flow = flow_around(standing(pair.reference, label_0 > 0), pair, DisFlow())
    assert flow.shape == (*label_0.shape, 2)
    known = (label_0 > 0) & np.isfinite(flow).all(-1)
    expected = expected_flow(pair.reference.depth, pair.X_C1C0, CAMERA)
    assert known.sum() > 0.9 * (label_0 > 0).sum()
    assert np.nanmedian(np.linalg.norm(flow - expected, axis=-1)[known]) < 0.3


@pytest.mark.parametrize("millimetres", [8, 16, 24])
def test_flow_follows_what_has_moved_as_far_as_the_pair_spans(millimetres: int) -> None:
    scene, here = DrawnScene([(0.07, 0.06, 0.03), (0.06, 0.08, 0.05)]), looking_down()
    before = [planar(-0.08, 0.02, 0.3), planar(0.05, 0.02)]
    after = [before[0], planar(0.05 + 0.001 * millimetres, 0.02)]
    pair, label_0, _ = scene.pair((here, here), (before, after))
    moved = label_0 == 2
    true = flow_of_bodies(pair, label_0, {2: motion_seen_from(here, before[1], after[1])})
    span = float(np.median(np.linalg.norm(true[moved], axis=-1)))
    # So far the frame before had come, of ten on the way.
    pair = replace(pair, span=0.9 * span)
    flow = flow_around(standing(pair.reference, label_0 > 0), pair, DisFlow())
    away = np.linalg.norm(flow - true, axis=-1)[moved]
    assert np.nanquantile(away, 0.8) < 0.5


def test_there_is_no_flow_where_nothing_stands() -> None:
    pair, label_0, _ = DrawnScene([(0.07, 0.06, 0.03)]).pair((looking_down(),) * 2, ([planar(0, 0)],) * 2)
    assert np.isnan(flow_around(standing(pair.reference, label_0 < 0), pair, DisFlow())).all()


def test_what_the_camera_has_left_behind_has_no_flow() -> None:
    scene, places = DrawnScene([(0.07, 0.06, 0.03)]), [planar(0, 0)]
    pair, label_0, _ = scene.pair((looking_down(), looking_down(x=0.5)), (places, places))
    assert np.isnan(flow_around(standing(pair.reference, label_0 > 0), pair, DisFlow())).all()


def test_of_a_corner_that_both_images_hardly_share_no_flow_is_asked() -> None:
    cameras = looking_down(), looking_down(x=0.016, y=-0.016)
    pair, label_0, _ = DrawnScene([]).pair(cameras, ([], []))
    corner = np.zeros(label_0.shape, bool)
    corner[:4, :4] = True
    # Eleven pixels up and to the left: three by three are left, which DIS refuses.
    assert np.isnan(flow_around(standing(pair.reference, corner), pair, DisFlow())).all()
