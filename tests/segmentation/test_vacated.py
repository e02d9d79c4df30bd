"""What light does moves, but leaves no place: depth tells it from bodies, drawn ones."""

from dataclasses import replace

import numpy as np
import pytest

from riseg_drake.geometry.rgbd import Frame, FramePair
from riseg_drake.segmentation.above_table import AboveTableParameters, objects_above_table
from riseg_drake.segmentation.motion_labels import MotionLabelParameters, cut_pieces, label_by_motion
from riseg_drake.segmentation.noise import MeasurementNoise
from tests.segmentation.drawn_scene import (
    Blank,
    DrawnScene,
    Texture,
    looking_down,
    motion_seen_from,
    planar,
)

SIZES = [(0.1, 0.1, 0.03), (0.05, 0.08, 0.03)]
PLACES = [planar(-0.05, 0.0), planar(0.03, 0.0)]
STEP = 0.008
"""m to the right; about 5 pixels."""
SHIFT = motion_seen_from(looking_down(), planar(0, 0), planar(STEP, 0))
ANOTHER = motion_seen_from(looking_down(), planar(0, 0), planar(0, STEP))
BLANK = [Blank(90), Blank(160)]
PATTERNED = [Texture(1), Texture(2)]


def in_shadow(frame: Frame, u_edge: float) -> Frame:
    """Half as bright left of a soft edge."""
    u = np.arange(frame.color.shape[1])
    light = 0.5 + 0.5 / (1 + np.exp(-(u - u_edge) / 0.7))
    return replace(frame, color=np.rint(frame.color * light[:, None]).astype(np.uint8))


def moving(pair: FramePair, motions: list[np.ndarray]) -> np.ndarray:
    above_0 = objects_above_table(pair.reference, AboveTableParameters())
    parameters = MotionLabelParameters()
    nothing_known = np.zeros(above_0.mask.shape, np.uint16)
    pieces = cut_pieces(pair.reference, above_0, nothing_known, MeasurementNoise(), parameters)
    return label_by_motion(pair, pieces, np.array(motions), above_0.depth_noise, parameters)


@pytest.mark.parametrize("textures", [BLANK, PATTERNED], ids=["blank", "patterned"])
@pytest.mark.parametrize("u_edge", [90.0, 120.0, 150.0])
def test_a_shadow_that_wanders_over_still_bodies_moves_nothing(textures, u_edge) -> None:
    scene = DrawnScene(SIZES, textures)
    pair, label_0, _ = scene.pair((looking_down(),) * 2, (PLACES,) * 2, np.random.default_rng(0))
    pixels = STEP * scene.intrinsics.fx / 0.42
    pair = replace(
        pair, reference=in_shadow(pair.reference, u_edge), current=in_shadow(pair.current, u_edge + pixels)
    )
    label = moving(pair, [SHIFT])
    assert np.mean(label[label_0 > 0] > 0) < 0.02


@pytest.mark.parametrize("textures", [BLANK, PATTERNED], ids=["blank", "patterned"])
def test_a_body_that_moves_along_its_neighbour_of_equal_height_is_not_refuted(textures) -> None:
    scene = DrawnScene(SIZES, textures)
    away = [PLACES[0], planar(0.03, STEP)]
    pair, label_0, _ = scene.pair((looking_down(),) * 2, (PLACES, away), np.random.default_rng(0))
    label = moving(pair, [ANOTHER])
    assert np.mean(label[label_0 == 2] == 1) > 0.9
    assert np.mean(label[label_0 == 1] == 0) > 0.95


def test_a_shadow_s_motion_takes_nothing_of_a_body_that_moves_otherwise() -> None:
    scene = DrawnScene(SIZES, BLANK)
    moved = [planar(-0.05, STEP), PLACES[1]]
    pair, label_0, _ = scene.pair((looking_down(),) * 2, (PLACES, moved), np.random.default_rng(0))
    pixels = STEP * scene.intrinsics.fx / 0.42
    pair = replace(
        pair, reference=in_shadow(pair.reference, 120.0), current=in_shadow(pair.current, 120.0 + pixels)
    )
    label = moving(pair, [ANOTHER, SHIFT])
    assert np.mean(label[label_0 == 1] == 1) > 0.8
    assert not np.any(label == 2)
