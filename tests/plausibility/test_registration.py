from dataclasses import replace

import numpy as np
import pytest

from riseg_drake.plausibility.limits import PlausibilityLimits
from riseg_drake.plausibility.registration import REACH, doubts_about_registration, edge_agreement
from tests.segmentation.drawn_scene import Blank, DrawnScene, looking_down, planar

LIMITS = PlausibilityLimits()


@pytest.fixture(scope="module")
def frames():
    """Gray boxes on a white table: colour has edges where depth has them, and nowhere else."""
    scene = DrawnScene(
        [(0.09, 0.06, 0.08), (0.05, 0.07, 0.09)], textures=[Blank(60.0), Blank(110.0)], table=Blank(230.0)
    )
    rng = np.random.default_rng(0)
    poses = [planar(-0.06, 0.02, 0.4), planar(0.07, -0.01, -0.7)]
    return [scene.frame(k, looking_down(x=0.01 * k), poses, rng)[0] for k in range(3)]


def shifted(frames, v, u):
    return [replace(frame, depth=np.roll(frame.depth, (v, u), (0, 1))) for frame in frames]


def test_edges_agree_best_where_they_are(frames):
    agreement = edge_agreement(frames)
    v, u = np.unravel_index(np.argmax(agreement), agreement.shape)
    assert np.hypot(v - REACH[0], u - REACH[1]) <= 1.5
    assert doubts_about_registration(frames, 1.0, LIMITS) == []


@pytest.mark.parametrize(("v", "u"), [(0, 8), (0, -12), (5, 6), (0, 16)])
def test_depth_that_lies_beside_colour_is_told_by_how_much(frames, v, u):
    agreement = edge_agreement(shifted(frames, v, u))
    i, j = np.unravel_index(np.argmax(agreement), agreement.shape)
    assert abs(i - REACH[0] + v) <= 1
    assert abs(j - REACH[1] + u) <= 1
    (line,) = doubts_about_registration(shifted(frames, v, u), 2.0, LIMITS)
    assert f"shifted by ({2 * (j - REACH[1]):+.0f}, {2 * (i - REACH[0]):+.0f}) pixels" in line


def test_shadows_beside_steps_are_no_shift(frames):
    """As a stereo camera has them: no depth on 6 pixels left of what is in front."""
    hidden = []
    for frame in frames:
        depth = frame.depth.copy()
        step = np.zeros(depth.shape, bool)
        step[:, 1:] = depth[:, :-1] - depth[:, 1:] > 0.02
        for pixel in range(1, 7):
            depth[:, :-pixel][step[:, pixel:]] = 0
        hidden.append(replace(frame, depth=depth))
    assert doubts_about_registration(hidden, 1.0, LIMITS) == []


def test_an_empty_table_says_nothing(frames):
    flat = [replace(frame, depth=np.full_like(frame.depth, 0.45)) for frame in frames]
    assert edge_agreement(flat) is None
    assert doubts_about_registration(flat, 1.0, LIMITS) == []
