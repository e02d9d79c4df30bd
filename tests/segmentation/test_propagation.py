"""Labels carried from view to view, on boxes drawn with exact depth."""

import cv2
import numpy as np
import pytest

from riseg_drake.geometry.rgbd import FramePair
from riseg_drake.segmentation.propagation import UNKNOWN, carry_labels, draw_labels, nearest_label, pixels_of
from tests.segmentation.drawn_scene import (
    CAMERA,
    DrawnScene,
    intersection_over_union,
    looking_down,
    motion_seen_from,
    planar,
    standing,
)

SIZES = [(0.07, 0.06, 0.03), (0.06, 0.08, 0.05), (0.05, 0.05, 0.02)]
PLACES = [planar(-0.09, 0.0, 0.3), planar(0.02, 0.02), planar(0.1, -0.04, 0.7)]
NOTHING = np.zeros(CAMERA.shape, np.uint16)


def carried(pair: FramePair, label_0, motions, label_1, remembered=NOTHING) -> np.ndarray:
    return carry_labels(pair, label_0, motions, standing(pair.current, label_1 > 0), remembered)


def move(place: np.ndarray, x: float, y: float, yaw: float) -> np.ndarray:
    return planar(place[0, 3] + x, place[1, 3] + y, np.arctan2(place[1, 0], place[0, 0]) + yaw)


@pytest.mark.parametrize("seed", [None, 0], ids=["exact", "noisy"])
@pytest.mark.parametrize(
    "camera",
    [looking_down(), looking_down(0.03, -0.02), looking_down(z=0.4, tilt=0.1)],
    ids=["camera still", "camera shifted", "camera nearer and tilted"],
)
def test_labels_land_where_the_bodies_are(camera, seed) -> None:
    there = [move(PLACES[0], 0.006, 0.012, 0.1), PLACES[1], move(PLACES[2], 0.0, -0.01, -0.15)]
    rng = None if seed is None else np.random.default_rng(seed)
    pair, label_0, label_1 = DrawnScene(SIZES).pair((looking_down(), camera), (PLACES, there), rng)
    X_WC0 = pair.reference.X_WC
    motions = {n: motion_seen_from(X_WC0, PLACES[n - 1], there[n - 1]) for n in (1, 3)}
    out = carried(pair, label_0, motions, label_1)
    assert not out[label_1 == 0].any()
    for number in (1, 2, 3):
        assert intersection_over_union(out == number, label_1 == number) > 0.97


def test_labels_are_drawn_without_gaps_where_a_nearer_camera_measures_nothing() -> None:
    there = [move(PLACES[0], 0.006, 0.012, 0.1), *PLACES[1:]]
    pair, label_0, label_1 = DrawnScene(SIZES).pair((looking_down(), looking_down(z=0.3)), (PLACES, there))
    motions = {1: motion_seen_from(pair.reference.X_WC, PLACES[0], there[0])}
    out, depth = draw_labels(pair.reference, pair.current, label_0, motions)
    for number in (1, 2, 3):
        assert intersection_over_union(out == number, label_1 == number) > 0.95
        # The boxes' tops are level; a gap has the depth of what is beside it.
        top = cv2.erode((out == number).astype(np.uint8), np.ones((9, 9), np.uint8)) > 0
        np.testing.assert_allclose(depth[top], pair.current.depth[top], atol=3e-4)
    np.testing.assert_array_equal(depth > 0, out > 0)


def test_of_what_is_drawn_the_nearest_is_seen_and_what_is_behind_the_camera_is_not() -> None:
    frame, label = DrawnScene(SIZES).frame(0, looking_down(), PLACES)

    def drawn(p_C: list[float]) -> np.ndarray:
        motion = np.eye(4)
        motion[:3, 3] = p_C
        return draw_labels(frame, frame, label, {1: motion})[0]

    onto_2 = PLACES[1][:2, 3] - PLACES[0][:2, 3]
    for dz, visible in ((-0.1, True), (0.1, False)):  # C looks down, so y is turned
        covered = drawn([onto_2[0], -onto_2[1], dz])[label == 2]
        assert bool(np.mean(covered == 1) > 0.5) is visible
        assert np.isin(covered, (1, 2)).all()
    assert not (drawn([0, 0, -1.0]) == 1).any()


