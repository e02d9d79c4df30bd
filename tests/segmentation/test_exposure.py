"""Frames of different exposure are brought to one, and only those."""

from dataclasses import replace

import numpy as np
import pytest

from riseg_drake.geometry.rgbd import FramePair
from riseg_drake.segmentation.exposure import with_equal_exposure
from tests.segmentation.drawn_scene import DrawnScene, Texture, looking_down, planar


@pytest.fixture
def pair() -> FramePair:
    scene = DrawnScene([(0.07, 0.06, 0.03)], table=Texture(9, contrast=8))
    cameras = looking_down(), looking_down(0.01, -0.005, tilt=0.02)
    boxes = [planar(0.0, 0.0)], [planar(0.02, 0.0, 0.1)]
    return scene.pair(cameras, boxes, np.random.default_rng(0))[0]


def exposed(pair: FramePair, factor: float) -> FramePair:
    color = np.clip(np.rint(pair.current.color * factor), 0, 255).astype(np.uint8)
    return replace(pair, current=replace(pair.current, color=color))


@pytest.mark.parametrize("factor", [0.7, 0.85, 1.1, 1.3])
def test_the_current_frame_gets_the_exposure_of_the_reference(pair, factor) -> None:
    matched = with_equal_exposure(exposed(pair, factor)).current
    assert matched.gain == pytest.approx(1 / factor, rel=0.015)
    assert np.median(np.abs(matched.gray - pair.current.gray)) < 1.5


def test_the_next_frame_is_compared_with_what_the_reference_was_matched_to(pair) -> None:
    first = with_equal_exposure(exposed(pair, 0.8)).current
    second = with_equal_exposure(FramePair(first, exposed(pair, 0.6).current)).current
    assert second.gain == pytest.approx(1 / 0.6, rel=0.02)


def test_without_a_change_the_pair_stays_as_it_is(pair) -> None:
    assert with_equal_exposure(pair) is pair


def test_where_too_little_is_seen_by_both_the_pair_stays_as_it_is(pair) -> None:
    dark = exposed(pair, 0.02)
    assert with_equal_exposure(dark) is dark
