"""A pair whose motions explain nothing is noticed, and given up."""

import numpy as np
import pytest

from riseg_drake.geometry.rgbd import FramePair
from riseg_drake.segmentation.bfif import BFIFParameters, group_body_frames
from riseg_drake.segmentation.expected_flow import expected_flow
from riseg_drake.segmentation.explained import explained_share
from riseg_drake.segmentation.frame_pairs import FramePairParameters, next_pair
from riseg_drake.segmentation.noise import MeasurementNoise
from tests.segmentation.drawn_scene import (
    CAMERA,
    DrawnScene,
    Texture,
    looking_down,
    motion_seen_from,
    planar,
    standing,
)

SIZES = [(0.12, 0.10, 0.04), (0.05, 0.03, 0.04)]
PLACES = [planar(-0.05, 0.0), planar(0.08, 0.0)]
GONE = planar(0.08, 0.003)
HERE = looking_down()


def pair_of(scene: DrawnScene, after: DrawnScene, places_1: list[np.ndarray]):
    rng = np.random.default_rng(0)
    (frame_0, label_0), (frame_1, _) = scene.frame(0, HERE, PLACES, rng), after.frame(1, HERE, places_1, rng)
    return FramePair(frame_0, frame_1), label_0


def share(pair: FramePair, label_0: np.ndarray, motions: list[np.ndarray]) -> float:
    above_0 = standing(pair.reference, label_0 > 0)
    return explained_share(pair, np.array(motions).reshape(-1, 4, 4), above_0, 100.0, MeasurementNoise())


def test_the_true_motion_explains_all_that_moved_and_another_one_little() -> None:
    scene = DrawnScene(SIZES)
    pair, label_0 = pair_of(scene, scene, [PLACES[0], GONE])
    true = motion_seen_from(HERE, PLACES[1], GONE)
    other = motion_seen_from(HERE, PLACES[1], planar(0.084, -0.002))
    assert share(pair, label_0, [true]) > 0.9
    assert share(pair, label_0, [other, true]) == pytest.approx(share(pair, label_0, [true]), abs=0.05)
    assert share(pair, label_0, [other]) < 0.4
    assert share(pair, label_0, []) == 0


def test_where_nothing_moved_nothing_is_left_to_explain() -> None:
    scene = DrawnScene(SIZES)
    pair, label_0 = pair_of(scene, scene, PLACES)
    assert share(pair, label_0, []) == 1


@pytest.mark.parametrize("lost", [False, True])
def test_where_the_groups_explain_nothing_the_reference_is_renewed(lost: bool) -> None:
    """Flow says 3 mm for both. The small box went so far; the large one stood still, or jumped out of reach."""
    scene = DrawnScene(SIZES)
    jumped = DrawnScene(SIZES, textures=[Texture(7), scene.textures[1]]) if lost else scene
    pair, label_0 = pair_of(scene, jumped, [PLACES[0], GONE])
    still = expected_flow(pair.reference.depth, pair.X_C1C0, CAMERA)
    shift = np.float32(0.003 * CAMERA.fy / (HERE[2, 3] - 0.04)) * np.array([0, -1], np.float32)
    above_0 = standing(pair.reference, label_0 > 0)
    rng = np.random.default_rng(0)
    groups = group_body_frames(pair, still, still + shift, above_0, BFIFParameters(), rng)
    assert len(groups) == (0 if lost else 1)
    after = next_pair(pair, scene.frame(2, HERE, PLACES)[0], groups.flow_span, FramePairParameters())
    assert after.reference is (pair.current if lost else pair.reference)