def test_every_pixel_above_the_table_has_a_label_and_no_other() -> None:
    pair, label_0, label_1 = DrawnScene(SIZES).pair((looking_down(), looking_down(0.05)), (PLACES, PLACES))
    out = carried(pair, np.where(label_0 == 2, UNKNOWN, label_0), {}, label_1)
    np.testing.assert_array_equal(out > 0, label_1 > 0)
    assert intersection_over_union(out == UNKNOWN, label_1 == 2) > 0.97


def test_two_bodies_that_move_together_share_the_motion_and_keep_their_labels() -> None:
    places = [planar(-0.035, 0.0), planar(0.031, 0.0), PLACES[2]]
    there = [*(move(place, 0.0, 0.02, 0.0) for place in places[:2]), PLACES[2]]
    pair, label_0, label_1 = DrawnScene(SIZES).pair((looking_down(),) * 2, (places, there))
    X = motion_seen_from(pair.reference.X_WC, places[0], there[0])
    out = carried(pair, label_0, {1: X, 2: X}, label_1)
    for number in (1, 2):
        assert intersection_over_union(out == number, label_1 == number) > 0.97


def test_nothing_creeps_over_30_renewals_of_the_reference() -> None:
    rng, scene = np.random.default_rng(1), DrawnScene(SIZES)
    places, (before, label) = PLACES, scene.frame(0, looking_down(), PLACES, rng)
    for k in range(1, 31):
        # Body 1 is pushed and turns, the camera swings to and fro, and nothing is a whole pixel.
        there = [move(places[0], 0.0007, 0.0011, 0.011), *places[1:]]
        camera = looking_down(0.02 * np.sin(k / 3), 0.01 * np.cos(k / 4), tilt=0.02 * np.sin(k / 5))
        now, truth = scene.frame(k, camera, there, rng)
        motions = {1: motion_seen_from(before.X_WC, places[0], there[0])}
        label = carried(FramePair(before, now), label, motions, truth)
        before, places = now, there
    for number in (1, 2, 3):
        assert intersection_over_union(label == number, truth == number) > 0.95


def test_what_comes_into_view_beside_a_known_object_is_unknown() -> None:
    # Two boxes a centimetre apart; the left one's neighbour is outside the first view.
    left, right = planar(0.195, 0.0), planar(0.265, 0.0)
    scene = DrawnScene([(0.06, 0.06, 0.03)] * 2)
    pair, label_0, label_1 = scene.pair((looking_down(), looking_down(0.12)), ([left, right],) * 2)
    assert not np.any(label_0 == 2)
    out = carried(pair, label_0, {}, label_1)
    assert intersection_over_union(out == 1, label_1 == 1) > 0.97
    assert np.mean(out[label_1 == 2] == UNKNOWN) > 0.97


def test_what_is_put_down_between_two_frames_is_unknown_though_it_touches_a_known_object() -> None:
    scene, away = DrawnScene([(0.06, 0.06, 0.03), (0.06, 0.06, 0.05)]), planar(1.0, 1.0)
    pair, label_0, label_1 = scene.pair(
        (looking_down(),) * 2, ([planar(0, 0), away], [planar(0, 0), planar(0.06, 0)])
    )
    out = carried(pair, label_0, {}, label_1)
    assert intersection_over_union(out == 1, label_1 == 1) > 0.85
    assert np.mean(out[label_1 == 2] == UNKNOWN) > 0.85


