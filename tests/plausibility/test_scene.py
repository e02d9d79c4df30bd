from dataclasses import replace

import numpy as np
import pytest

from riseg_drake.plausibility.limits import PlausibilityLimits
from riseg_drake.plausibility.scene import doubts_about_content, doubts_about_jumps
from riseg_drake.plausibility.views import small_view
from tests.segmentation.drawn_scene import DrawnScene, Texture, looking_down, planar

LIMITS = PlausibilityLimits()


def pair(*places, size=(0.06, 0.05, 0.04)):
    """Views of a box at some places along x, by a camera that looks down from 0.45 m."""
    scene = DrawnScene([size], table=Texture(9, contrast=20))
    rng = np.random.default_rng(0)
    return [
        small_view(scene.frame(k, looking_down(), [planar(x, 0.0)], rng)[0], LIMITS.width)
        for k, x in enumerate(places)
    ]


def test_a_thing_that_jumps_is_told_how_far():
    """80 mm at 0.41 m are 60 of 320 pixels."""
    (line,) = doubts_about_jumps([tuple(pair(-0.04, 0.04))], LIMITS)
    share = float(line.split("jump by ")[1].split("%")[0]) / 100
    assert share == pytest.approx(0.08 * 308.1 / 0.41 / 320, abs=0.01)


def test_what_flow_can_follow_does_not_jump():
    assert doubts_about_jumps([tuple(pair(0.0, 0.02))], LIMITS) == []
    assert doubts_about_jumps([], LIMITS) == []


def test_a_thing_that_fills_the_image_hides_the_table():
    (line,) = doubts_about_content(pair(0.0, size=(0.40, 0.26, 0.02)), LIMITS)
    assert line.startswith("one thing fills")
    assert doubts_about_content(pair(0.0), LIMITS) == []


def test_an_image_that_is_mostly_without_depth_is_told_so():
    (view,) = pair(0.0)
    depth = view.frame.depth.copy()
    depth[:, :200] = 0
    (line,) = doubts_about_content([replace(view, frame=replace(view.frame, depth=depth))], LIMITS)
    assert line.startswith("62% of the image has no depth")
