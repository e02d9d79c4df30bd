"""Drawn pairs: the flow that is said to be true carries one image onto the other."""

from dataclasses import replace

import cv2
import numpy as np

from riseg_drake.learned.rigid_motion_pairs import PairParameters, draw_pair

PARAMETERS = PairParameters(width=96, height=64)


def test_the_second_image_carried_back_by_the_flow_is_the_first():
    quiet = replace(PARAMETERS, color_noise=0.0, bodies_max=2)
    carried, still = [], []
    for seed in range(8):
        pair = draw_pair(np.random.default_rng(seed), quiet)
        v, u = np.mgrid[: quiet.height, : quiet.width].astype(np.float32)
        back = cv2.remap(pair.color_1, u + pair.flow[..., 0], v + pair.flow[..., 1], cv2.INTER_LINEAR)
        inside = (back > 0).all(-1)
        carried.append(np.abs(back.astype(float) - pair.color_0)[inside].mean())
        still.append(np.abs(pair.color_1.astype(float) - pair.color_0)[inside].mean())
    assert np.median(carried) < 0.3 * np.median(still)


def test_where_nothing_moves_nothing_flows():
    still = replace(PARAMETERS, body_motion=0.0, body_turn=0.0, camera_motion=0.0, camera_turn=0.0)
    pair = draw_pair(np.random.default_rng(1), still)
    np.testing.assert_allclose(pair.flow, 0, atol=1e-3)


def test_bodies_move_apart_from_the_table():
    pair = draw_pair(np.random.default_rng(0), replace(PARAMETERS, camera_motion=0.0, camera_turn=0.0))
    assert pair.on_body.any()
    np.testing.assert_allclose(pair.flow[~pair.on_body], 0, atol=1e-3)
    assert np.abs(pair.flow[pair.on_body]).max() > 1


def test_no_table_is_blank_and_bodies_are_as_often_as_is_asked():
    def pairs(blank_bodies):
        quiet = replace(PARAMETERS, color_noise=0.0, bodies_max=1, blank_bodies=blank_bodies)
        return [draw_pair(np.random.default_rng(seed), quiet) for seed in range(20)]

    def colors_of_bodies(pairs):  # a blank one shows nothing but its shades
        return np.mean([len(np.unique(p.color_0[p.on_body], axis=0)) for p in pairs])

    all_blank, none_blank = pairs(1.0), pairs(0.0)
    assert min(p.color_0[~p.on_body].std(0).max() for p in all_blank) > 1.0
    assert colors_of_bodies(all_blank) < 0.4 * colors_of_bodies(none_blank)


def test_the_same_seed_draws_the_same_pair():
    one, two = (draw_pair(np.random.default_rng(5), PARAMETERS) for _ in range(2))
    np.testing.assert_array_equal(one.color_1, two.color_1)
    np.testing.assert_array_equal(one.flow, two.flow)
