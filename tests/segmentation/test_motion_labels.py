"""Given the bodies' motions, each pixel finds its own: on rendered bodies, and on blank drawn ones."""

import numpy as np
import pytest

from riseg_drake.geometry.camera import rays
from riseg_drake.geometry.rgbd import FramePair
from riseg_drake.segmentation.above_table import AboveTableParameters, objects_above_table
from riseg_drake.segmentation.bfif import BFIFParameters
from riseg_drake.segmentation.expected_flow import expected_flow
from riseg_drake.segmentation.optical_flow import DisFlow
from riseg_drake.segmentation.segment import SegmentParameters, nothing_segmented, segment
from tests.segmentation.algorithm import stand_in_groups
from tests.segmentation.drawn_scene import (
    DrawnScene,
    Texture,
    intersection_over_union,
    looking_down,
    motion_seen_from,
    planar,
)


def labelled(pair: FramePair, label_0: np.ndarray, motions: dict[int, np.ndarray]) -> np.ndarray:
    """The mask at t, where nothing is known but which motions there are."""
    above_0, above_1 = (objects_above_table(f, AboveTableParameters()) for f in (pair.reference, pair.current))
    e_t = expected_flow(pair.reference.depth, pair.X_C1C0, pair.current.intrinsics)
    o_t = DisFlow()(pair.reference.color, pair.current.color)
    groups = stand_in_groups(label_0, pair.reference.depth, rays(pair.reference.intrinsics), motions)
    start = nothing_segmented(label_0.shape)
    return segment(start, pair, e_t, o_t, groups, above_0, above_1, SegmentParameters(), BFIFParameters()).mask


def best_overlaps(mask: np.ndarray, truth: np.ndarray, bodies: list[int]) -> list[float]:
    """For each body the overlap (IoU) of the label that has most of its pixels."""
    out = []
    for body in bodies:
        values, counts = np.unique(mask[truth == body], return_counts=True)
        most = values[counts.argmax()]
        out.append(intersection_over_union(mask == most, truth == body) if most else 0.0)
    return out


@pytest.mark.renders
def test_each_of_two_moving_bodies_is_found_whole_and_the_still_one_is_not(two_move) -> None:
    mask = labelled(two_move.pair, two_move.label_0, two_move.motion_C0)
    assert min(best_overlaps(mask, two_move.label_1, [1, 2])) > 0.9
    assert np.mean(mask[two_move.label_1 == 3] == 0) > 0.97
    assert len(np.unique(mask)) == 3


@pytest.mark.renders
def test_one_moving_body_takes_nothing_of_the_bodies_that_touch_it(one_moves) -> None:
    mask = labelled(one_moves.pair, one_moves.label_0, one_moves.motion_C0)
    assert best_overlaps(mask, one_moves.label_1, [2])[0] > 0.9
    assert np.mean(mask[np.isin(one_moves.label_1, [1, 3])] == 0) > 0.97


SIZES = [(0.08, 0.08, 0.03), (0.05, 0.08, 0.05)]
PLACES = [planar(-0.06, 0.0), planar(0.05, 0.0)]
SHIFTED = [planar(-0.06, 0.005), planar(0.054, 0.0)]


def drawn(textures, seed: int = 0):
    cameras = (looking_down(), looking_down(0.004, -0.003))
    scene = DrawnScene(SIZES, textures=textures)
    pair, label_0, label_1 = scene.pair(cameras, (PLACES, SHIFTED), np.random.default_rng(seed))
    motions = {n: motion_seen_from(cameras[0], PLACES[n - 1], SHIFTED[n - 1]) for n in (1, 2)}
    return pair, label_0, label_1, motions


def test_drawn_bodies_are_found_at_their_true_outlines() -> None:
    pair, label_0, label_1, motions = drawn([Texture(1), Texture(2)])
    mask = labelled(pair, label_0, motions)
    assert min(best_overlaps(mask, label_1, [1, 2])) > 0.9


@pytest.mark.renders
def test_a_blank_body_is_not_shared_out_among_motions(blank_moves) -> None:
    mask = labelled(blank_moves.pair, blank_moves.label_0, blank_moves.motion_C0)
    assert best_overlaps(mask, blank_moves.label_1, [1])[0] > 0.9
    values, counts = np.unique(mask[blank_moves.label_1 == 2], return_counts=True)
    assert counts.max() > 0.9 * counts.sum()
    assert values[counts.argmax()] != np.bincount(mask[blank_moves.label_1 == 1]).argmax()


@pytest.mark.renders
def test_motions_that_hardly_differ_from_its_own_take_nothing_of_a_blank_body(blank_moves) -> None:
    X = blank_moves.motion_C0[2]
    # By half a pixel to each side.
    beside, seeds = {}, blank_moves.label_0.copy()
    for n, step in enumerate([(3e-4, 0.0), (-3e-4, 0.0), (0.0, 3e-4), (0.0, -3e-4)], 4):
        beside[n] = np.array(X)
        beside[n][:2, 3] += step
        seeds[:10, 20 * n : 20 * n + 10] = n
    mask = labelled(blank_moves.pair, seeds, blank_moves.motion_C0 | beside)
    counts = np.unique(mask[blank_moves.label_1 == 2], return_counts=True)[1]
    assert counts.max() > 0.9 * counts.sum()


def test_where_nothing_stands_nothing_is_labelled() -> None:
    scene = DrawnScene([])
    pair, label_0, _ = scene.pair((looking_down(),) * 2, ([], []), np.random.default_rng(0))
    label_0[100:110, 100:110] = 1
    mask = labelled(pair, label_0, {1: motion_seen_from(looking_down(), PLACES[0], SHIFTED[0])})
    assert not mask.any()
