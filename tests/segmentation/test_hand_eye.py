from dataclasses import replace

import cv2
import numpy as np
import pytest

from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.geometry.rgbd import Frame
from riseg_drake.segmentation.hand_eye import EXPECTED, OBSERVED, draw_flow_error, flow_errors, verdict

CAMERA = Intrinsics(320, 240, 300.0, 300.0, 160.0, 120.0)
HEIGHT = 0.5
"""Of the camera above a patterned table, m."""
PATTERN = cv2.GaussianBlur(np.random.default_rng(0).uniform(0, 255, (800, 900)).astype(np.float32), (0, 0), 3)
PATTERN = np.clip((PATTERN - PATTERN.mean()) * 12 + 128, 0, 255).astype(np.uint8)


def frame(k, x, believed_x=None):
    """What is seen from x m along the image's rows; `believed_x` is where the arm says it is."""
    shift = CAMERA.fx * x / HEIGHT
    view = cv2.warpAffine(
        PATTERN, np.array([[1.0, 0, -200 - shift], [0, 1.0, -200]]), (CAMERA.width, CAMERA.height)
    )
    X_WC = np.eye(4)
    X_WC[0, 3] = x if believed_x is None else believed_x
    return Frame(
        sequence=k,
        time=0.1 * k,
        intrinsics=CAMERA,
        color=np.repeat(view[..., None], 3, axis=2),
        depth=np.full((CAMERA.height, CAMERA.width), HEIGHT, np.float32),
        X_WC=X_WC,
        robot=np.zeros((CAMERA.height, CAMERA.width), bool),
    )


def test_a_camera_that_is_where_it_is_said_to_be_is_good():
    median, words = verdict(flow_errors([frame(k, 0.004 * k) for k in range(8)]))
    assert median < 0.3
    assert words == "good"


def test_an_error_of_the_pose_shows_in_pixels():
    # Said to have moved by half as much again: 3 px for a true flow of 6 px and more.
    errors = flow_errors([frame(k, 0.004 * k, believed_x=0.006 * k) for k in range(8)])
    median, words = verdict(errors)
    assert median == pytest.approx(CAMERA.fx * 0.002 * 2 / HEIGHT, rel=0.3)
    assert words.startswith("bad")
    assert np.median([error.mean[0] for error in errors]) == pytest.approx(median, rel=0.2)


def test_pictures_without_motion_or_texture_say_nothing():
    assert flow_errors([frame(k, 0.0) for k in range(4)]) == []
    blank = [frame(k, 0.004 * k) for k in range(4)]
    for image in blank:
        image.color[:] = 128
    assert flow_errors(blank) == []


def test_both_arrows_are_seen_where_the_two_flows_agree():
    (error, *_) = flow_errors([frame(k, 0.004 * k) for k in range(4)])
    agreed = replace(error, observed=error.expected)
    picture = draw_flow_error(agreed)
    starts = [(v, u) for v in range(16, 240, 32) for u in range(16, 320, 32) if error.usable[v, u]]
    assert len(starts) > 20
    for v, u in starts:
        around = picture[max(v - 12, 0) : v + 13, max(u - 30, 0) : u + 31]
        for color in (EXPECTED, OBSERVED):
            assert (around == color).all(axis=-1).sum() >= 8, (v, u, color)


@pytest.mark.parametrize("speed", [0.004, 0.012])
def test_each_frame_is_compared_with_the_latest_before_it_from_which_4_pixels_of_motion_are_to_be_seen(speed):
    # 600 pixels a metre: 2.4 or 7.2 pixels from frame to frame.
    errors = flow_errors([frame(k, speed * k) for k in range(4)])
    step = 2 if speed < 4 / 600 else 1
    assert [(e.pair.reference.sequence, e.pair.current.sequence) for e in errors] == [
        (k - step, k) for k in range(step, 4)
    ]
    for error in errors:
        np.testing.assert_allclose(error.expected[..., 0], -600 * speed * step, atol=1e-3)
        np.testing.assert_allclose(error.mean, 0, atol=0.1)
        assert error.size.shape == (error.usable.sum(),)


def test_a_camera_that_moved_by_more_than_25_pixels_is_compared_with_nothing():
    assert flow_errors([frame(0, 0.0), frame(1, 26 / 600)]) == []
    assert len(flow_errors([frame(0, 0.0), frame(1, 24 / 600)])) == 1