def test_what_is_remembered_fills_what_the_reference_did_not_see() -> None:
    left, right = planar(0.0, 0.0), planar(0.28, 0.0)
    scene = DrawnScene([(0.06, 0.06, 0.03)] * 2)
    pair, label_0, label_1 = scene.pair((looking_down(), looking_down(0.12)), ([left, right],) * 2)
    remembered = np.where(label_1 == 2, np.uint16(7), np.uint16(0))
    out = carried(pair, label_0, {}, label_1, remembered)
    assert (out[label_1 == 2] == 7).all()
    assert (out[label_1 == 1] == 1).all()


def test_depth_that_is_missing_at_t_is_filled_from_close_by() -> None:
    pair, label_0, label_1 = DrawnScene(SIZES).pair((looking_down(),) * 2, (PLACES, PLACES))
    holes = np.random.default_rng(2).uniform(size=CAMERA.shape) < 0.2
    pair.current.depth[holes] = 0
    out = carried(pair, label_0, {}, label_1)
    for number in (1, 2, 3):
        assert intersection_over_union(out == number, label_1 == number) > 0.97


def test_an_empty_table_carries_nothing() -> None:
    pair, label_0, _ = DrawnScene(SIZES).pair((looking_down(),) * 2, (PLACES, PLACES))
    assert not carried(pair, label_0, {}, NOTHING).any()


def test_the_nearest_label_reaches_as_far_as_asked_and_not_farther() -> None:
    label = np.zeros((20, 40), np.uint16)
    label[5:15, 5:10], label[5:15, 30:35] = 3, 4
    inside = np.zeros(label.shape, bool)
    inside[5:15, 5:35] = True
    out = nearest_label(label, inside, np.ones(label.shape, np.float32), reach=4.0)
    assert (out[5:15, 5:13] == 3).all()
    assert (out[5:15, 15:25] == UNKNOWN).all()
    assert (out[5:15, 27:35] == 4).all()
    assert not out[~inside].any()


@pytest.mark.parametrize(("lower", "width", "taken"), [(0.007, 20, 4), (0.009, 20, 0), (0.009, 5, 4)])
def test_what_a_thing_uncovers_below_it_is_not_its_own_but_its_rim_is(lower, width, taken) -> None:
    """Within 4 pixels, 8 mm of depth and a rim of six pixels."""
    label = np.zeros((20, 40), np.uint16)
    label[:, :10] = 3
    inside = np.zeros(label.shape, bool)
    inside[:, : 10 + width] = True
    depth = np.where(label > 0, 1.0, 1.0 + lower).astype(np.float32)
    out = nearest_label(label, inside, depth, reach=4.0)
    assert (out[:, 10 : 10 + taken] == 3).all()
    assert (out[:, 10 + taken : 10 + width] == UNKNOWN).all()


def test_without_any_label_all_that_stands_there_is_unknown() -> None:
    inside = np.zeros((20, 40), bool)
    inside[5:15, 5:35] = True
    out = nearest_label(np.zeros(inside.shape, np.uint16), inside, np.ones(inside.shape, np.float32), reach=4.0)
    np.testing.assert_array_equal(out, np.where(inside, UNKNOWN, 0))


def test_points_are_seen_in_their_nearest_pixels_and_beyond_each_side_or_behind_in_none() -> None:
    z = 0.7
    seen = {
        (0.0, 0.0): True,
        (-0.49, -0.49): True,
        (-0.51, 3.0): False,
        (3.0, -0.51): False,
        (319.49, 239.49): True,
        (319.51, 5.0): False,
        (5.0, 239.51): False,
        (12.6, 7.4): True,
    }
    uv = np.array(list(seen))
    k = CAMERA
    p_CQ = z * np.column_stack([(uv[:, 0] - k.cx) / k.fx, (uv[:, 1] - k.cy) / k.fy, np.ones(len(uv))])
    vu, inside = pixels_of(p_CQ, k)
    assert inside.tolist() == list(seen.values())
    np.testing.assert_array_equal(vu[inside], np.rint(uv[inside])[:, ::-1])
    assert not pixels_of(p_CQ * [1, 1, -1], k)[1].any()
