from dataclasses import replace

import cv2
import numpy as np
import pytest

from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.geometry.rgbd import Frame
from riseg_drake.plausibility.limits import PlausibilityLimits
from riseg_drake.plausibility.registration import (
    REACH,
    best_shift,
    doubts_about_registration,
    edge_agreement,
)
from tests.segmentation.drawn_scene import Blank, DrawnScene, Texture, looking_down, planar

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


@pytest.mark.parametrize(("v", "u"), [(0, 8), (0, -12), (4, 6), (0, 16)])
def test_depth_that_lies_beside_colour_is_told_by_how_much(frames, v, u):
    beside = shifted(frames, v, u)
    shift = best_shift(edge_agreement(beside), LIMITS.shift)
    assert abs(shift.u + u) <= 1
    assert abs(shift.v + v) <= 1
    (line,) = doubts_about_registration(beside, 2.0, LIMITS)
    assert f"shifted by ({2 * shift.u:+.0f}, {2 * shift.v:+.0f}) pixels" in line


def smeared(frames):
    """Depth of low quality: its steps wander by 4 pixels to both sides, differently in each row."""
    rng = np.random.default_rng(1)
    wander = cv2.GaussianBlur(rng.normal(0, 1, (240, 1)), (1, 0), 0, sigmaY=3.0)
    by = np.round(4 * wander / np.abs(wander).max()).astype(int).ravel()
    return [
        replace(f, depth=np.stack([np.roll(row, n) for row, n in zip(f.depth, by, strict=True)]))
        for f in frames
    ]


def test_depth_of_low_quality_is_told_by_the_middle_of_where_it_agrees(frames):
    """Its agreement is flat about the best shift, and hardly better there than 4 pixels beside."""
    poor = smeared(frames)
    assert doubts_about_registration(poor, 1.0, LIMITS) == []
    shift = best_shift(edge_agreement(shifted(poor, 0, 8)), LIMITS.shift)
    assert shift.u == pytest.approx(-8, abs=1.5)
    assert len(doubts_about_registration(shifted(poor, 0, 8), 1.0, LIMITS)) == 1


def test_an_edge_that_runs_another_way_counts_half():
    """A vertical step of depth over stripes of colour: 1 where they are vertical, 0 where horizontal."""
    depth = np.full((120, 160), 0.5, np.float32)
    depth[:, :80] = 0.4
    stripes = np.full((120, 160, 3), 60, np.uint8)
    stripes[:, 80:] = 200
    levels = np.full((120, 160, 3), 60, np.uint8)
    levels[60:] = 200
    agreement = {}
    for name, color in (("along", stripes), ("across", levels)):
        k = Intrinsics(160, 120, 150.0, 150.0, 79.5, 59.5)
        frame = Frame(0, 0.0, k, color, depth, np.eye(4), np.zeros((120, 160), bool))
        agreement[name] = edge_agreement([frame]).max()
    assert agreement["along"] > 0.9
    assert agreement["across"] < 0.02


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


@pytest.mark.parametrize("width", [64, 96, 160, 320])
def test_texture_that_agrees_better_elsewhere_by_chance_is_no_shift(width):
    """Little is seen in small images, and all that is drawn is as strong as the edges: of twelve scenes a size
    some agree 1.03 times as well elsewhere, but not by more than chance does."""
    times = width / 320
    camera = Intrinsics(width, width * 3 // 4, 308 * times, 308 * times, 158 * times, 119 * times)
    doubts, told = [], 0  # with all that is asked; by the gain alone
    for seed in range(12):
        scene = DrawnScene(
            [(0.09, 0.08, 0.04), (0.07, 0.09, 0.05)], table=Texture(seed, contrast=10), intrinsics=camera
        )
        rng = np.random.default_rng(seed)
        poses = [[planar(-0.07, 0.003 * k, 0.3 + seed), planar(0.07, 0, 0.5 * seed)] for k in range(6)]
        film = [scene.frame(k, looking_down(), poses[k], rng)[0] for k in range(6)]
        doubts += doubts_about_registration(film, 1.0, LIMITS)
        shift = best_shift(edge_agreement(film), LIMITS.shift)
        told += np.hypot(shift.u, shift.v) > LIMITS.shift and shift.best > LIMITS.shift_gain * shift.here
    assert doubts == []
    assert (told > 0) == (width < 320)
