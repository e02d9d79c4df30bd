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
